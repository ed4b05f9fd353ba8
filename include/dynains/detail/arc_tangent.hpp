// Arc tangent for eight lanes: a polynomial instead of libm, for speed and for the same bits with
// every C library.
#pragma once

#include "dynains/detail/lanes.hpp"

namespace dynains::detail {

inline constexpr float kPi = 3.14159265358979323846F;

/// Angle of (x, y) in [-pi, pi]; 0 for the origin. Absolute error below 1e-6 rad (tested over the
/// whole circle). Signed zeros are treated as positive: (-1, -0.0) gives +pi, never -pi.
inline Float8 arc_tangent2(Float8 y, Float8 x) {
  const Float8 zero(0.0F);
  const Float8 ax = abs(x);
  const Float8 ay = abs(y);
  const Float8 larger = max(ax, ay);
  const Float8 t = keep(larger > zero, min(ax, ay) / larger);

  // Minimax fit of atan(t) / t in t^2 over [0, 1]; error 3.3e-7 including float rounding.
  const Float8 u = t * t;
  Float8 p(6.811792963e-03F);
  p = p * u + Float8(-3.360421956e-02F);
  p = p * u + Float8(7.962366939e-02F);
  p = p * u + Float8(-1.323334277e-01F);
  p = p * u + Float8(1.980781555e-01F);
  p = p * u + Float8(-3.331736922e-01F);
  p = p * u + Float8(9.999961257e-01F);

  Float8 angle = p * t;
  angle = select(ay > ax, Float8(0.5F * kPi) - angle, angle);
  angle = select(x < zero, Float8(kPi) - angle, angle);
  return select(y < zero, zero - angle, angle);
}

}  // namespace dynains::detail
