// The answer of the remover to one scan.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "dynains/cause.hpp"
#include "dynains/points.hpp"
#include "dynains/stage/stage_times.hpp"

namespace dynains {

/// Verdict on every point of one scan, in input order. The spans are valid until the next call of
/// the remover.
struct ScanVerdict {
  std::uint64_t scan = 0;  ///< number of the push, from 0
  double time = 0.0;       ///< s, as pushed
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  Span<const PointLabel> labels;
  Span<const std::uint32_t> instances;  ///< kNoInstance for ground and points without a cluster
  /// Probability of being dynamic, [0, 1]. 0 for points that were not judged: static ground, points
  /// without a cluster and, for decision = window, points that were not proposed. For decision =
  /// free_space, judged points have at least 0.5, also occupied places and places that no other
  /// scan saw.
  Span<const float> beliefs;
  Span<const Cause> causes;  ///< reason for the label
};

/// Answer to one scan.
struct FrameResult {
  /// Verdict on the scan just pushed, from it and earlier scans; final if there is no latency.
  ScanVerdict newest;
  std::optional<ScanVerdict> finished;  ///< verdict on an earlier scan that is final now
  StageTimes times;
};

}  // namespace dynains
