#include "dynains/detail/wide_lanes.hpp"

#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "dynains/detail/arc_tangent.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

using detail::kLanes;

// Every operation on the same pairs of numbers, with one kind of lanes.
template <class Lanes>
std::vector<std::uint32_t> results(const std::vector<float>& a, const std::vector<float>& b) {
  using Float = typename Lanes::Float;
  using Int = typename Lanes::Int;
  std::vector<std::uint32_t> out;
  const auto put = [&](const Float& value) {
    float lanes[kLanes];
    value.store(lanes);
    for (const float lane : lanes) {
      std::uint32_t bits;
      std::memcpy(&bits, &lane, sizeof(bits));
      out.push_back(bits);
    }
  };
  const auto put_int = [&](const Int& value) {
    std::int32_t lanes[kLanes];
    value.store(lanes);
    for (const std::int32_t lane : lanes) out.push_back(static_cast<std::uint32_t>(lane));
  };
  for (std::size_t i = 0; i < a.size(); i += kLanes) {
    const Float x = Float::load(&a[i]);
    const Float y = Float::load(&b[i]);
    put(x + y);
    put(x - y);
    put(x * y);
    put(x / y);
    put(min(x, y));
    put(max(x, y));
    put(abs(x));
    put(sqrt(abs(x)));
    put(keep(x < y, x));
    put(select(x <= y, x, y));
    put(select(x > y, x, y));
    put(float_of((bits_of(x) & bits_of(y)) ^ (bits_of(x) | ~bits_of(y))));
    put(detail::azimuth_of(y, x, sqrt(x * x + y * y)));
    out.push_back((x >= y).bits());
    const detail::Constant8 limit(1e6F);
    const detail::Constant8 lower(-1e6F);
    const Float small = max(min(x, limit), lower);
    put_int(truncate(small));
    put_int(floor(small));
    put_int(keep(x < y, truncate(small)));
    put(detail::with_sign_of(y, x));
    put_int((truncate(small) << 3) + (truncate(small) >> 2) - (truncate(small) & Int(77)));
    put_int(multiply(truncate(small), 1234567));
    put_int(select(truncate(small) < Int(5), truncate(small), Int(-1)));
    put(to_float(truncate(small)));
    std::uint32_t total;
    const float lanes_total = sum(small);
    std::memcpy(&total, &lanes_total, sizeof(total));
    out.push_back(total);
  }
  return out;
}

TEST_CASE("narrow and wide lanes give the same bits") {
  Random random(20);
  std::vector<float> a, b;
  const float special[] = {0.0F, -0.0F, 1.0F, -1.0F, 1e-40F, -1e-40F,  1e30F,     -1e30F,
                           0.5F, -2.5F, 3.0F, -7.0F, 1e-20F, 65536.0F, -65536.5F, 2.9999998F};
  for (const float x : special) {
    for (const float y : special) {
      a.push_back(x);
      b.push_back(y);
    }
  }
  for (int i = 0; i < 8000; ++i) {
    a.push_back(static_cast<float>(random.uniform(-100.0, 100.0)));
    b.push_back(static_cast<float>(random.uniform(-100.0, 100.0)));
  }
  // What a comparison with NaN says must not depend on the width either.
  for (std::size_t i = 0; i < 2 * kLanes; ++i) {
    a.push_back(i % 2 == 0 ? std::numeric_limits<float>::quiet_NaN() : 1.0F);
    b.push_back(i % 4 < 2 ? 2.0F : std::numeric_limits<float>::quiet_NaN());
  }
  a.resize(a.size() / kLanes * kLanes);
  b.resize(a.size());
  const std::size_t sure = a.size() - 2 * kLanes;  // conversions of NaN to integers are anything
  const std::vector<float> sure_a(a.data(), a.data() + sure);
  const std::vector<float> sure_b(b.data(), b.data() + sure);
  CHECK(results<detail::NarrowLanes>(sure_a, sure_b) == results<detail::WideLanes>(sure_a, sure_b));
  for (std::size_t i = sure; i < a.size(); i += kLanes) {
    const auto narrow_a = detail::Float8::load(&a[i]);
    const auto narrow_b = detail::Float8::load(&b[i]);
    const auto wide_a = detail::WideFloat8::load(&a[i]);
    const auto wide_b = detail::WideFloat8::load(&b[i]);
    CHECK((narrow_a < narrow_b).bits() == (wide_a < wide_b).bits());
    CHECK((narrow_a >= narrow_b).bits() == (wide_a >= wide_b).bits());
    CHECK((bits_of(min(narrow_a, narrow_b)) ^ bits_of(max(narrow_b, narrow_a))).bits() ==
          (bits_of(min(wide_a, wide_b)) ^ bits_of(max(wide_b, wide_a))).bits());
  }
}

TEST_CASE("a kernel meets each place once, in order, whatever the count") {
  for (std::size_t count = 0; count <= 3 * kLanes; ++count) {
    CAPTURE(count);
    std::vector<float> from(count);
    for (std::size_t i = 0; i < count; ++i) from[i] = static_cast<float>(i + 1);
    std::vector<float> to(count + kLanes, -1.0F);
    std::size_t next = 0;
    std::size_t places = 0;
    detail::for_lanes(count, [&](auto at) {
      CHECK(at.begin == next);
      next += kLanes;
      places += at.size();
      at.load(from.data()).store(&to[at.begin]);
    });
    CHECK(places == count);
    for (std::size_t i = 0; i < count; ++i) CHECK(to[i] == from[i]);
    for (std::size_t i = count; i < next; ++i) CHECK(to[i] == 0.0F);
    for (std::size_t i = next; i < to.size(); ++i) CHECK(to[i] == -1.0F);
  }
}

}  // namespace
}  // namespace dynains::test
