#include "merged_scans.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "io/finite_points.hpp"

namespace dynains {

std::size_t scans_to_merge(const Recording& recording) {
  constexpr double kEnough = 40000.0;  // points
  constexpr double kMost = 8.0;        // scans
  if (recording.size() == 0) return 1;
  const auto points = static_cast<double>(recording.point_count(recording.size() / 2));
  const double wanted = std::clamp(std::round(kEnough / std::max(1.0, points)), 1.0, kMost);
  // Two merged scans must not share a scan.
  return std::max<std::size_t>(1, std::min(static_cast<std::size_t>(wanted), recording.size() / 4));
}

ScanMerger::ScanMerger(const Recording& recording, PoseOfScan pose_of, OnScan on_scan)
    : recording_(recording), pose_of_(std::move(pose_of)), on_scan_(std::move(on_scan)) {}

PointBuffer ScanMerger::merge(std::size_t at, std::size_t from, std::size_t to) {
  PointBuffer all;
  const auto T_world_at = pose_of_(at);
  for (std::size_t i = from; i <= to; ++i) {
    const auto T_world_i = pose_of_(i);
    if (!T_world_at || !T_world_i) continue;
    recording_.read_scan(i, scan_);
    PointBuffer points = finite_points(scan_);
    if (on_scan_) on_scan_(scan_, points);
    if (i == at && from == to) return points;
    const Eigen::Isometry3f T = (T_world_at->inverse() * *T_world_i).cast<float>();
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector3f p = T * Eigen::Vector3f(points.x[k], points.y[k], points.z[k]);
      all.push_back(p.x(), p.y(), p.z());
    }
  }
  return all;
}

}  // namespace dynains
