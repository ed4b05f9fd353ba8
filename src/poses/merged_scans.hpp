// Scans of sparse sensors, merged under a hypothesis of the poses.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <optional>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// T_world_sensor of a scan under some reading of the poses; empty without a pose.
using PoseOfScan = std::function<std::optional<Pose>(std::size_t)>;

/// The number of consecutive scans whose points suffice for a registration: 1 for dense sensors, at
/// most 8.
std::size_t scans_to_merge(const Recording& recording);

/// Merges consecutive scans in the frame of one of them. Two sparse scans of a non-repetitive
/// sensor meet different places; merged ones meet the same surfaces if the poses are right.
class ScanMerger {
 public:
  /// `on_scan(scan, points)` is called with each scan that is read and with its finite points.
  using OnScan = std::function<void(const RecordedScan&, PointsView)>;

  ScanMerger(const Recording& recording, PoseOfScan pose_of, OnScan on_scan = {});

  /// Finite points (m, frame of scan `at`) of the scans `from` to `to` (inclusive). Scans without a
  /// pose are left out. Throws IoError.
  PointBuffer merge(std::size_t at, std::size_t from, std::size_t to);

 private:
  const Recording& recording_;
  PoseOfScan pose_of_;
  OnScan on_scan_;
  RecordedScan scan_;
};

}  // namespace dynains
