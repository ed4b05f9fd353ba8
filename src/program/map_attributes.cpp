#include "map_attributes.hpp"

#include <cmath>

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
    const std::uint64_t key = key_of(voxel_of(verdict.T_world_sensor * point.cast<double>()));
    const auto [place, is_new] = attributes_.try_emplace(key);
    if (is_new) place->second = attributes_of(scan, verdict, labels, i);
  }
}

MapAttributes MapAttributeTable::at(const Eigen::Vector3d& position) const {
  const Voxel voxel = voxel_of(position);
  const auto own = attributes_.find(key_of(voxel));
  if (own != attributes_.end()) return own->second;
  for (int neighbour = 0; neighbour < 27; ++neighbour) {
    const auto found =
        attributes_.find(key_of({voxel[0] + neighbour % 3 - 1, voxel[1] + neighbour / 3 % 3 - 1,
                                 voxel[2] + neighbour / 9 - 1}));
    if (found != attributes_.end()) return found->second;
  }
  return {};
}

MapAttributeTable::Voxel MapAttributeTable::voxel_of(const Eigen::Vector3d& position) const {
  const Eigen::Vector3d index = (position / voxel_).array().floor() - origin_.array();
  return {static_cast<std::int64_t>(index.x()), static_cast<std::int64_t>(index.y()),
          static_cast<std::int64_t>(index.z())};
}

std::uint64_t MapAttributeTable::key_of(const Voxel& voxel) {
  constexpr unsigned kBits = 21;
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  std::uint64_t key = 0;
  for (const std::int64_t index : voxel) {
    key = key << kBits | (static_cast<std::uint64_t>(index) & kMask);
  }
  return key;
}

}  // namespace dynains::program
