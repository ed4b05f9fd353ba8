// Input of the evaluation: labelled scans.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains::evaluation {

/// Largest number of estimates in one evaluation.
inline constexpr std::size_t kMaxEstimates = 6;

/// Numbers of rows.
enum Row : std::size_t {
  kIdentity,  ///< no point removed
  kOracle,    ///< exactly the dynamic points removed
  kFirstEstimate
};

/// Views of one scan. Each span has one value per point; spans may be empty where stated.
struct LabelledScan {
  const float* xyz = nullptr;             ///< x y z of each point, m, sensor frame
  std::size_t stride = 3;                 ///< floats per point, at least 3
  const std::uint8_t* sensors = nullptr;  ///< of each point; null: all are of the first
  /// By sensor: where its beams begin, m, in the frame of the points, from which ranges are
  /// measured. Empty: at the origin.
  Span<const Eigen::Vector3d> origins;
  Pose T_world_sensor = Pose::Identity();
  Span<const std::uint32_t> truth;  ///< SemanticKITTI labels
  /// Bit e is set if the map of estimate e contains the point. Empty if no map contains a point.
  Span<const std::uint8_t> in_map;
  /// Cause of each verdict of estimate 0 (dynains::evaluation::Cause). May be empty.
  Span<const std::uint8_t> causes;

  std::size_t size() const { return truth.size(); }
  /// Point i < size(), m, sensor frame.
  Eigen::Vector3d point(std::size_t i) const {
    const float* p = xyz + i * stride;
    return {p[0], p[1], p[2]};
  }
};

/// Writes the views of scan `index` to `scan` and returns true, or returns false for an index
/// behind the last scan. The views must be valid until the next call. The evaluation reads all
/// scans twice in order.
using ScanSource = std::function<bool(std::size_t index, LabelledScan& scan)>;

}  // namespace dynains::evaluation
