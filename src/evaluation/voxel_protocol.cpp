#include "voxel_protocol.hpp"

#include <algorithm>

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
  const auto is_needed = [](VoxelKey) { return true; };
  voxelise(scan, is_needed, [&](const ScanVoxel& found) {
    const std::uint32_t number = index_.insert(found.key);
    const auto end = static_cast<std::uint32_t>(cells_.size());
    if (number == voxels_.size()) {
      voxels_.push_back({found.key, end});
      cells_.emplace_back();
    }
    Voxel& voxel = voxels_[number];
    if (!voxel.has_layers && found.layers != all_layers_) {
      cells_.resize(end + layers_, Cell(cells_[voxel.first]));
      voxel = {found.key, end, true};
    }
    for (std::size_t layer = 0; layer < (voxel.has_layers ? layers_ : 1); ++layer) {
      if ((found.layers >> layer & 1U) == 0) continue;
      Cell& cell = cells_[voxel.place(layer)];
      cell.sum += found.point.p_world;
      ++cell.count;
      cell.truths |= detail::truth_bit(found.point.truth);
    }
  });
}

// The class of a cell with points of both is that of the nearest one.
void VoxelProtocol::resolve(const LabelledScan& scan) {
  const auto is_mixed = [&](VoxelKey key) {
    const std::uint32_t number = index_.find(key);
    if (number == kNoIndex || !voxels_[number].has_layers) return false;
    const Cell* const cells = &cells_[voxels_[number].first];
    return std::any_of(cells, cells + layers_,
                       [](const Cell& cell) { return detail::is_mixed(cell.truths); });
  };
  voxelise(scan, is_mixed, [&](const ScanVoxel& found) {
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      const std::size_t place = voxels_[index_.find(found.key)].place(layer);
      Cell& cell = cells_[place];
      if ((found.layers >> layer & 1U) == 0 || !detail::is_mixed(cell.truths)) continue;
      const double squared = (found.point.p_world - cell.centroid()).squaredNorm();
      const auto [nearest, is_first] = nearest_.try_emplace(place, squared);
      if (!is_first && !detail::is_nearer(squared, nearest->second)) continue;
      nearest->second = squared;
      cell.nearest_truth = found.point.truth;
    }
  });
}

Score VoxelProtocol::score(std::size_t row) const {
  Score score;
  const auto point_at = [&](std::uint32_t number) {
    return cells_[voxels_[number].place(row)].point();
  };
  for (const Voxel& voxel : voxels_) {
    const VoxelPoint raw = *cells_[voxel.place(kIdentity)].point();
    const bool is_kept = detail::is_preserved(raw, voxel.key, *grid_, index_, point_at);
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

}  // namespace dynains::evaluation
