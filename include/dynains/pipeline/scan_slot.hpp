// One scan in the ring of scans whose verdicts are open.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/cause.hpp"
#include "dynains/pipeline/window_votes.hpp"
#include "dynains/points.hpp"
#include "dynains/stage/evidence_verdict.hpp"
#include "dynains/stage/ground_split.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// One scan with its verdict. Reused from scan to scan.
struct ScanSlot {
  std::uint64_t scan = 0;
  std::uint64_t epoch = 0;  ///< only scans of one epoch are compared
  double time = 0.0;        ///< s
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_world_level = Eigen::Isometry3d::Identity();  ///< frame of split.points

  GroundSplit split;
  std::vector<std::uint32_t> ids;  ///< instance by cluster of the window with this newest scan
  WindowVotes windows;
  std::vector<EvidenceVerdict::Group> written_groups;  ///< verdicts by free space, written last
  std::vector<std::uint32_t> moved_ground;             ///< ground points that these call dynamic

  /// @name By input point
  /// @{
  std::vector<PointLabel> labels;
  std::vector<std::uint32_t> instances;
  std::vector<float> beliefs;
  std::vector<Cause> causes;
  /// @}

  std::size_t non_ground_count() const { return split.count - split.ground_count; }
  /// Number in the input of each non-ground point.
  const std::uint32_t* non_ground_input() const { return split.input.data() + split.ground_count; }

  ScanVerdict verdict() const {
    return {scan, time, T_world_sensor, labels, instances, beliefs, causes};
  }

  /// Capacity for a scan of so many points.
  void ensure_capacity(std::size_t points) {
    const auto ensure = [points](auto&... values) {
      (detail::ensure_capacity(values, points), ...);
    };
    ensure(labels, instances, beliefs, causes);
    ensure(windows.stage, windows.settled, windows.votes, windows.belief);
    constexpr std::size_t kPointsPerRun = 4;  // on average; more runs make room for themselves
    detail::ensure_capacity(windows.point_runs, points / kPointsPerRun);
  }

  /// The same, and touches the memory of a verdict, which the system then need not provide later.
  void touch(std::size_t points) {
    ensure_capacity(points);
    split.resize(points);
    split.resize(0);
    const auto touch_all = [points](auto&... values) {
      (values.resize(points), ...);
      (values.clear(), ...);
    };
    touch_all(labels, instances, beliefs, causes);
  }

  /// Capacity for as many clusters, groups and moved ground points as another scan has.
  void ensure_capacity_like(const ScanSlot& other) {
    detail::ensure_capacity(ids, other.ids.size());
    detail::ensure_capacity(written_groups, other.written_groups.size());
    detail::ensure_capacity(moved_ground, other.moved_ground.size());
  }
};

}  // namespace dynains::detail
