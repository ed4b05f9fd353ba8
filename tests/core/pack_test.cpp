#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

using detail::kPackWidth;

// Applies each operation to pairs of numbers with one kind of packs. Returns a row for each
// operation, with one result for each pair.
template <class Packs>
std::vector<std::vector<std::uint32_t>> results(const std::vector<float>& a,
                                                const std::vector<float>& b) {
  using Float = typename Packs::Float;
  using Int = typename Packs::Int;
  std::vector<std::vector<std::uint32_t>> out;
  std::size_t row = 0;
  const auto put_number = [&](std::uint32_t number) {
    if (row == out.size()) out.emplace_back();
    out[row].push_back(number);
  };
  const auto put = [&](const Float& value) {
    float numbers[Packs::kCount];
    value.store(numbers);
    for (const float number : numbers) {
      std::uint32_t bits;
      std::memcpy(&bits, &number, sizeof(bits));
      put_number(bits);
    }
    ++row;
  };
  const auto put_int = [&](const Int& value) {
    std::int32_t numbers[Packs::kCount];
    value.store(numbers);
    for (const std::int32_t number : numbers) put_number(static_cast<std::uint32_t>(number));
    ++row;
  };
  const auto put_bits = [&](unsigned bits) {
    for (std::size_t k = 0; k < Packs::kCount; ++k) put_number(bits >> k & 1U);
    ++row;
  };
  for (std::size_t i = 0; i < a.size(); i += Packs::kCount) {
    row = 0;
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
    put_bits((x >= y).bits());
    put_bits((x > y).bits());
    put_bits((x < y).bits());
    put_bits(((x <= y) & ~(x < y)).bits());
    const detail::PackConstant limit(1e6F);
    const detail::PackConstant lower(-1e6F);
    const Float small = max(min(x, limit), lower);
    put_int(truncate(small));
    put_int(floor(small));
    put_int((x < y) & truncate(small));
    put(detail::with_sign_of(y, x));
    put_int((truncate(small) << 3) + (truncate(small) >> 2) - (truncate(small) & Int(77)));
    put_int(multiply(truncate(small), 1234567));
    put_int(select(truncate(small) < Int(5), truncate(small), Int(-1)));
    put_bits((truncate(small) == truncate(max(min(y, limit), lower))).bits());
    put(to_float(truncate(small)));
  }
  return out;
}

// Sums of every eight numbers.
template <class Packs>
std::vector<float> sums(const std::vector<float>& a) {
  std::vector<float> out;
  for (std::size_t i = 0; i < a.size(); i += kPackWidth) {
    out.push_back(sum(Packs::Float::load(&a[i])));
  }
  return out;
}

// Calls `test` with the other kinds of packs that this processor supports, compiled for them.
template <class Test>
void with_larger_registers(Test&& test) {
  if (detail::has_avx2()) {
    INFO("eight numbers in one register");
    detail::with_avx2(test);
  }
}

TEST_CASE("all kinds of packs give equal bits") {
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
    a.push_back(random.uniform_float(-100.0, 100.0));
    b.push_back(random.uniform_float(-100.0, 100.0));
  }
  // Comparisons with NaN must not depend on the width either.
  constexpr std::size_t kMaxCount = detail::kPackWidth;
  a.resize(a.size() / kMaxCount * kMaxCount);
  b.resize(a.size());
  for (std::size_t i = 0; i < 2 * kMaxCount; ++i) {
    a.push_back(i % 2 == 0 ? std::numeric_limits<float>::quiet_NaN() : 1.0F);
    b.push_back(i % 4 < 2 ? 2.0F : std::numeric_limits<float>::quiet_NaN());
  }
  const std::size_t finite = a.size() - 2 * kMaxCount;  // conversions of NaN are undefined
  const std::vector<float> finite_a(a.data(), a.data() + finite);
  const std::vector<float> finite_b(b.data(), b.data() + finite);
  const auto expected = results<detail::BaselinePacks>(finite_a, finite_b);
  CHECK(results<detail::Avx2Packs>(finite_a, finite_b) == expected);
  CHECK(sums<detail::Avx2Packs>(finite_a) == sums<detail::BaselinePacks>(finite_a));
  with_larger_registers([&](auto packs) {
    using Packs = decltype(packs);
    CHECK(results<Packs>(finite_a, finite_b) == expected);
    for (std::size_t i = finite; i < a.size(); i += Packs::kCount) {
      const auto x = Packs::Float::load(&a[i]);
      const auto y = Packs::Float::load(&b[i]);
      float least[Packs::kCount], most[Packs::kCount];
      min(x, y).store(least);
      max(x, y).store(most);
      const unsigned less = (x < y).bits();
      const unsigned at_least = (x >= y).bits();
      for (std::size_t k = 0; k < Packs::kCount; ++k) {
        CAPTURE(a[i + k], b[i + k]);
        CHECK((less >> k & 1U) == (a[i + k] < b[i + k] ? 1U : 0U));
        CHECK((at_least >> k & 1U) == (a[i + k] >= b[i + k] ? 1U : 0U));
        // min and max return the second number if either is NaN.
        const bool any = std::isnan(a[i + k]) || std::isnan(b[i + k]);
        CHECK((least[k] == std::min(a[i + k], b[i + k]) || any));
        if (any) {
          CHECK(std::memcmp(&least[k], &b[i + k], sizeof(float)) == 0);
          CHECK(std::memcmp(&most[k], &b[i + k], sizeof(float)) == 0);
        }
      }
    }
  });
  for (std::size_t i = finite; i < a.size(); i += kPackWidth) {
    const auto baseline_a = detail::BaselinePacks::Float::load(&a[i]);
    const auto baseline_b = detail::BaselinePacks::Float::load(&b[i]);
    const auto avx2_a = detail::Avx2Packs::Float::load(&a[i]);
    const auto avx2_b = detail::Avx2Packs::Float::load(&b[i]);
    CHECK((baseline_a < baseline_b).bits() == (avx2_a < avx2_b).bits());
    CHECK((baseline_a >= baseline_b).bits() == (avx2_a >= avx2_b).bits());
    CHECK((bits_of(min(baseline_a, baseline_b)) ^ bits_of(max(baseline_b, baseline_a))).bits() ==
          (bits_of(min(avx2_a, avx2_b)) ^ bits_of(max(avx2_b, avx2_a))).bits());
  }
}

TEST_CASE("find_changes and for_each_run agree with a loop over single numbers") {
  Random random(21);
  const auto random_values = [&](std::size_t count) {
    std::vector<std::uint32_t> values(count);
    for (std::uint32_t& value : values)
      value = static_cast<std::uint32_t>(random.uniform(0.0, 2.5));
    return values;
  };
  const auto check = [&](auto packs) {
    using Packs = decltype(packs);
    for (int round = 0; round < 200; ++round) {
      const auto count = static_cast<std::size_t>(random.uniform(0.0, 64.999));
      const std::vector<std::uint32_t> values = random_values(count + 1);
      std::uint64_t changes = 0;
      for (std::size_t i = 0; i < count; ++i) {
        changes |= std::uint64_t{values[i + 1] != values[i]} << i;
      }
      CHECK(detail::find_changes<Packs>(count, values.data() + 1) == changes);
    }
    // More than two words of numbers.
    for (const std::size_t count : {0U, 1U, 2U, 64U, 65U, 66U, 129U, 200U}) {
      const std::vector<std::uint32_t> values = random_values(count);
      std::size_t next = 0;
      detail::for_each_run<Packs>(
          count,
          [&](std::size_t begin, std::size_t end) {
            CHECK(begin == next);
            for (std::size_t i = begin; i < end; ++i) CHECK(values[i] == values[begin]);
            CHECK((end == count || values[end] != values[begin]));
            next = end;
          },
          values.data());
      CHECK(next == count);
    }
  };
  check(detail::BaselinePacks());
  with_larger_registers(check);
}

TEST_CASE("for_packs passes each index to the kernel once, in order, for all counts") {
  for (std::size_t count = 0; count <= 3 * detail::kPackWidth; ++count) {
    CAPTURE(count);
    std::vector<float> from(count);
    for (std::size_t i = 0; i < count; ++i) from[i] = static_cast<float>(i + 1);
    std::vector<float> to(count + detail::kPackWidth, -1.0F);
    std::size_t next = 0;
    std::size_t places = 0;
    detail::for_packs(count, [&](auto at) {
      CHECK(at.begin == next);
      next += decltype(at)::kCount;
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
