// The first of the two voxelisations: one scan, for several layers (subsets of its points) at once.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/evaluation/truth.hpp"
#include "evaluation/detail/located_points.hpp"
#include "evaluation/detail/preservation.hpp"
#include "evaluation/detail/voxel_index.hpp"

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
  Truth truth;
  LayerMask layers;
  friend bool operator==(const LayeredTruth& a, const LayeredTruth& b) {
    return (a.truth == b.truth) & (a.layers == b.layers);
  }
};

/// Runs of consecutive points of a block with one voxel and one label.
struct PointRuns {
  std::size_t count = 0;
  std::array<VoxelKey, PointBlock::kMost> keys;
  std::array<std::uint32_t, PointBlock::kMost> begins, ends;  ///< points [begin, end)

  /// Finds the runs of the points that have a key. `labels`: of the points of the block.
  void find(const PointBlock& block, const LayeredTruth* labels) {
    std::size_t begin = 0;
    count = 0;
    for (std::size_t i = 0; i < block.count; ++i) {
      keys[count] = block.key[i];
      begins[count] = static_cast<std::uint32_t>(begin);
      ends[count] = static_cast<std::uint32_t>(i + 1);
      const bool is_last =
          i + 1 == block.count || block.key[i + 1] != block.key[i] || !(labels[i + 1] == labels[i]);
      begin = is_last ? i + 1 : begin;
      count += is_last & (block.key[i] != kNoKey);
    }
  }
};

/// The points of some layers of a scan in one voxel.
struct ScanVoxel {
  std::uint32_t number;      ///< of the voxel
  Eigen::Vector3d centroid;  ///< m, world frame
  Truth truth;               ///< of the point nearest to the centroid
  LayerMask layers;
};

/// Voxelises one scan at a time; memory is reused. Of the points, only their numbers are stored.
class ScanVoxels {
 public:
  void clear() {
    voxels_.clear();
    runs_.clear();
  }

  /// Adds the points of a block that have a key. `labels`: of its points, none of them ignored.
  /// `number(keys, count, numbers)`: numbers of voxels, from 0 without gaps, or VoxelIndex::kNone
  /// for a voxel to leave out.
  template <class Number>
  void add(const PointBlock& block, const LayeredTruth* labels, Number&& number) {
    found_.find(block, labels);
    number(found_.keys.data(), found_.count, numbers_.data());
    for (std::size_t r = 0; r < found_.count; ++r) {
      if (numbers_[r] < place_of_.size()) __builtin_prefetch(&place_of_[numbers_[r]]);
    }
    for (std::size_t r = 0; r < found_.count; ++r) {
      if (numbers_[r] == VoxelIndex::kNone) continue;
      const std::size_t begin = found_.begins[r], end = found_.ends[r];
      const std::uint32_t place = place_of(numbers_[r]);
      voxels_[place].add(block, begin, end, labels[begin]);
      runs_.emplace_back(static_cast<std::uint32_t>(block.first + begin),
                         static_cast<std::uint32_t>(end - begin), place, labels[begin]);
    }
  }

  /// Calls `visit(ScanVoxel)` for every voxel, once or once per layer, in the order of their first
  /// points. `p_world(number)`: position of a point by its number in the scan.
  template <class Position, class Visit>
  void for_each(LayerMask all_layers, Position&& p_world, Visit&& visit) {
    gather_mixed(p_world);
    for (const Voxel& voxel : voxels_) {
      if (!voxel.mixed()) {
        const Truth truth =
            voxel.truths == truth_bit(Truth::kStatic) ? Truth::kStatic : Truth::kDynamic;
        visit(ScanVoxel{voxel.number, centroid(voxel.sum, voxel.count), truth, voxel.in_any});
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
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::uint32_t number = VoxelIndex::kNone;
    std::uint32_t count = 0;
    std::uint32_t first_mixed = 0;  // range in mixed_points_
    TruthMask truths = 0;
    LayerMask in_all = 0xff;
    LayerMask in_any = 0;

    void add(const PointBlock& block, std::size_t begin, std::size_t end, LayeredTruth label) {
      Eigen::Vector3d total = sum;
      for (std::size_t i = begin; i < end; ++i) total += block.p_world(i);
      sum = total;
      count += static_cast<std::uint32_t>(end - begin);
      truths |= truth_bit(label.truth);
      in_all &= label.layers;
      in_any |= label.layers;
    }

    /// The layers differ, or the points have several classes.
    bool mixed() const { return in_all != in_any || truths == kBothTruths; }
  };

  static Eigen::Vector3d centroid(const Eigen::Vector3d& sum, std::uint32_t count) {
    return sum / static_cast<double>(count);
  }

  /// Index in voxels_; adds a voxel that the scan does not have yet.
  std::uint32_t place_of(std::uint32_t number) {
    if (number >= place_of_.size()) place_of_.resize(2 * std::size_t{number} + 1);
    std::uint32_t& place = place_of_[number];
    if (place >= voxels_.size() || voxels_[place].number != number) {
      place = static_cast<std::uint32_t>(voxels_.size());
      voxels_.emplace_back().number = number;
    }
    return place;
  }

  /// Groups the points of the mixed voxels by voxel, in scan order.
  template <class Position>
  void gather_mixed(Position&& p_world) {
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
        mixed_points_[next_[run.voxel]++] = {p_world(number), run.label};
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
    ScanVoxel found{voxel.number, centroid(sum, count), Truth::kStatic, layer};
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
    LayeredTruth label;
    // Constructed in place: a temporary object would be copied by a slow load after its stores.
    Run(std::uint32_t first_point, std::uint32_t point_count, std::uint32_t of_voxel,
        LayeredTruth of_points)
        : first(first_point), count(point_count), voxel(of_voxel), label(of_points) {}
  };
  struct MixedPoint {
    Eigen::Vector3d p_world;
    LayeredTruth label;
  };

  PointRuns found_;  // in a block
  std::array<std::uint32_t, PointBlock::kMost> numbers_;

  std::vector<Voxel> voxels_;
  std::vector<std::uint32_t> place_of_;  // by number; of an earlier scan, if voxels_ does not agree
  std::vector<Run> runs_;
  std::vector<MixedPoint> mixed_points_;
  std::vector<std::uint32_t> next_;
};

}  // namespace dynains::evaluation::detail
