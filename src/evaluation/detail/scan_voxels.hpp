// The first of the two voxelisations: one scan, for several layers (subsets of its points) at once.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "detail/nearest.hpp"
#include "detail/voxel_grid.hpp"
#include "dynains/evaluation/truth.hpp"

namespace dynains::evaluation::detail {

/// Set of layers, one bit each.
using LayerMask = std::uint8_t;

/// Set of Truth values, one bit each.
using TruthMask = std::uint8_t;
constexpr TruthMask truth_bit(Truth truth) {
  return static_cast<TruthMask>(1U << static_cast<unsigned>(truth));
}
inline constexpr TruthMask kBothTruths = truth_bit(Truth::kStatic) | truth_bit(Truth::kDynamic);

/// A point of a scan that is in at least one layer.
struct ScanPoint {
  Eigen::Vector3d p_world;
  VoxelKey key;
  Truth truth;
  LayerMask layers;
};

/// Voxelises one scan at a time; memory is reused. Only the numbers of the points are stored.
class ScanVoxels {
 public:
  void clear() {
    index_.clear();
    voxels_.clear();
    points_.clear();
  }

  void prefetch(VoxelKey key) const { __builtin_prefetch(&index_.first_slot(voxel_hash(key))); }

  /// `number`: of the point in its scan.
  void add(const ScanPoint& point, std::size_t number) {
    const std::uint32_t at = voxel_of(point.key);
    Voxel& voxel = voxels_[at];
    voxel.sum += point.p_world;
    ++voxel.count;
    voxel.truths |= truth_bit(point.truth);
    voxel.in_all &= point.layers;
    voxel.in_any |= point.layers;
    points_.push_back({static_cast<std::uint32_t>(number), at});
  }

  /// visit(key, layers, centroid, truth) for every voxel, once or once per layer: the centroid of
  /// the layer's points in the voxel and the truth of the point nearest to it. Voxels come in the
  /// order of their first points. `point(number)`: the ScanPoint of add(). `prefetch_index(key)`
  /// and then `prefetch(key)` are called some voxels before `visit`.
  template <class Point, class PrefetchIndex, class Prefetch, class Visit>
  void for_each(LayerMask all_layers, Point&& point, PrefetchIndex&& prefetch_index,
                Prefetch&& prefetch, Visit&& visit) {
    gather_mixed(point);
    for (std::size_t v = 0; v < voxels_.size(); ++v) {
      const Voxel& voxel = voxels_[v];
      prefetch_index(voxels_[std::min(v + 2 * kAhead, voxels_.size() - 1)].key);
      prefetch(voxels_[std::min(v + kAhead, voxels_.size() - 1)].key);
      if (!voxel.mixed()) {
        const Truth truth =
            voxel.truths == truth_bit(Truth::kStatic) ? Truth::kStatic : Truth::kDynamic;
        visit(voxel.key, voxel.in_any, centroid(voxel.sum, voxel.count), truth);
        continue;
      }
      for (LayerMask layer = 1; layer != 0 && layer <= all_layers;
           layer = static_cast<LayerMask>(layer << 1)) {
        if ((voxel.in_any & layer) != 0) visit_layer(voxel, layer, visit);
      }
    }
  }

 private:
  static constexpr std::size_t kAhead = 8;  // voxels

  struct Voxel {
    VoxelKey key;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::uint32_t count = 0;
    std::uint32_t first_mixed = 0;  // range in mixed_points_
    TruthMask truths = 0;
    LayerMask in_all = 0xff;
    LayerMask in_any = 0;

    /// The layers differ, or the points have several classes.
    bool mixed() const { return in_all != in_any || truths == kBothTruths; }
  };

  static Eigen::Vector3d centroid(const Eigen::Vector3d& sum, std::uint32_t count) {
    return sum / static_cast<double>(count);
  }

  std::uint32_t voxel_of(VoxelKey key) {
    // Consecutive points often have one voxel.
    if (!points_.empty() && voxels_[points_.back().voxel].key == key) return points_.back().voxel;
    const std::uint32_t hash = voxel_hash(key);
    const VoxelIndex::Slot& slot = index_.first_slot(hash);
    const bool is_known = slot.key == key && slot.number != VoxelIndex::kNone;
    const std::uint32_t at = is_known ? slot.number : index_.insert(key, hash);
    if (at == voxels_.size()) voxels_.push_back({key});
    return at;
  }

  /// Groups the points of the mixed voxels by voxel, in scan order.
  template <class Point>
  void gather_mixed(Point&& point) {
    std::uint32_t total = 0;
    for (Voxel& voxel : voxels_) {
      voxel.first_mixed = total;
      if (voxel.mixed()) total += voxel.count;
    }
    mixed_points_.resize(total);
    if (total == 0) return;
    next_.resize(voxels_.size());
    for (std::size_t v = 0; v < voxels_.size(); ++v) next_[v] = voxels_[v].first_mixed;
    for (const Member& member : points_) {
      if (voxels_[member.voxel].mixed()) mixed_points_[next_[member.voxel]++] = point(member.point);
    }
  }

  template <class Visit>
  void visit_layer(const Voxel& voxel, LayerMask layer, Visit&& visit) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::uint32_t count = 0;
    const auto* first = mixed_points_.data() + voxel.first_mixed;
    const auto* last = first + voxel.count;
    for (const auto* i = first; i != last; ++i) {
      if ((i->layers & layer) == 0) continue;
      sum += i->p_world;
      ++count;
    }
    const Eigen::Vector3d center = centroid(sum, count);
    double best = std::numeric_limits<double>::infinity();
    Truth truth = Truth::kStatic;
    for (const auto* i = first; i != last; ++i) {
      if ((i->layers & layer) == 0) continue;
      const double distance = (i->p_world - center).squaredNorm();
      if (is_nearer(distance, best)) {
        best = distance;
        truth = i->truth;
      }
    }
    visit(voxel.key, layer, center, truth);
  }

  struct Member {
    std::uint32_t point;
    std::uint32_t voxel;
  };

  VoxelIndex index_;
  std::vector<Voxel> voxels_;
  std::vector<Member> points_;
  std::vector<ScanPoint> mixed_points_;
  std::vector<std::uint32_t> next_;
};

}  // namespace dynains::evaluation::detail
