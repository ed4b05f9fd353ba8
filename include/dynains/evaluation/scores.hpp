// Counts and scores of both protocols.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "dynains/evaluation/truth.hpp"

namespace dynains::evaluation {

/// 100 * part / whole; NaN if `whole` is 0.
inline double percent(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return std::numeric_limits<double>::quiet_NaN();
  return 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

/// Harmonic mean; 0 if both are 0, NaN if one is NaN.
inline double harmonic_mean(double a, double b) { return a + b == 0 ? 0 : 2 * a * b / (a + b); }

/// ERASOR's protocol (Lim et al., RA-L 2021): numbers of voxel points of the raw map, and of those
/// that are preserved in the map of the estimate.
struct VoxelScore {
  std::uint64_t static_total = 0;
  std::uint64_t static_preserved = 0;
  std::uint64_t dynamic_total = 0;
  std::uint64_t dynamic_preserved = 0;

  double preservation_rate() const { return percent(static_preserved, static_total); }  ///< PR, %
  double rejection_rate() const {                                                       ///< RR, %
    return percent(dynamic_total - dynamic_preserved, dynamic_total);
  }
  /// F1, in [0, 1]; NaN without static or without dynamic points.
  double f1() const { return harmonic_mean(preservation_rate(), rejection_rate()) / 100; }
};

/// KTH's protocol (Zhang et al., ITSC 2023): numbers of measured points, and of correctly
/// classified ones.
struct PointScore {
  std::uint64_t static_total = 0;
  std::uint64_t static_kept = 0;
  std::uint64_t dynamic_total = 0;
  std::uint64_t dynamic_removed = 0;

  double static_accuracy() const { return percent(static_kept, static_total); }        ///< SA, %
  double dynamic_accuracy() const { return percent(dynamic_removed, dynamic_total); }  ///< DA, %
  double associated_accuracy() const {                                                 ///< AA, %
    return std::sqrt(static_accuracy() * dynamic_accuracy());
  }
  double harmonic_accuracy() const {  ///< HA, %
    return harmonic_mean(static_accuracy(), dynamic_accuracy());
  }
};

/// Numbers of objects of one estimate. An object is all points of the recording with one label:
/// class, but for ground, and instance id, which is not 0.
struct ObjectScore {
  static constexpr std::uint64_t kMinPoints = 50;  ///< of an object that is judged
  static constexpr double kKept = 0.90;
  static constexpr double kRemoved = 0.95;

  std::uint64_t static_total = 0;  ///< without people
  std::uint64_t static_kept = 0;   ///< that keep at least a share of kKept of their points
  std::uint64_t dynamic_total = 0;
  std::uint64_t dynamic_removed = 0;  ///< that lose at least a share of kRemoved

  double kept() const { return percent(static_kept, static_total); }          ///< %
  double removed() const { return percent(dynamic_removed, dynamic_total); }  ///< %
};

/// Objects and points of one class. Objects with few points count by points only.
struct ClassScore {
  std::uint16_t id = 0;  ///< SemanticKITTI class
  Truth truth = Truth::kStatic;
  std::uint64_t objects = 0;  ///< with enough points
  std::uint64_t right = 0;    ///< objects that are kept or removed as in ObjectScore
  std::uint64_t points = 0;
  std::uint64_t points_kept = 0;

  std::uint64_t removed() const { return points - points_kept; }
};

/// Numbers of wrong and right verdicts with one cause.
struct CauseErrors {
  std::uint64_t missed_dynamic = 0;
  std::uint64_t lost_static = 0;
  std::uint64_t right = 0;
};

}  // namespace dynains::evaluation
