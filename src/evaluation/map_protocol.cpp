#include "map_protocol.hpp"

#include <algorithm>

namespace dynains::evaluation {

void MapProtocol::add(const LabelledScan& scan) {
  detail::for_each_point(
      scan, grid_, gate_, [&](std::size_t i, const Eigen::Vector3d&, VoxelKey key) {
        const std::uint32_t number = measured_.insert(key);
        if (number == measured_truths_.size()) measured_truths_.push_back(0);
        measured_truths_[number] |= detail::truth_bit(config_.truth(scan.truth[i]));
      });
  detail::for_each_point(scan, lookup_.grid(), point_gate_,
                         [&](std::size_t i, const Eigen::Vector3d& p, VoxelKey key) {
                           const Truth truth = config_.truth(scan.truth[i]);
                           if (truth == Truth::kIgnored) return;
                           point_score_.add(truth, 1, lookup_.contains(p, key) ? 1 : 0);
                         });
  finished_first_pass_ = false;
}

void MapProtocol::resolve(const LabelledScan& scan) {
  finish_first_pass();
  detail::for_each_point(scan, grid_, gate_,
                         [&](std::size_t i, const Eigen::Vector3d& p, VoxelKey key) {
                           if (near_mixed_.find(key) == kNoIndex) return;
                           approach({p, config_.truth(scan.truth[i])}, key);
                         });
}

Score MapProtocol::voxel_score(const VoxelProtocol& raw) {
  finish_first_pass();
  std::vector<std::optional<VoxelPoint>> estimate(groups_.size());
  for (std::size_t cell = 0; cell < groups_.size(); ++cell) estimate[cell] = voxel_point(cell);
  const auto point_at = [&](std::uint32_t cell) { return estimate[cell]; };
  Score score;
  raw.for_each(kIdentity, [&](const VoxelPoint& point) {
    const VoxelKey key = grid_.key(point.p_world);
    const bool is_kept =
        key != detail::kNoKey && detail::is_preserved(point, key, grid_, groups_.index(), point_at);
    score.add(point.truth, 1, is_kept ? 1 : 0);
  });
  return score;
}

std::uint64_t MapProtocol::foreign_points() {
  finish_first_pass();
  std::uint64_t foreign = map_.size() - groups_.grouped_points();
  for (std::size_t cell = 0; cell < groups_.size(); ++cell) {
    if (truths_[cell] == 0) foreign += groups_.points(cell).size();
  }
  return foreign;
}

// Collects the classes of measured points around each map voxel. One class decides the points of
// the voxel; mixed voxels are decided by resolve().
void MapProtocol::finish_first_pass() {
  if (finished_first_pass_) return;
  finished_first_pass_ = true;
  truths_.assign(groups_.size(), 0);
  farthest_.assign(groups_.size(), kFar);
  mixed_.assign(groups_.grouped_points(), {});
  near_mixed_ = VoxelHashTable<>();
  for (std::size_t cell = 0; cell < groups_.size(); ++cell) {
    for_each_touching(groups_.key(cell), [&](VoxelKey key) {
      const std::uint32_t number = measured_.find(key);
      if (number != kNoIndex) truths_[cell] |= measured_truths_[number];
    });
    if (!detail::is_mixed(truths_[cell])) continue;
    for_each_touching(groups_.key(cell), [&](VoxelKey key) { near_mixed_.insert(key); });
  }
}

// Updates the nearest measured point of the map points in mixed voxels around a point.
void MapProtocol::approach(const VoxelPoint& point, VoxelKey key) {
  for_each_touching(key, [&](VoxelKey at) {
    const std::uint32_t cell = groups_.index().find(at);
    if (cell == kNoIndex || !detail::is_mixed(truths_[cell])) return;
    // Skips voxels whose map points have nearer measured points already: most, in dense maps.
    if (grid_.squared_distance(point.p_world, at) >= farthest_[cell]) return;
    double farthest = 0;
    for (std::size_t rank = 0; rank < groups_.points(cell).size(); ++rank) {
      const Eigen::Vector3d& p = map_[groups_.points(cell)[rank]];
      Mixed& mixed = mixed_[groups_.first(cell) + rank];
      const double squared = (p - point.p_world).squaredNorm();
      if (squared < mixed.nearest) mixed = {squared, point.truth};
      farthest = std::max(farthest, mixed.nearest);
    }
    farthest_[cell] = farthest;
  });
}

Truth MapProtocol::truth_of(std::size_t cell, std::size_t rank) const {
  if (detail::is_mixed(truths_[cell])) return mixed_[groups_.first(cell) + rank].truth;
  if (truths_[cell] == detail::truth_bit(Truth::kStatic)) return Truth::kStatic;
  return truths_[cell] == detail::truth_bit(Truth::kDynamic) ? Truth::kDynamic : Truth::kIgnored;
}

std::optional<VoxelPoint> MapProtocol::voxel_point(std::size_t cell) const {
  const Span<const std::uint32_t> points = groups_.points(cell);
  return detail::voxel_point([&](auto&& add) {
    for (std::size_t rank = 0; rank < points.size(); ++rank) {
      const Truth truth = truth_of(cell, rank);
      if (truth != Truth::kIgnored) add(map_[points[rank]], truth);
    }
  });
}

}  // namespace dynains::evaluation
