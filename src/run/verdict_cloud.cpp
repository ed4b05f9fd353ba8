#include "verdict_cloud.hpp"

#include <cmath>
#include <cstddef>

namespace dynains::program {
namespace {

Fate fate_of(evaluation::Truth truth, bool kept) {
  if (truth == evaluation::Truth::kDynamic) {
    return kept ? Fate::kMissedDynamic : Fate::kRemovedDynamic;
  }
  return kept ? Fate::kKeptStatic : Fate::kLostStatic;
}

std::uint8_t bit(Fate fate) { return static_cast<std::uint8_t>(1U << static_cast<unsigned>(fate)); }

}  // namespace

void VerdictCloud::drop_covered() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const std::uint8_t fates = fates_[voxels_[i]];
    const Fate fate = points_[i].fate;
    if (fate == Fate::kLostStatic && (fates & bit(Fate::kKeptStatic)) != 0) continue;
    if (fate == Fate::kRemovedDynamic && (fates & bit(Fate::kMissedDynamic)) != 0) continue;
    points_[kept] = points_[i];
    voxels_[kept++] = voxels_[i];
  }
  points_.resize(kept);
  voxels_.resize(kept);
}

void VerdictCloud::add(const evaluation::LabelledScan& scan) {
  if (path_.empty()) origin_ = scan.T_world_sensor.translation();
  Pose T_local_sensor = scan.T_world_sensor;
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
    std::uint64_t voxel = 0;
    for (int axis = 0; axis < 3; ++axis) {
      voxel = voxel << 20U | static_cast<std::uint64_t>(cell[axis] + kReach);
    }
    std::uint8_t& fates = fates_[voxel];
    if ((fates & bit(fate)) != 0) continue;
    fates |= bit(fate);
    points_.push_back({local.cast<float>(), fate});
    voxels_.push_back(voxel);
  }
}

}  // namespace dynains::program
