// Which parts of a correction of a pose the matched planes support.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "dynains/evidence/normal_equations.hpp"
#include "dynains/evidence/symmetric_eigen.hpp"

namespace dynains::detail {

/// Estimates the uncertainty of a correction and removes the parts that it may explain.
///
/// The uncertainty is the sum of two covariances: that of the distances (their variance times the
/// inverse of the normal equations), and that of the choice of surfaces (jackknife: the spread of
/// the corrections that leave out two adjacent sectors around the sensor). The second is large if
/// one object alone decides about a direction, for example a slow vehicle ahead.
class CorrectionSupport {
 public:
  using Vector = NormalEquations::Vector;
  using Matrix = NormalEquations::Matrix;

  /// Forgets all distances.
  void clear() { sectors_.fill(NormalEquations()); }

  /// Adds the distance (m) of a point from its plane, as for NormalEquations. `x`, `y`: the point
  /// in the frame of the sensor.
  void add(float x, float y, const Vector& derivatives, double distance, double weight) {
    sectors_[sector_of(x, y)].add(derivatives, distance, weight);
  }

  /// Removes from `correction` what its uncertainty may explain, by direction: all of it within
  /// kDeviations standard deviations. `equations`: those of all added distances,
  /// with attractions.
  Vector supported(const Vector& correction, const NormalEquations& equations) const {
    constexpr double kDeviations = 3.0;
    Matrix covariance = covariance_of(equations);
    Vector scaled = correction;
    for (std::size_t i = 0; i < 6; ++i) {
      scaled[i] *= unit(i);
      for (std::size_t j = 0; j < 6; ++j) covariance[i][j] *= unit(i) * unit(j);
    }
    const SymmetricEigen<6> eigen = symmetric_eigen<6>(covariance);
    Vector result = {};
    for (std::size_t k = 0; k < 6; ++k) {
      const Vector& direction = eigen.vectors[k];
      double along = 0.0;
      for (std::size_t i = 0; i < 6; ++i) along += direction[i] * scaled[i];
      const double doubt = kDeviations * kDeviations * std::max(eigen.values[k], 0.0);
      if (along * along <= doubt) continue;
      along *= 1.0 - doubt / (along * along);
      for (std::size_t i = 0; i < 6; ++i) result[i] += along * direction[i] / unit(i);
    }
    return result;
  }

 private:
  static constexpr std::size_t kSectors = 32;

  // Rotations are compared with translations as the movement of a point at this distance.
  static double unit(std::size_t i) {
    constexpr double kLever = 10.0;  // m
    return i < 3 ? 1.0 : kLever;
  }

  // Sectors of nearly equal angles, without trigonometric functions.
  static std::size_t sector_of(float x, float y) {
    const double length = std::abs(static_cast<double>(x)) + std::abs(static_cast<double>(y));
    if (!(length > 0.0)) return 0;
    const double t = static_cast<double>(y) / length;
    const double angle = x >= 0.0F ? 1.0 + t : 3.0 - t;  // [0, 4]
    return std::min(static_cast<std::size_t>(angle * (kSectors / 4.0)), kSectors - 1);
  }

  Matrix covariance_of(const NormalEquations& all) const {
    Matrix covariance = {};
    for (std::size_t i = 0; i < 6; ++i) {
      Vector one = {};
      one[i] = all.variance();
      covariance[i] = all.solve(one);
    }
    // Pairs of adjacent sectors, so that no object is divided. They overlap, so each counts half.
    const Vector step = all.solve();
    for (std::size_t sector = 0; sector < kSectors; ++sector) {
      const NormalEquations& next = sectors_[(sector + 1) % kSectors];
      if (sectors_[sector].empty() && next.empty()) continue;
      NormalEquations others = all;
      others -= sectors_[sector];
      others -= next;
      Vector change = others.solve();
      for (std::size_t i = 0; i < 6; ++i) change[i] -= step[i];
      for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t j = 0; j < 6; ++j) covariance[i][j] += 0.5 * change[i] * change[j];
      }
    }
    return covariance;
  }

  std::array<NormalEquations, kSectors> sectors_;
};

}  // namespace dynains::detail
