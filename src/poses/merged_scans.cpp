#include "merged_scans.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

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

PointBuffer merged_scans(const Recording& recording, std::size_t at, std::size_t from,
                         std::size_t to) {
  PointBuffer all;
  RecordedScan scan;
  for (std::size_t i = from; i <= to; ++i) {
    recording.read_scan(i, scan);
    const PointBuffer points = finite_points(scan);
    if (from == to && i == at) return points;
    const Pose T_at_i = recording.T_world_sensor(at).inverse() * recording.T_world_sensor(i);
    const Eigen::Matrix3f R = T_at_i.linear().cast<float>();
    const Eigen::Vector3f t = T_at_i.translation().cast<float>();
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector3f p = R * Eigen::Vector3f(points.x[k], points.y[k], points.z[k]) + t;
      all.push_back(p.x(), p.y(), p.z());
    }
  }
  return all;
}

}  // namespace dynains
