// The first of the two voxelisations: one scan, for several layers (subsets of its points) at once.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "detail/located_points.hpp"
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

/// Class and layers of a point of a scan.
struct LayeredTruth {
  Truth truth;  ///< kIgnored: the point is in no layer
  LayerMask layers;
};

/// The points of some layers of a scan in one voxel.
struct ScanVoxel {
  VoxelKey key;
  Eigen::Vector3d centroid;  ///< m, world frame
  Truth truth;               ///< of the point nearest to the centroid
  LayerMask layers;
};

/// Voxelises one scan at a time; memory is reused. Of the points, only their numbers are stored.
class ScanVoxels {
 public:
  void clear() {
    index_.clear();
    voxels_.clear();
    runs_.clear();
  }

  void prefetch(VoxelKey key) const { __builtin_prefetch(&index_.first_slot(voxel_hash(key))); }

  /// `label_of(number)`: the label of a point by its number in the scan.
  template <class LabelOf>
  void add(const PointRun& run, LabelOf&& label_of) {
    std::uint32_t at = VoxelIndex::kNone;
    Voxel voxel;
    for (std::size_t i = 0; i < run.count; ++i) {
      const LayeredTruth label = label_of(run.first + i);
      if (label.truth == Truth::kIgnored) continue;
      if (at == VoxelIndex::kNone) {
        at = voxel_of(run.key);
        voxel = voxels_[at];
      }
      voxel.sum += run.p_world(i);
      ++voxel.count;
      voxel.truths |= truth_bit(label.truth);
      voxel.in_all &= label.layers;
      voxel.in_any |= label.layers;
    }
    if (at == VoxelIndex::kNone) return;
    voxels_[at] = voxel;
    runs_.emplace_back(static_cast<std::uint32_t>(run.first), static_cast<std::uint32_t>(run.count),
                       at);
  }

  /// Calls `visit(ScanVoxel)` for every voxel, once or once per layer, in the order of their first
  /// points. `label_of` as in add(); `p_world(number)`: position of a point.
  template <class LabelOf, class Position, class Visit>
  void for_each(LayerMask all_layers, LabelOf&& label_of, Position&& p_world, Visit&& visit) {
    gather_mixed(label_of, p_world);
    for (const Voxel& voxel : voxels_) {
      if (!voxel.mixed()) {
        const Truth truth =
            voxel.truths == truth_bit(Truth::kStatic) ? Truth::kStatic : Truth::kDynamic;
        visit(ScanVoxel{voxel.key, centroid(voxel.sum, voxel.count), truth, voxel.in_any});
        continue;
      }
      for (LayerMask layer = 1; layer != 0 && layer <= all_layers;
           layer = static_cast<LayerMask>(layer << 1)) {
        if ((voxel.in_any & layer) != 0) visit(of_layer(voxel, layer));
      }
    }
  }

 private:
  struct Voxel {
    VoxelKey key = kNoKey;
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
    const std::uint32_t hash = voxel_hash(key);
    const VoxelIndex::Slot& slot = index_.first_slot(hash);
    const bool is_known = slot.key == key && slot.number != VoxelIndex::kNone;
    const std::uint32_t at = is_known ? slot.number : index_.insert(key, hash);
    if (at == voxels_.size()) voxels_.push_back({key});
    return at;
  }

  /// Groups the points of the mixed voxels by voxel, in scan order.
  template <class LabelOf, class Position>
  void gather_mixed(LabelOf&& label_of, Position&& p_world) {
    std::uint32_t total = 0;
    for (Voxel& voxel : voxels_) {
      voxel.first_mixed = total;
      if (voxel.mixed()) total += voxel.count;
    }
    mixed_points_.resize(total);
    if (total == 0) return;
    next_.resize(voxels_.size());
    for (std::size_t v = 0; v < voxels_.size(); ++v) next_[v] = voxels_[v].first_mixed;
    for (const Run& run : runs_) {
      if (!voxels_[run.voxel].mixed()) continue;
      for (std::size_t number = run.first; number < std::size_t{run.first} + run.count; ++number) {
        const LayeredTruth label = label_of(number);
        if (label.truth == Truth::kIgnored) continue;
        mixed_points_[next_[run.voxel]++] = {p_world(number), label};
      }
    }
  }

  ScanVoxel of_layer(const Voxel& voxel, LayerMask layer) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::uint32_t count = 0;
    const MixedPoint* first = mixed_points_.data() + voxel.first_mixed;
    const MixedPoint* last = first + voxel.count;
    for (const MixedPoint* i = first; i != last; ++i) {
      if ((i->label.layers & layer) == 0) continue;
      sum += i->p_world;
      ++count;
    }
    ScanVoxel found{voxel.key, centroid(sum, count), Truth::kStatic, layer};
    double best = std::numeric_limits<double>::infinity();
    for (const MixedPoint* i = first; i != last; ++i) {
      if ((i->label.layers & layer) == 0) continue;
      const double distance = (i->p_world - found.centroid).squaredNorm();
      if (is_nearer(distance, best)) {
        best = distance;
        found.truth = i->label.truth;
      }
    }
    return found;
  }

  struct Run {
    std::uint32_t first;  // number of a point
    std::uint32_t count;
    std::uint32_t voxel;
    // Constructed in place: a temporary object would be copied by a slow load after its stores.
    Run(std::uint32_t first_point, std::uint32_t point_count, std::uint32_t of_voxel)
        : first(first_point), count(point_count), voxel(of_voxel) {}
  };
  struct MixedPoint {
    Eigen::Vector3d p_world;
    LayeredTruth label;
  };

  VoxelIndex index_;
  std::vector<Voxel> voxels_;
  std::vector<Run> runs_;
  std::vector<MixedPoint> mixed_points_;
  std::vector<std::uint32_t> next_;
};

}  // namespace dynains::evaluation::detail
