// Angles for eight lanes: a polynomial instead of libm, for speed and for the same bits with every
// C library. The tangent of half an angle is y / (length + x): who has the length needs neither
// octants nor swaps.
#pragma once

#include <cstddef>
#include <iterator>

#include "dynains/simd/pack.hpp"

namespace dynains::detail {

inline constexpr float kPi = 3.14159265358979323846F;

/// Twice the angle whose tangent is y / x, for x >= |y|; next to 0 where x is below 1e-18.
template <class Float>
Float twice_arc_tangent(const Float& y, const Float& x) {
  static constexpr PackConstant kTiny(1e-18F);
  // Minimax fit of 2 atan(t) / t in t^2 over [0, 1]; error 6.6e-7 including float rounding.
  static constexpr PackConstant kFit[] = {
      1.3623585925e-02F, -6.7208439112e-02F, 1.5924733877e-01F, -2.6466685534e-01F,
      3.9615631104e-01F, -6.6634738445e-01F, 1.9999922514F};
  const Float t = y / max(x, Float(kTiny));
  const Float u = t * t;
  Float p = kFit[0];
  for (std::size_t i = 1; i < std::size(kFit); ++i) p = p * u + kFit[i];
  return p * t;
}

/// Angle of (x, y) in [-pi, pi], given its length, which is at most 1e18; next to 0
/// where that is below 1e-18. Absolute error below 1e-6 rad (tested over the whole circle). Signed
/// zeros are treated as positive: (-1, -0.0) gives +pi, never -pi.
template <class Float>
Float azimuth_of(const Float& y, const Float& x, const Float& length) {
  static constexpr PackConstant kZero(0.0F), kHalfTurn(kPi);
  const Float from_axis = twice_arc_tangent(y, length + abs(x));
  return select(x < kZero, with_sign_of(y + kZero, Float(kHalfTurn)) - from_axis, from_axis);
}

/// Angle of (range, z) for range >= 0: the elevation, if `range` is a horizontal distance.
template <class Float>
Float elevation_of(const Float& z, const Float& range, const Float& length) {
  return twice_arc_tangent(z, length + range);
}

}  // namespace dynains::detail
