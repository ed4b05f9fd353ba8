// One labelled scan as the protocols see it, and where scans come from.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>

#include "dynains/points.hpp"

namespace dynains::evaluation {

/// How many estimates can be evaluated in one go.
inline constexpr std::size_t kMaxEstimates = 6;

/// Views over one scan. Every span is as long as the scan has points, or empty where it says so.
struct LabelledScan {
  const float* xyz = nullptr;  ///< sensor frame, m: x y z of a point, `stride` floats to the next
  std::size_t stride = 3;      ///< floats
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  double time = std::numeric_limits<double>::quiet_NaN();  ///< s; NaN if unknown
  Span<const std::uint32_t> truth;                         ///< SemanticKITTI labels
  /// Bit e is set if the map of estimate e holds the point. Empty: no estimate holds any.
  Span<const std::uint8_t> in_map;
  /// Why estimate 0 decided as it did (dynains::evaluation::Cause). May be empty.
  Span<const std::uint8_t> causes;
  /// Instance or cluster ids of estimate 0, 0 = none. May be empty.
  Span<const std::uint32_t> instances;

  std::size_t size() const { return truth.size(); }
  Eigen::Vector3d point(std::size_t i) const {
    const float* p = xyz + i * stride;
    return {p[0], p[1], p[2]};
  }
};

/// Fills `scan` with scan `index` and returns true, or returns false past the last one. Views stay
/// valid until the next call. Scans are asked for in order, and a second time from the start.
using ScanSource = std::function<bool(std::size_t index, LabelledScan& scan)>;

}  // namespace dynains::evaluation
