#include "dynains/simd/pack_geometry.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

float angle(float y, float x) {
  float values[detail::kPackWidth];
  const detail::Float8 ys(y), xs(x);
  detail::azimuth_of(ys, xs, sqrt(xs * xs + ys * ys)).store(values);
  return values[3];
}

double error(float y, float x) {
  return std::abs(static_cast<double>(angle(y, x)) -
                  std::atan2(static_cast<double>(y), static_cast<double>(x)));
}

TEST_CASE("the error of an azimuth is below 1e-6 rad over the whole circle at all scales") {
  double worst = 0.0;
  for (const double radius : {1e-17, 1e-3, 1.0, 37.0, 1e4, 1e17}) {
    for (int i = 0; i < 200000; ++i) {
      const double a = -M_PI + 2.0 * M_PI * (i + 0.5) / 200000.0;
      worst = std::max(worst, error(static_cast<float>(radius * std::sin(a)),
                                    static_cast<float>(radius * std::cos(a))));
    }
  }
  CHECK(worst < 1e-6);
}

TEST_CASE("an azimuth never leaves [-pi, pi] and is defined for zeros of either sign") {
  CHECK(angle(0.0F, 0.0F) == 0.0F);
  CHECK(angle(-0.0F, -0.0F) == 0.0F);
  CHECK(angle(0.0F, 5.0F) == 0.0F);
  CHECK(angle(0.0F, -5.0F) == detail::kPi);
  CHECK(angle(-0.0F, -5.0F) == detail::kPi);  // libm gives -pi
  CHECK(error(5.0F, 0.0F) < 1e-6);
  CHECK(error(-5.0F, -0.0F) < 1e-6);

  const float tiny = std::numeric_limits<float>::denorm_min();
  for (const float x : {-1.0F, -tiny, 0.0F, tiny, 1.0F}) {
    for (const float y : {-1.0F, -tiny, tiny, 1.0F}) {
      INFO(y << ", " << x);
      const bool has_direction = std::abs(x) == 1.0F || std::abs(y) == 1.0F;
      const double limit = has_direction ? 1e-6 : 2.0 * M_PI;
      CHECK(error(y, x) < limit);
    }
  }
  Random random(1);
  for (int i = 0; i < 100000; ++i) {
    const float y = random.uniform_float(-1e-4, 1e-4);
    const float a = angle(y, random.uniform_float(-100.0, 1.0));
    REQUIRE(a >= -detail::kPi);
    REQUIRE(a <= detail::kPi);
  }
}

}  // namespace
}  // namespace dynains::test
