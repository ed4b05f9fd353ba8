// What the remover says about one scan.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "dynains/cause.hpp"
#include "dynains/pipeline/stage_times.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Verdict on every point of one scan, in the order of the input. Views hold until the next call
/// of the remover.
struct ScanVerdict {
  std::uint64_t scan = 0;  ///< number of the push, from 0
  double time = 0.0;       ///< s, as pushed
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  Span<const PointLabel> labels;
  Span<const std::uint32_t> instances;  ///< kNoInstance for ground and points without a cluster
  /// Probability of being dynamic, [0, 1]; 0 for what was not judged: ground that stays, points
  /// without a cluster and, under the paper's rules, whatever was not proposed. By free space, what
  /// was judged has at least 0.5: so much is left to a place that stands, and to one that nobody
  /// saw.
  Span<const float> beliefs;
  Span<const Cause> causes;  ///< why the label is what it is
};

/// Answer to one scan.
struct FrameResult {
  /// What the past alone says of the scan just pushed; without latency, the final verdict on it.
  ScanVerdict newest;
  std::optional<ScanVerdict> finished;  ///< the scan, if any, whose verdict is now final
  StageTimes times;
};

}  // namespace dynains
