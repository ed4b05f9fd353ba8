#include "verdict_cloud.hpp"

#include <cmath>

namespace dynains::program {
namespace {

Fate fate_of(evaluation::Truth truth, bool kept) {
  if (truth == evaluation::Truth::kDynamic) {
    return kept ? Fate::kMissedDynamic : Fate::kRemovedDynamic;
  }
  return kept ? Fate::kKeptStatic : Fate::kLostStatic;
}

}  // namespace

void VerdictCloud::add(const evaluation::LabelledScan& scan) {
  if (path_.empty()) origin_ = scan.T_world_sensor.translation();
  Eigen::Isometry3d T_local_sensor = scan.T_world_sensor;
  T_local_sensor.translation() -= origin_;
  path_.push_back(T_local_sensor.translation());
  constexpr double kReach = 1 << 19;  // cells per axis and side
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const evaluation::Truth truth = truth_(scan.truth[i]);
    if (truth == evaluation::Truth::kIgnored) continue;
    const Eigen::Vector3d p = scan.point(i);
    const double range = p.head<2>().norm();
    if (!(range >= min_range_ && range <= max_range_)) continue;
    const Eigen::Vector3d local = T_local_sensor * p;
    const Eigen::Vector3d cell = (local / resolution_).array().floor();
    if (!(cell.cwiseAbs().maxCoeff() < kReach)) continue;
    const bool kept = !scan.in_map.empty() && (scan.in_map[i] & 1U) != 0;
    const Fate fate = fate_of(truth, kept);
    std::uint64_t key = static_cast<std::uint64_t>(fate);
    for (int axis = 0; axis < 3; ++axis) {
      key = key << 20U | static_cast<std::uint64_t>(cell[axis] + kReach);
    }
    if (taken_.insert(key).second) points_.push_back({local.cast<float>(), fate});
  }
}

}  // namespace dynains::program
