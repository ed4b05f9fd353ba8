// Arc tangent for eight lanes: a polynomial instead of libm, for speed and for the same bits with
// every C library.
#pragma once

#include <cstddef>
#include <iterator>

#include "dynains/detail/lanes.hpp"

namespace dynains::detail {

inline constexpr float kPi = 3.14159265358979323846F;

/// Angle of (x, y) in [-pi, pi]; 0 for the origin. Absolute error below 1e-6 rad (tested over the
/// whole circle). Signed zeros are treated as positive: (-1, -0.0) gives +pi, never -pi.
template <class Float>
Float arc_tangent2(const Float& y, const Float& x) {
  static constexpr Constant8 kZero(0.0F), kTurn(kPi), kQuarter(0.5F * kPi);
  // Minimax fit of atan(t) / t in t^2 over [0, 1]; error 3.3e-7 including float rounding.
  static constexpr Constant8 kFit[] = {6.811792963e-03F,  -3.360421956e-02F, 7.962366939e-02F,
                                       -1.323334277e-01F, 1.980781555e-01F,  -3.331736922e-01F,
                                       9.999961257e-01F};
  const Float ax = abs(x);
  const Float ay = abs(y);
  const Float larger = max(ax, ay);
  const Float t = keep(larger > kZero, min(ax, ay) / larger);
  const Float u = t * t;
  Float p = kFit[0];
  for (std::size_t i = 1; i < std::size(kFit); ++i) p = p * u + kFit[i];

  Float angle = p * t;
  angle = select(ay > ax, kQuarter - angle, angle);
  angle = select(x < kZero, kTurn - angle, angle);
  return select(y < kZero, kZero - angle, angle);
}

}  // namespace dynains::detail
