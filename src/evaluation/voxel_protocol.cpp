#include "voxel_protocol.hpp"

#include <algorithm>
#include <limits>

#include "voxels.hpp"

namespace dynains::evaluation {

// Calls `visit(ScanVoxel)` for every voxel of a scan of which `is_needed(key)`, once or, if its
// points differ, once per layer, in the order of their first points.
template <class IsNeeded, class Visit>
void VoxelProtocol::voxelise(const LabelledScan& scan, IsNeeded&& is_needed, Visit&& visit) {
  points_.clear();
  detail::for_each_point(scan, *grid_, gate_,
                         [&](std::size_t i, const Eigen::Vector3d& p_world, VoxelKey key) {
                           const Truth truth = config_.truth(scan.truth[i]);
                           if (truth == Truth::kIgnored || !is_needed(key)) return;
                           points_.push_back({p_world, key, truth, layers_of(scan, i, truth)});
                         });
  const detail::CellGroups groups(points_.size(),
                                  [&](std::size_t i, auto&& add) { add(points_[i].key); });
  for (std::size_t cell = 0; cell < groups.size(); ++cell) {
    const Span<const std::uint32_t> members = groups.points(cell);
    const auto visit_layers = [&](LayerMask layers) {
      const auto point = detail::voxel_point([&](auto&& add) {
        for (const std::uint32_t i : members) {
          if ((points_[i].layers & layers) != 0) add(points_[i].p_world, points_[i].truth);
        }
      });
      if (point) visit(ScanVoxel{groups.key(cell), *point, layers});
    };
    const LayeredPoint& first = points_[members[0]];
    const bool are_equal = std::all_of(members.begin(), members.end(), [&](std::uint32_t i) {
      return points_[i].truth == first.truth && points_[i].layers == first.layers;
    });
    if (are_equal) {
      visit_layers(first.layers);
      continue;
    }
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      visit_layers(static_cast<LayerMask>(1U << layer));
    }
  }
}

void VoxelProtocol::add(const LabelledScan& scan) {
  if (!grid_) grid_.emplace(config_.voxel, scan.T_world_sensor.translation());
  voxelise(
      scan, [](VoxelKey) { return true; }, [this](const ScanVoxel& voxel) { accumulate(voxel); });
}

void VoxelProtocol::resolve(const LabelledScan& scan) {
  nearest_.resize(forks_.size(), std::numeric_limits<double>::infinity());
  const auto is_forked = [this](VoxelKey key) { return forked_.find(key) != kNoIndex; };
  voxelise(scan, is_forked, [this](const ScanVoxel& voxel) { compare(voxel); });
}

Score VoxelProtocol::score(std::size_t row) const {
  Score score;
  const auto point_at = [&](std::uint32_t number) { return point(voxels_[number], row); };
  for (std::size_t number = 0; number < voxels_.size(); ++number) {
    const Voxel& voxel = voxels_[number];
    if (voxel.fork == kNoIndex) {  // the estimate has the same point
      score.add(voxel.shared.truth(), 1, 1);
      continue;
    }
    const VoxelPoint raw = *point(voxel, kIdentity);
    const bool is_kept = detail::is_preserved(raw, keys_[number], *grid_, index_, point_at);
    score.add(raw.truth, 1, is_kept ? 1 : 0);
  }
  return score;
}

VoxelProtocol::LayerMask VoxelProtocol::layers_of(const LabelledScan& scan, std::size_t i,
                                                  Truth truth) const {
  unsigned layers = 1U << kIdentity;
  if (truth == Truth::kStatic) layers |= 1U << kOracle;
  if (!scan.in_map.empty()) layers |= static_cast<unsigned>(scan.in_map[i]) << kFirstEstimate;
  return static_cast<LayerMask>(layers & all_layers_);
}

void VoxelProtocol::accumulate(const ScanVoxel& found) {
  const std::uint32_t number = index_.insert(found.key);
  if (number == voxels_.size()) {
    voxels_.emplace_back();
    keys_.push_back(found.key);
  }
  Voxel& voxel = voxels_[number];
  if (voxel.fork == kNoIndex && found.layers == all_layers_) {
    voxel.shared.add(found.point);
    return;
  }
  if (voxel.fork == kNoIndex) {
    voxel.fork = static_cast<std::uint32_t>(layers_) * forked_.insert(found.key);
    forks_.resize(forks_.size() + layers_, voxel.shared);
  }
  for (std::size_t layer = 0; layer < layers_; ++layer) {
    if ((found.layers >> layer & 1U) != 0) forks_[voxel.fork + layer].add(found.point);
  }
}

// The class of a cell with points of both is that of the nearest one. All such cells are forked:
// a voxel with equal layers has no dynamic point, because the oracle layer has none.
void VoxelProtocol::compare(const ScanVoxel& found) {
  const std::size_t fork = layers_ * forked_.find(found.key);
  for (std::size_t layer = 0; layer < layers_; ++layer) {
    if ((found.layers >> layer & 1U) == 0) continue;
    Cell& cell = forks_[fork + layer];
    const double squared = (found.point.p_world - cell.centroid()).squaredNorm();
    if (!detail::is_nearer(squared, nearest_[fork + layer])) continue;
    nearest_[fork + layer] = squared;
    cell.truths = detail::truth_bit(found.point.truth);
  }
}

}  // namespace dynains::evaluation
