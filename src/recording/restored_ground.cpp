#include "dynains/recording/restored_ground.hpp"

#include <cmath>
#include <cstdint>

namespace dynains {
namespace {

constexpr double kMostRise = 0.02;                    // m, of ground
constexpr double kFootBegin = 0.05, kFootEnd = 0.60;  // m above the ground
constexpr double kColumn = 0.1;                       // m

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
  const auto is_removed = [&](std::size_t i) { return verdict.labels[i] == PointLabel::kDynamic; };
  for_each_located(points, T_world_sensor, is_removed, [&](const LocatedPoints& located) {
    ground_.for_each_rise(located, [&](std::size_t k, const WorldCell&, const Rise& rise) {
      const Eigen::Vector3d at = located.at(k);
      if (rise.is_level && rise.of_cell <= kMostRise) removed_.push_back({located.point(k), at});
      if (rise.of_cell >= kFootBegin && rise.of_cell <= kFootEnd) feet_.insert(column_of(at));
    });
  });
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
