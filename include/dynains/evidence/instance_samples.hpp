// Samples of the instances of one scan, grouped by supervoxels.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::detail {

/// The samples of one scan, ordered by instance, then by supervoxel: each instance and each
/// supervoxel is one range of samples.
struct InstanceSamples {
  PointBuffer points;  ///< samples, m, sensor frame; padded for packs
  /// By sample, padded for packs: largest lateral distance (m) at which a beam passes within its
  /// instance rather than beside it. It is a quarter of the width of the instance at the height of
  /// the sample (poles bear lamps and signs), across the direction from the sensor, and grows with
  /// the distance, since edges lie between two beams.
  std::vector<float> reach;
  std::vector<std::uint32_t> sample_begin;      ///< by supervoxel: first sample, and the end
  std::vector<VoxelKey> place;                  ///< by part: its voxel in the sensor frame
  std::vector<std::uint32_t> supervoxel_begin;  ///< by instance: first supervoxel, and the end
  /// By part of an instance: the supervoxels, then the parts beyond the range, without samples.
  std::vector<std::uint32_t> instance_of;
  std::vector<std::uint32_t> group_of_point;  ///< by point: index of its part, plus 1; 0: none

  std::size_t size() const { return sample_begin.empty() ? 0 : sample_begin.back(); }
  std::size_t supervoxel_count() const {
    return sample_begin.empty() ? 0 : sample_begin.size() - 1;
  }
  std::size_t instance_count() const {
    return supervoxel_begin.empty() ? 0 : supervoxel_begin.size() - 1;
  }
  /// Number of samples of an instance.
  std::uint32_t count(std::size_t instance) const {
    return sample_begin[supervoxel_begin[instance + 1]] - sample_begin[supervoxel_begin[instance]];
  }
};

/// Computes the key of the cell of each sample, in a grid in the origin frame with cells of edge
/// `cell` (m).
inline void find_cells(const InstanceSamples& samples, double cell, const Pose& T_origin_sensor,
                       std::vector<VoxelKey>& keys) {
  const PackTransform to_cells(T_origin_sensor, 1.0 / cell);
  keys.resize(samples.size());
  VoxelKey* const key = keys.data();
  for_packs(samples.size(), [&](auto at) {
    using Float = typename decltype(at)::Float;
    const Float x = at.load(samples.points.x.data());
    const Float y = at.load(samples.points.y.data());
    const Float z = at.load(samples.points.z.data());
    std::int32_t index[3][decltype(at)::kCount];
    for (std::size_t axis = 0; axis < 3; ++axis) floor(to_cells(axis, x, y, z)).store(index[axis]);
    for (std::size_t k = 0; k < at.size(); ++k) {
      key[at.begin + k] = voxel_key(index[0][k], index[1][k], index[2][k]);
    }
  });
}

/// Selects samples of instances: in each supervoxel, up to `max_samples` points of the smallest
/// hashes of their coordinates. A supervoxel is the part of one instance in one voxel. The
/// selection does not depend on the order of the points.
class InstanceSampler {
 public:
  /// `supervoxel_size` (m): edge of the voxels. `max_range` (m): horizontal range beyond which
  /// points get no sample. `max_samples`: maximum number of samples of a supervoxel, at least 1.
  InstanceSampler(double supervoxel_size, double max_range, std::uint32_t max_samples)
      : supervoxels_per_metre_(static_cast<float>(1.0 / supervoxel_size)),
        max_range_(static_cast<float>(max_range)),
        most_(max_samples) {}

  /// Bits of the points, of up to 64 `points`, that lie in another voxel than their predecessor.
  /// The first bit is always set.
  std::uint64_t find_changes(PointsView points) const {
    using namespace detail;
    const PackConstant per_metre(supervoxels_per_metre_);
    std::array<std::array<std::int32_t, kWordBits + kPackWidth>, 3> voxel;
    std::uint64_t changes = 0;
    with_packs([&](auto packs) {
      using Packs = decltype(packs);
      for_slices<Packs>(0, points.size(), [&](const auto& at) {
        floor(at.load(points.x.data()) * per_metre).store(&voxel[0][at.begin + 1]);
        floor(at.load(points.y.data()) * per_metre).store(&voxel[1][at.begin + 1]);
        floor(at.load(points.z.data()) * per_metre).store(&voxel[2][at.begin + 1]);
      });
      for (auto& line : voxel) line[0] = 0;
      changes =
          detail::find_changes<Packs>(points.size(), &voxel[0][1], &voxel[1][1], &voxel[2][1]);
    });
    return changes | 1;
  }

  /// Replaces `out` by the samples of one scan. `points`: m, sensor frame. `instance_of`: by point,
  /// instance below `instance_count`, or kNoCluster. Points beyond the range or without an instance
  /// get no sample.
  void sample(PointsView points, Span<const std::uint32_t> instance_of, std::size_t instance_count,
              InstanceSamples& out) {
    begin_scan();
    resize_with_margin(out.group_of_point, points.size());
    for (std::size_t begin = 0; begin < points.size(); begin += kWordBits) {
      const PointsView block = points.subview(begin, std::min(kWordBits, points.size() - begin));
      find_supervoxels(block, instance_of.data() + begin);
      add_points(begin, block.size(), out.group_of_point.data() + begin);
    }
    order(points, instance_count, out);
  }

  /// Computes InstanceSamples::reach.
  void find_reach(InstanceSamples& samples) {
    constexpr float kReach = 0.25F;        // ratio to the width
    constexpr float kReachSlope = 0.005F;  // m/m
    const PointBuffer& points = samples.points;
    grow(samples.reach, samples.size() + kPackWidth);
    const auto height_of = [&](std::uint32_t s) { return voxel_index(samples.place[s], 2); };
    for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
      const std::uint32_t first = samples.supervoxel_begin[instance];
      const std::uint32_t last = samples.supervoxel_begin[instance + 1];
      if (first == last) continue;
      std::int64_t lowest = height_of(first), highest = lowest;
      for (std::uint32_t s = first + 1; s < last; ++s) {
        lowest = std::min(lowest, height_of(s));
        highest = std::max(highest, height_of(s));
      }
      layers_.assign(static_cast<std::size_t>(highest - lowest) + 1, Layer());
      Layer* const layers = layers_.data();
      // The direction of any sample serves for all.
      const std::uint32_t any = samples.sample_begin[first];
      const float x = points.x[any], y = points.y[any];
      const float distance = std::max(std::sqrt(x * x + y * y), 1e-3F);
      for (std::uint32_t s = first; s < last; ++s) {
        Layer layer = layers[height_of(s) - lowest];
        for (std::uint32_t i = samples.sample_begin[s]; i < samples.sample_begin[s + 1]; ++i) {
          const float aside = x * points.y[i] - y * points.x[i];
          layer.left = std::max(layer.left, aside);
          layer.right = std::min(layer.right, aside);
        }
        layers[height_of(s) - lowest] = layer;
      }
      for (std::uint32_t s = first; s < last; ++s) {
        const Layer& layer = layers[height_of(s) - lowest];
        const float width = layer.left / distance - layer.right / distance;
        std::fill(samples.reach.begin() + samples.sample_begin[s],
                  samples.reach.begin() + samples.sample_begin[s + 1],
                  kReach * width + kReachSlope * distance);
      }
    }
  }

 private:
  // Extent of an instance at a height, along the direction to the left, m times the distance.
  struct Layer {
    float left = -std::numeric_limits<float>::infinity();
    float right = std::numeric_limits<float>::infinity();
  };

  // Part of an instance in one voxel, or beyond the range. `xy` contains the voxel indices along x
  // and y, 16 bits each.
  struct Supervoxel {
    std::int32_t xy = 0;
    std::int32_t z = std::numeric_limits<std::int32_t>::min();  // beyond the range
    std::int32_t instance = -2;  // -1: points without an instance; -2: empty slot of the table

    bool is_far() const { return z == Supervoxel().z; }
    friend bool operator==(const Supervoxel& a, const Supervoxel& b) {
      return ((a.xy ^ b.xy) | (a.z ^ b.z) | (a.instance ^ b.instance)) == 0;
    }
    friend std::uint32_t voxel_hash(const Supervoxel& s) {
      return static_cast<std::uint32_t>(mixed_hash(s.xy, s.z, s.instance));
    }
  };
  using SupervoxelTable = VoxelHashTable<Supervoxel>;
  // Ranks are hashes of rounded coordinates. The rounding removes the last bits, which depend on
  // the rotation of the sensor frame.
  static constexpr float kPlacesPerMetre = 64.0F;
  static constexpr int kIgnoredBits = 3;  // of a rank
  static constexpr std::int32_t kMaxRank = 0x1FFFFFFF;
  static constexpr std::uint64_t kNoKey = ~std::uint64_t{0};

  void begin_scan() {
    std::fill_n(keys_.begin(), std::min(keys_.size(), table_.size() * most_), kNoKey);
    table_.clear();
    table_.insert({0, Supervoxel().z, -1});  // number 0
  }

  // Computes the supervoxel and the rank of each point of a block.
  void find_supervoxels(PointsView points, const std::uint32_t* instance_of) {
    using namespace detail;
    const PackConstant per_metre(supervoxels_per_metre_), far_squared(max_range_ * max_range_);
    static constexpr PackConstant kPlaces(kPlacesPerMetre);
    for_packs(points.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      using Int = typename decltype(at)::Int;
      const Float px = at.load(points.x.data());
      const Float py = at.load(points.y.data());
      const Float pz = at.load(points.z.data());
      const Int instance = at.load(instance_of);
      const auto is_sampled = (px * px + py * py <= far_squared) &
                              ~(instance == Int(static_cast<std::int32_t>(kNoCluster)));
      const Int rank =
          mixed_hash(truncate(px * kPlaces), truncate(py * kPlaces), truncate(pz * kPlaces));
      (rank >> kIgnoredBits & Int(kMaxRank)).store(&rank_[at.begin]);
      const Int xy = is_sampled &
                     ((floor(px * per_metre) << 16) + (floor(py * per_metre) & Int((1 << 16) - 1)));
      const Int z = select(is_sampled, floor(pz * per_metre), Int(Supervoxel().z));
      xy.store(&xy_[at.begin]);
      z.store(&z_[at.begin]);
      instance.store(&instance_[at.begin]);
      mixed_hash(xy, z, instance).store(&hash_[at.begin]);
    });
  }

  // Adds the points of a block to the rows of their supervoxels, which are numbered in the order of
  // the points. `begin`: index of the first point. A row keeps the keys of the smallest ranks, then
  // numbers, in ascending order.
  void add_points(std::size_t begin, std::size_t count, std::uint32_t* number_of_point) {
    const std::size_t capacity = table_.size() + kWordBits;
    grow(supervoxels_, capacity);
    table_.reserve(capacity);
    if (keys_.size() < capacity * most_) keys_.resize(capacity * most_ * 9 / 8, kNoKey);
    std::uint64_t* const keys = keys_.data();
    const std::size_t most = most_;
    with_packs([&](auto packs) {
      const auto add_run = [&](std::size_t first, std::size_t last) {
        const std::uint32_t number = number_of(first);
        std::uint64_t* const row = keys + number * most;
        for (std::size_t i = first; i < last; ++i) {
          number_of_point[i] = number;
          const auto rank = static_cast<std::uint64_t>(rank_[i]);
          if (rank >= row[most - 1] >> 32) continue;  // of equal ranks, the first point stays
          const std::uint64_t key = rank << 32 | (begin + i);
          std::size_t k = most - 1;
          for (; k > 0 && key < row[k - 1]; --k) row[k] = row[k - 1];
          row[k] = key;
        }
      };
      for_each_run<decltype(packs)>(count, add_run, xy_.data(), z_.data(), instance_.data());
    });
  }

  // Number of the supervoxel of a point of the block, which may be new. For most points, the first
  // slot of the hash holds it.
  std::uint32_t number_of(std::size_t i) {
    const Supervoxel supervoxel = {xy_[i], z_[i], instance_[i]};
    const auto hash = static_cast<std::uint32_t>(hash_[i]);
    const SupervoxelTable::Slot& slot = table_.first_slot(hash);
    return slot.key == supervoxel ? slot.number : meet(i);
  }

  [[gnu::noinline]] std::uint32_t meet(std::size_t i) {
    const Supervoxel supervoxel = {xy_[i], z_[i], instance_[i]};
    const std::uint32_t number = table_.insert(supervoxel, static_cast<std::uint32_t>(hash_[i]));
    supervoxels_[number] = supervoxel;
    return number;
  }

  static VoxelKey place_of(const Supervoxel& cell) {
    return voxel_key(cell.xy >> 16, static_cast<std::int16_t>(cell.xy), cell.z);
  }

  // Counting sort of the supervoxels by instance; the samples follow their supervoxels.
  void order(PointsView points, std::size_t instance_count, InstanceSamples& out) {
    const auto bucket_of = [&](const Supervoxel& supervoxel) {
      return supervoxel.is_far() ? instance_count : static_cast<std::size_t>(supervoxel.instance);
    };
    out.supervoxel_begin.assign(instance_count + 2, 0);
    for (std::size_t number = 1; number < table_.size(); ++number) {
      ++out.supervoxel_begin[bucket_of(supervoxels_[number]) + 1];
    }
    std::partial_sum(out.supervoxel_begin.begin(), out.supervoxel_begin.end(),
                     out.supervoxel_begin.begin());
    next_.assign(out.supervoxel_begin.begin(), out.supervoxel_begin.end());
    out.supervoxel_begin.pop_back();
    out.place.resize(table_.size() - 1);
    out.instance_of.resize(table_.size() - 1);
    grow(ordered_, table_.size());
    grow(group_of_number_, table_.size());
    for (std::size_t number = 1; number < table_.size(); ++number) {
      const Supervoxel& supervoxel = supervoxels_[number];
      const std::uint32_t to = next_[bucket_of(supervoxel)]++;
      group_of_number_[number] = to + 1;
      out.place[to] = place_of(supervoxel);
      out.instance_of[to] = static_cast<std::uint32_t>(supervoxel.instance);
      ordered_[to] = static_cast<std::uint32_t>(number);
    }
    for_packs(points.size(), [groups = out.group_of_point.data(),
                              group_of_number = group_of_number_.data()](const auto& at) {
      for (std::size_t k = 0; k < at.size(); ++k) {
        groups[at.begin + k] = group_of_number[groups[at.begin + k]];
      }
    });
    copy_samples(points, out.supervoxel_begin.back(), out);
  }

  void copy_samples(PointsView points, std::size_t supervoxel_count, InstanceSamples& out) {
    const std::uint64_t* const keys = keys_.data();
    out.sample_begin.assign(1, 0);
    for (std::size_t s = 0; s < supervoxel_count; ++s) {
      const std::uint64_t* const row = keys + ordered_[s] * most_;
      const auto count = std::find(row, row + most_, kNoKey) - row;
      out.sample_begin.push_back(out.sample_begin.back() + static_cast<std::uint32_t>(count));
    }
    out.points.grow(out.size() + kPackWidth);
    for (std::size_t s = 0; s < supervoxel_count; ++s) {
      const std::uint64_t* row = keys + ordered_[s] * most_;
      for (std::uint32_t to = out.sample_begin[s]; to < out.sample_begin[s + 1]; ++to, ++row) {
        out.points.set(to, points, static_cast<std::uint32_t>(*row));
      }
    }
  }

  float supervoxels_per_metre_;
  float max_range_;
  SupervoxelTable table_{4096};  // numbers of supervoxels
  // By point of a block.
  std::array<std::int32_t, kWordBits> xy_ = {}, z_ = {}, instance_ = {}, hash_ = {}, rank_ = {};
  std::vector<Layer> layers_;        // of an instance, from the lowest one on
  std::size_t most_;                 // samples of a supervoxel
  std::vector<std::uint64_t> keys_;  // by number in the table: most_ ranks and indices of points
  std::vector<Supervoxel> supervoxels_;  // by number in the table; padded at the end
  std::vector<std::uint32_t> next_;      // by instance: position of its next supervoxel
  std::vector<std::uint32_t> ordered_;   // by part of an instance: number in the table
  std::vector<std::uint32_t> group_of_number_ = {0};
};

}  // namespace dynains::detail
