#include "map_attributes.hpp"

namespace dynains::program {

MapAttributes attributes_of(const RecordedScan& scan, const ScanVerdict& verdict,
                            const std::vector<std::uint32_t>& labels, std::size_t i) {
  MapAttributes attributes;
  attributes.scan_time = verdict.time;
  if (!scan.time.empty()) attributes.time = scan.time[i];
  attributes.intensity = scan.xyzi[4 * i + 3];
  attributes.belief = verdict.beliefs[i];
  if (!labels.empty()) attributes.label = labels[i];
  attributes.instance = verdict.instances[i];
  attributes.cause = verdict.causes[i];
  attributes.is_ground = verdict.labels[i] == PointLabel::kGround;
  return attributes;
}

MapAttributeTable::MapAttributeTable(double voxel, const Eigen::Vector3d& origin)
    : voxel_(voxel), origin_((origin / voxel).array().floor()) {}

void MapAttributeTable::add(const RecordedScan& scan, const ScanVerdict& verdict,
                            const std::vector<std::uint32_t>& labels) {
  for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
    if (!is_static(verdict.labels[i])) continue;
    const Eigen::Map<const Eigen::Vector3f> point(scan.xyzi.data() + 4 * i);
    const std::uint32_t voxel =
        voxels_.insert(key_of(verdict.T_world_sensor * point.cast<double>()));
    if (voxel == attributes_.size()) attributes_.push_back(attributes_of(scan, verdict, labels, i));
  }
}

MapAttributes MapAttributeTable::at(const Eigen::Vector3d& position) const {
  const VoxelKey key = key_of(position);
  const std::uint32_t own = voxels_.find(key);
  if (own != VoxelHashTable<>::kNone) return attributes_[own];
  for (int neighbour = 0; neighbour < 27; ++neighbour) {
    const std::uint32_t found = voxels_.find(
        key + voxel_key_step(neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1));
    if (found != VoxelHashTable<>::kNone) return attributes_[found];
  }
  return {};
}

VoxelKey MapAttributeTable::key_of(const Eigen::Vector3d& position) const {
  const Eigen::Vector3d index = (position / voxel_).array().floor() - origin_.array();
  return voxel_key(static_cast<std::int64_t>(index.x()), static_cast<std::int64_t>(index.y()),
                   static_cast<std::int64_t>(index.z()));
}

}  // namespace dynains::program
