// Simple implementations of the protocols: everything in memory, sorted maps, every pair compared.
#pragma once

#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"
#include "evaluation/voxel_protocol.hpp"
#include "scenes.hpp"
#include "support/standard.hpp"

namespace dynains::evaluation::testing {

inline std::vector<VoxelPoint> voxelise(const std::vector<VoxelPoint>& points, double edge) {
  std::map<std::array<double, 3>, std::vector<VoxelPoint>> voxels;
  for (const VoxelPoint& point : points) {
    const Eigen::Vector3d& p = point.p_world;
    voxels[{std::floor(p.x() / edge), std::floor(p.y() / edge), std::floor(p.z() / edge)}]
        .push_back(point);
  }
  std::vector<VoxelPoint> result;
  for (const auto& [cell, members] : voxels) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const VoxelPoint& member : members) sum += member.p_world;
    VoxelPoint point{sum / static_cast<double>(members.size()), Truth::kStatic};
    double nearest = std::numeric_limits<double>::infinity();
    for (const VoxelPoint& member : members) {
      const double distance = (member.p_world - point.p_world).squaredNorm();
      if (distance + 1e-8 < nearest) {
        nearest = distance;
        point.truth = member.truth;
      }
    }
    result.push_back(point);
  }
  return result;
}

/// Whether a point is within range, by its position in the sensor frame.
inline bool in_range(const Eigen::Vector3d& p, double min_range, double max_range) {
  const double range = p.head<2>().norm();
  return p.allFinite() && p != Eigen::Vector3d::Zero() && range >= min_range &&
         (max_range == 0 || range <= max_range);
}

using Chosen = std::function<bool(const OwnedScan&, std::size_t, Truth)>;

/// Map of the chosen points of all scans: voxels of each scan, then voxels of the whole.
inline std::vector<VoxelPoint> reference_map(const std::vector<OwnedScan>& scans,
                                             const EvaluationConfig& settings,
                                             const Chosen& chosen) {
  std::vector<VoxelPoint> all;
  for (const OwnedScan& scan : scans) {
    std::vector<VoxelPoint> points;
    for (std::size_t i = 0; i < scan.truth.size(); ++i) {
      const Truth truth = settings.truth(scan.truth[i]);
      const Eigen::Vector3d p = scan.view().point(i);
      if (truth == Truth::kIgnored || !chosen(scan, i, truth)) continue;
      if (!in_range(p, settings.min_range, settings.max_range)) continue;
      points.push_back({scan.T_world_sensor * p, truth});
    }
    for (const VoxelPoint& point : voxelise(points, settings.voxel)) all.push_back(point);
  }
  return voxelise(all, settings.voxel);
}

/// Counts one point or voxel and whether the map has it.
inline void count(Truth truth, bool is_kept, Score& score) {
  if (truth == Truth::kStatic) {
    ++score.static_total;
    score.static_kept += is_kept;
  } else {
    ++score.dynamic_total;
    score.dynamic_removed += !is_kept;
  }
}

inline Score reference_score(const std::vector<VoxelPoint>& raw,
                             const std::vector<VoxelPoint>& estimate, double edge) {
  Score score;
  for (const VoxelPoint& point : raw) {
    double nearest = std::numeric_limits<double>::infinity();
    Truth truth = Truth::kIgnored;
    for (const VoxelPoint& candidate : estimate) {
      const double distance = (candidate.p_world - point.p_world).norm();
      if (distance < nearest) {
        nearest = distance;
        truth = candidate.truth;
      }
    }
    count(point.truth, nearest < edge * std::sqrt(3.0) / 2 && truth == point.truth, score);
  }
  return score;
}

inline bool same(const Score& a, const Score& b) {
  return a.static_total == b.static_total && a.static_kept == b.static_kept &&
         a.dynamic_total == b.dynamic_total && a.dynamic_removed == b.dynamic_removed;
}

}  // namespace dynains::evaluation::testing
