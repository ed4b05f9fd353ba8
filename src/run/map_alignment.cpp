#include "map_alignment.hpp"

#include <algorithm>
#include <iterator>

#include "poses/scan_registration.hpp"

namespace dynains::program {
namespace {

constexpr double kReach = 40.0;  // m, points that count
constexpr double kWay = 2.0;     // m, between two alignments

bool is_before(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.x() < b.x(); }

}  // namespace

MapAlignment::MapAlignment(const std::vector<Eigen::Vector3d>& map) {
  std::copy_if(map.begin(), map.end(), std::back_inserter(map_),
               [](const Eigen::Vector3d& point) { return point.allFinite(); });
  std::sort(map_.begin(), map_.end(), is_before);
}

// Points of the map relative to `centre`, along the axes of the map.
PointBuffer MapAlignment::around(const Eigen::Vector3d& centre) const {
  PointBuffer points;
  const Eigen::Vector3d reach(kReach, 0.0, 0.0);
  auto point = std::lower_bound(map_.begin(), map_.end(), centre - reach, is_before);
  const auto end = std::upper_bound(point, map_.end(), centre + reach, is_before);
  for (; point != end; ++point) {
    const Eigen::Vector3f p = (*point - centre).cast<float>();
    if (p.norm() < kReach) points.push_back(p.x(), p.y(), p.z());
  }
  return points;
}

bool MapAlignment::is_due(const Pose& T_world_sensor) const {
  return !latest_ || (T_world_sensor.translation() - *latest_).norm() >= kWay;
}

void MapAlignment::align(PointsView standing, const Pose& T_world_sensor) {
  const Eigen::Vector3d sensor = T_world_sensor.translation();
  latest_ = sensor;
  const Eigen::Vector3d centre = T_map_world_ * sensor;
  const Pose T_map_centre(Eigen::Translation3d{centre});
  const Pose T_centre_map = T_map_centre.inverse();
  const Pose T_latest = T_centre_map * T_map_world_ * T_world_sensor;
  const RegistrationScan map(around(centre), kReach), scan(standing, kReach);
  const auto found =
      register_scans(map.surfaces(), scan.points(), {T_latest, T_centre_map * T_world_sensor});
  if (!found || found->score < kLeastScore || found->uncertainty > kMostUncertain) return;
  T_map_world_ = T_map_centre * found->T_a_b * T_world_sensor.inverse();
  ++aligned_;
  farthest_ = std::max(farthest_, (T_map_world_ * sensor - sensor).norm());
}

}  // namespace dynains::program
