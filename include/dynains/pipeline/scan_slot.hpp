// One place in the facade's ring of scans.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/cause.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/capacity.hpp"
#include "dynains/stage/cluster_set.hpp"
#include "dynains/stage/evidence_verdict.hpp"
#include "dynains/stage/ground_split.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// How far a point came on its way to a verdict by windows (Eq. 11-19). Each has the bits of those
/// before it: the farther of two is their bitwise or.
enum class Reach : std::uint8_t { kNoCluster = 0, kTooFewScans = 1, kSimilar = 3, kProposed = 7 };

/// Why it is static all the same.
constexpr Cause cause_to_stay(Reach reach) {
  switch (reach) {
    case Reach::kTooFewScans:
      return Cause::kTooFewScans;
    case Reach::kSimilar:
      return Cause::kSimilar;
    case Reach::kProposed:
      return Cause::kReverted;
    case Reach::kNoCluster:
      break;
  }
  return Cause::kNotJudged;
}

/// A scan and all that is known of it. Reused from scan to scan.
struct ScanSlot {
  std::uint64_t scan = 0;
  std::uint64_t segment = 0;  // scans of different segments never share a window
  double time = 0.0;
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_world_level = Eigen::Isometry3d::Identity();  // of the points of the split

  GroundSplit split;
  // By non-ground point, in the order of the split; empty if windows are not compared. Reach is
  // written in pieces, and has room for some more points.
  std::vector<Reach> reach;         // how far it came in the window in which it came farthest
  std::vector<Reach> first_reach;   // the same, of its first window
  std::vector<std::uint8_t> votes;  // if it was proposed: windows that called it dynamic
  std::vector<float> belief;        // if it was proposed: highest posterior of any window
  // Of the window in which this scan was the newest: its points, and ids by cluster.
  std::vector<ClusterSet::PointRun> point_runs;
  std::vector<std::uint32_t> ids;
  // What the evidence of other scans said last: by group, and which points of the ground moved.
  std::vector<EvidenceVerdict::Group> proof;
  std::vector<std::uint32_t> moved_ground;
  // By point of the split, ground first.
  std::vector<std::uint8_t> is_kept;  // final verdict: static
  // By input point.
  std::vector<PointLabel> labels;
  std::vector<std::uint32_t> instances;
  std::vector<float> beliefs;
  std::vector<Cause> causes;

  /// For a scan of so many points.
  void ensure_capacity(std::size_t points) {
    const auto make_room_in = [points](auto& values) { detail::ensure_capacity(values, points); };
    for_each_verdict(make_room_in);
    make_room_in(reach);
    make_room_in(first_reach);
    make_room_in(votes);
    make_room_in(belief);
    detail::ensure_capacity(point_runs, points / kFewestInRun);
  }

  /// The same, and touches what a verdict is written to, so that the system has given that memory
  /// before a scan needs it.
  void touch(std::size_t points) {
    ensure_capacity(points);
    split.resize(points);
    split.resize(0);
    const auto touch_one = [points](auto& values) {
      values.resize(points);
      values.clear();
    };
    for_each_verdict(touch_one);
  }

  /// Room for as much as is known of another scan, beyond what goes by the number of points.
  void ensure_capacity_like(const ScanSlot& other) {
    detail::ensure_capacity(ids, other.ids.size());
    detail::ensure_capacity(proof, other.proof.size());
    detail::ensure_capacity(moved_ground, other.moved_ground.size());
  }

  std::size_t non_ground_count() const { return split.count - split.ground_count; }

  ScanVerdict verdict() const {
    return {scan, time, T_world_sensor, labels, instances, beliefs, causes};
  }

 private:
  static constexpr std::size_t kFewestInRun = 4;  // points on average, else point_runs grow later

  template <class Visit>
  void for_each_verdict(Visit&& visit) {
    visit(is_kept);
    visit(labels);
    visit(instances);
    visit(beliefs);
    visit(causes);
  }
};

}  // namespace dynains::detail
