#include "dynains/recording/restored_ground.hpp"

#include <cmath>
#include <cstdint>

namespace dynains {
namespace {

constexpr double kMostRise = 0.02;                    // m, of ground
constexpr double kFootBegin = 0.05, kFootEnd = 0.60;  // m above the ground
constexpr double kRise = 0.10;  // m, more than a pose that is off by 0.1 deg moves ground 50 m away
constexpr double kColumn = 0.1;  // m

VoxelKey column_of(const Eigen::Vector3d& at, std::int64_t dx = 0, std::int64_t dy = 0) {
  // The columns of a scan are nearer to each other than the period of the mask.
  constexpr std::int64_t kMask = 0xffff;
  return voxel_key((static_cast<std::int64_t>(std::floor(at.x() / kColumn)) + dx) & kMask,
                   (static_cast<std::int64_t>(std::floor(at.y() / kColumn)) + dy) & kMask, 0);
}

}  // namespace

void RestoredGround::find_removed(PointsView points, const Pose& T_world_sensor,
                                  const VerdictArrays& verdict) {
  removed_.clear();
  feet_.clear();
  ground_.free_far(T_world_sensor.translation());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (verdict.labels[i] != PointLabel::kDynamic) continue;
    const Eigen::Vector3d at = world_point(points, i, T_world_sensor);
    const auto rise = ground_.rise(at);
    if (!rise) continue;
    if (*rise <= kMostRise && ground_.is_level(at)) removed_.push_back({i, at});
    if (*rise >= kFootBegin && *rise <= kFootEnd) feet_.insert(column_of(at));
  }
}

bool RestoredGround::rises(const Eigen::Vector3d& point) {
  const auto rise = ground_.rise(point);
  return rise && *rise >= kRise;
}

bool RestoredGround::is_beside_foot(const Eigen::Vector3d& at) const {
  for (std::int64_t dx = -1; dx <= 1; ++dx) {
    for (std::int64_t dy = -1; dy <= 1; ++dy) {
      if (feet_.find(column_of(at, dx, dy)) != VoxelHashTable<>::kNone) return true;
    }
  }
  return false;
}

std::size_t RestoredGround::restore(PointsView points, const Pose& T_world_sensor,
                                    VerdictArrays& verdict) {
  find_removed(points, T_world_sensor, verdict);
  std::size_t count = 0;
  for (const Removed& removed : removed_) {
    if (is_beside_foot(removed.at)) continue;
    verdict.labels[removed.point] = PointLabel::kGround;
    verdict.causes[removed.point] = Cause::kGround;
    verdict.instances[removed.point] = kNoInstance;
    if (!verdict.beliefs.empty()) verdict.beliefs[removed.point] = 0.0F;
    ++count;
  }
  return count;
}

}  // namespace dynains
