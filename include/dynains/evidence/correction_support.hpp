// Which parts of a correction of a pose the matched planes support.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "dynains/evidence/normal_equations.hpp"
#include "dynains/evidence/symmetric_eigen.hpp"

namespace dynains::detail {

/// Tests a correction against its uncertainty, and removes the parts that the uncertainty may
/// explain.
///
/// The uncertainty is the sum of two covariances: that of the distances (their variance times the
/// inverse of the normal equations), and that of the choice of surfaces (jackknife: the spread of
/// the corrections that leave out two adjacent sectors around the sensor). The second is large if
/// one object alone decides about a direction, for example a slow vehicle ahead.
///
/// Whether a pose is inexact at all is tested against two more errors that many sectors share: all
/// objects that can move may move together, as traffic that starts does, and each beam has a bias
/// of its ranges. The first is the change of the correction without all objects, the second a
/// jackknife over bands of elevation.
class CorrectionSupport {
 public:
  using Vector = NormalEquations::Vector;
  using Matrix = NormalEquations::Matrix;

  /// Presumption about the pose that is corrected.
  enum class Prior {
    kExact,    ///< exact, unless the correction is far from what its uncertainty explains
    kInexact,  ///< as uncertain as a pose whose errors are known
  };

  struct Result {
    Vector step = {};  ///< the part of the correction that is certain
    /// Whether some direction of the correction shows that the pose is inexact.
    bool is_significant = false;
    Matrix covariance = {};  ///< of the correction
  };

  /// Where a distance was measured.
  struct Witness {
    float x, y, z;   ///< m, sensor frame
    bool on_object;  ///< see AlignmentPoints
  };

  /// Whether a plane with this z of its unit normal is a wall rather than ground.
  static bool is_upright(double normal_z) { return std::abs(normal_z) < 0.7; }

  /// Forgets all distances.
  void clear() {
    sectors_.fill(NormalEquations());
    bands_.fill(NormalEquations());
    objects_ = NormalEquations();
    kinds_.fill(NormalEquations());
  }

  /// Adds the distance (m) of a point from its plane, as for NormalEquations.
  void add(const Witness& witness, const Vector& derivatives, double distance, double weight) {
    sectors_[sector_of(witness.x, witness.y)].add(derivatives, distance, weight);
    bands_[band_of(witness)].add(derivatives, distance, weight);
    if (witness.on_object) objects_.add(derivatives, distance, weight);
    kinds_[is_upright(derivatives[2]) ? 1 : 0].add(derivatives, distance, weight);
  }

  /// Tests `correction` by direction. `equations`: those of all added distances, with attractions.
  Result test(const Vector& correction, const NormalEquations& equations, Prior prior) const {
    const Matrix inverse = inverse_of(equations);
    const Vector least_squares = equations.solve();
    Matrix covariance = covariance_of(equations, inverse, least_squares);
    Result result;
    result.covariance = covariance;
    add_first_error(equations, inverse, result.covariance);
    Matrix shared = shared_covariance(equations, least_squares);
    Vector scaled = correction;
    for (std::size_t i = 0; i < 6; ++i) {
      scaled[i] *= unit(i);
      for (std::size_t j = 0; j < 6; ++j) {
        covariance[i][j] *= unit(i) * unit(j);
        shared[i][j] *= unit(i) * unit(j);
      }
    }
    const SymmetricEigen<6> eigen = symmetric_eigen<6>(covariance);
    std::array<Direction, 6> directions;
    for (std::size_t k = 0; k < 6; ++k) {
      directions[k] = direction_of(eigen, k, scaled);
      const double variance = directions[k].variance + variance_along(shared, eigen.vectors[k]);
      if (directions[k].exceeds(directions[k].deviations_of_exact(), variance)) {
        result.is_significant = true;
      }
    }
    if (prior == Prior::kExact && !result.is_significant) return result;
    for (const Direction& direction : directions) {
      const double deviations =
          prior == Prior::kExact ? direction.deviations_of_exact() : kDeviations;
      if (!direction.exceeds(deviations, direction.variance)) continue;
      const double along = direction.along;
      const double kept = 1.0 - kShrink * kShrink * direction.variance / (along * along);
      for (std::size_t i = 0; i < 6; ++i) result.step[i] += kept * along * direction.step[i];
    }
    return result;
  }

 private:
  static constexpr std::size_t kSectors = 32;
  static constexpr std::size_t kBands = 64;
  static constexpr double kFewestSectors = 3.0;
  static constexpr double kDeviations = 3.0;  // of a step that is certain
  static constexpr double kFirstError = 1.0;  // m, standard deviation of the first estimate
  static constexpr double kShrink = 1.5;      // standard deviations, see James and Stein

  // A principal direction of the uncertainty.
  struct Direction {
    Vector step = {};       // of length 1, rotations by their lever
    double along = 0.0;     // length of the correction
    double variance = 0.0;  // of that length
    double sectors = 0.0;   // effective number of those that tell

    // A variance that few sectors tell is uncertain itself, as in the quantiles of Student's
    // distribution.
    double deviations_of_exact() const { return kDeviations * (1.0 + 6.0 / sectors); }

    bool exceeds(double deviations, double other_variance) const {
      return sectors >= kFewestSectors && along * along > deviations * deviations * other_variance;
    }
  };

  Direction direction_of(const SymmetricEigen<6>& eigen, std::size_t k,
                         const Vector& scaled) const {
    Direction direction;
    for (std::size_t i = 0; i < 6; ++i) {
      direction.along += eigen.vectors[k][i] * scaled[i];
      direction.step[i] = eigen.vectors[k][i] / unit(i);
    }
    direction.variance = std::max(eigen.values[k], 0.0);
    direction.sectors = sectors_that_tell(direction.step);
    return direction;
  }

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

  // Bands of equal sines of the elevation, 0.9 deg at the horizon. The outer ones have no end.
  static std::size_t band_of(const Witness& witness) {
    constexpr double kHighest = 0.5;  // sine
    const double x = static_cast<double>(witness.x), y = static_cast<double>(witness.y);
    const double z = static_cast<double>(witness.z);
    const double range = std::sqrt(x * x + y * y + z * z);
    if (!(range > 0.0)) return 0;
    const double place = (z / range + kHighest) / (2.0 * kHighest);  // [0, 1) within the limits
    return static_cast<std::size_t>(
        std::min(std::max(place, 0.0) * kBands, static_cast<double>(kBands - 1)));
  }

  // Effective number of sectors with information on a step.
  double sectors_that_tell(const Vector& step) const {
    double sum = 0.0, squares = 0.0;
    for (const NormalEquations& sector : sectors_) {
      const double information = sector.product(step, step);
      sum += information;
      squares += information * information;
    }
    return squares > 0.0 ? sum * sum / squares : 0.0;
  }

  static Matrix inverse_of(const NormalEquations& all) {
    Matrix inverse;
    for (std::size_t i = 0; i < 6; ++i) {
      Vector one = {};
      one[i] = 1.0;
      inverse[i] = all.solve(one);
    }
    return inverse;
  }

  // Each kind of surface has its own variance: walls of sparse sensors deviate more than ground.
  Matrix covariance_of_distances(const Matrix& inverse) const {
    Matrix covariance = {};
    for (const NormalEquations& kind : kinds_) {
      for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t j = 0; j < 6; ++j) {
          covariance[i][j] += kind.variance() * kind.product(inverse[i], inverse[j]);
        }
      }
    }
    return covariance;
  }

  // Where the surfaces tell nothing, attractions keep the first estimate and its error.
  static void add_first_error(const NormalEquations& all, const Matrix& inverse,
                              Matrix& covariance) {
    for (std::size_t k = 0; k < 6; ++k) {
      const double kept = all.attraction(k) * kFirstError / unit(k);
      for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t j = 0; j < 6; ++j) {
          covariance[i][j] += kept * kept * inverse[i][k] * inverse[j][k];
        }
      }
    }
  }

  // `step`: the solution of `all`.
  Matrix covariance_of(const NormalEquations& all, const Matrix& inverse,
                       const Vector& step) const {
    Matrix covariance = covariance_of_distances(inverse);
    // Pairs of adjacent sectors, so that no object is divided. They overlap, so each counts half.
    for (std::size_t sector = 0; sector < kSectors; ++sector) {
      NormalEquations pair = sectors_[sector];
      pair += sectors_[(sector + 1) % kSectors];
      add_change_without(pair, all, step, 0.5, covariance);
    }
    return covariance;
  }

  // The covariance of errors that many sectors share. `step`: the solution of `all`.
  Matrix shared_covariance(const NormalEquations& all, const Vector& step) const {
    Matrix covariance = {};
    add_change_without(objects_, all, step, 1.0, covariance);
    for (const NormalEquations& band : bands_) add_change_without(band, all, step, 1.0, covariance);
    return covariance;
  }

  // Adds the square of the change of `step`, the solution of `all`, without a part of the terms.
  static void add_change_without(const NormalEquations& part, const NormalEquations& all,
                                 const Vector& step, double weight, Matrix& covariance) {
    if (part.empty()) return;
    NormalEquations others = all;
    others -= part;
    Vector change = others.solve();
    for (std::size_t i = 0; i < 6; ++i) change[i] -= step[i];
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) covariance[i][j] += weight * change[i] * change[j];
    }
  }

  static double variance_along(const Matrix& covariance, const Vector& direction) {
    double variance = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) {
        variance += direction[i] * covariance[i][j] * direction[j];
      }
    }
    return variance;
  }

  std::array<NormalEquations, kSectors> sectors_;
  std::array<NormalEquations, kBands> bands_;
  std::array<NormalEquations, 2> kinds_;  // level and upright surfaces
  NormalEquations objects_;
};

}  // namespace dynains::detail
