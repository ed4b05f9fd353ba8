// Samples of the instances of one scan, grouped by supervoxels.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/stage/voxel_hash_table.hpp"

namespace dynains::detail {

/// Rows of numbers, in the order of the ranks that they were added with: each keeps as many as it
/// may, of those with the least. Numbers of one rank are in their own order.
class SmallestK {
 public:
  /// `most`: of each row, 1 or more.
  explicit SmallestK(std::size_t most) : most_(most), pairs_per_row_((most + 1) / 2) {}

  /// Leaves all rows empty.
  void clear() { pairs_.assign(pairs_.size(), kEmpty); }

  /// Makes sure that there are so many rows; new ones are empty.
  void make_rows(std::size_t count) {
    const std::size_t pairs = count * pairs_per_row_;
    if (pairs_.size() < pairs) pairs_.resize(pairs + pairs / 8, kEmpty);
  }

  /// Adds a number to a row, whose last one goes if it was full. Each place takes the lesser of
  /// what stands there and the greater of the new one and what stood before it: no branch, which
  /// would be taken for every third point of a scan, and never foreseen.
  void add(std::size_t row, std::uint32_t rank, std::uint32_t number) {
    const double key = key_of(rank, number);
    const Pair keys = {key, key};
    Pair* const pairs = &pairs_[row * pairs_per_row_];
    for (std::size_t p = pairs_per_row_ - 1;; --p) {
      const Pair here = pairs[p];
      const Pair before = p > 0 ? pairs[p - 1] : Pair{0.0, 0.0};
      const Pair predecessors = {before[1], here[0]};
      const Pair moved = predecessors > keys ? predecessors : keys;
      pairs[p] = here < moved ? here : moved;
      if (p == 0) return;
    }
  }

  /// How many numbers a row has at most.
  std::size_t most() const { return most_; }

  /// How many numbers the row has.
  std::size_t count(std::size_t row) const {
    std::size_t count = 0;
    for (std::size_t k = 0; k < most_; ++k) count += key(row, k) < kNone ? 1 : 0;
    return count;
  }

  /// The k-th number of a row; 0 if there are not so many.
  std::uint32_t number(std::size_t row, std::size_t k) const {
    const double wanted = key(row, k);
    std::uint64_t bits;
    std::memcpy(&bits, &wanted, sizeof(bits));
    return static_cast<std::uint32_t>(bits);
  }

 private:
  using Pair = double __attribute__((vector_size(16)));
  static constexpr double kNone = 2.0;  // above all keys, and zeros where a number would be
  static constexpr Pair kEmpty = {kNone, kNone};

  // Doubles, since baseline x86-64 finds the lesser of no other numbers of 64 bits. The rank, but
  // for its last three bits, is in their upper half, which makes a normal number between 0 and 2.
  static double key_of(std::uint32_t rank, std::uint32_t number) {
    const std::uint64_t bits = std::uint64_t{0x20000000U + (rank >> 3)} << 32 | number;
    double key;
    std::memcpy(&key, &bits, sizeof(key));
    return key;
  }

  double key(std::size_t row, std::size_t k) const {
    return pairs_[row * pairs_per_row_ + k / 2][k % 2];
  }

  std::size_t most_;
  std::size_t pairs_per_row_;
  std::vector<Pair> pairs_;
};

}  // namespace dynains::detail

namespace dynains {

/// The samples of one scan (m, sensor frame), ordered by instance, then by supervoxel: each
/// instance and each supervoxel is one range of samples.
struct InstanceSamples {
  PointBuffer points;                           ///< padded for packs
  std::vector<std::uint32_t> sample_begin;      ///< by supervoxel, and the end
  std::vector<VoxelKey> place;                  ///< by supervoxel
  std::vector<std::uint32_t> supervoxel_begin;  ///< by instance, and the end
  std::vector<std::uint32_t> supervoxel_of;     ///< by sample, with unused places at the end
  std::vector<std::uint32_t> instance_of;       ///< by supervoxel
  std::vector<std::uint32_t> met_of;            ///< by point: index into `met`
  std::vector<std::uint32_t>
      met;  ///< supervoxels in the order of the scan; the first stands for none

  std::size_t size() const { return sample_begin.empty() ? 0 : sample_begin.back(); }
  std::size_t supervoxel_count() const {
    return sample_begin.empty() ? 0 : sample_begin.size() - 1;
  }
  std::size_t instance_count() const {
    return supervoxel_begin.empty() ? 0 : supervoxel_begin.size() - 1;
  }
  /// Samples of an instance.
  std::uint32_t count(std::size_t instance) const {
    return sample_begin[supervoxel_begin[instance + 1]] - sample_begin[supervoxel_begin[instance]];
  }
};

namespace detail {

/// Key of the cell of each sample, in a grid of `cell` (m) whose corner is the frame `origin`.
inline void find_cells(const InstanceSamples& samples, double cell,
                       const Eigen::Isometry3d& T_origin_sensor, std::vector<VoxelKey>& keys) {
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

}  // namespace detail

/// Selects up to `most_samples` points per supervoxel and instance: those with the smallest hashes
/// of their coordinates. The selection does not depend on the order of the scan.
class InstanceSampler {
 public:
  /// `supervoxel_size`, `max_range`: metres; `most_samples`: of a supervoxel.
  InstanceSampler(double supervoxel_size, double max_range, std::uint32_t most_samples)
      : supervoxels_per_metre_(static_cast<float>(1.0 / supervoxel_size)),
        max_range_(static_cast<float>(max_range)),
        samples_(most_samples) {}

  /// Bits of those of up to 64 points that lie in another supervoxel than their predecessor; the
  /// first bit is set.
  std::uint64_t find_changes(PointsView points) const {
    using namespace detail;
    const PackConstant per_metre(supervoxels_per_metre_);
    std::array<std::array<std::int32_t, kBlock + kPackWidth>, 3> voxel;
    std::uint64_t changes = 0;
    run_packs([&](auto packs) {
      using Packs = decltype(packs);
      for_slices<Packs>(points.size(), [&](const auto& at) {
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

  /// `points`: one scan, sensor frame; `instance_of`: its instances below `instance_count`, or
  /// kNoCluster. Points beyond the range and without instance get no sample.
  void sample(PointsView points, Span<const std::uint32_t> instance_of, std::size_t instance_count,
              InstanceSamples& out) {
    begin_scan();
    detail::ensure_capacity(out.met_of, points.size());
    out.met_of.resize(points.size());
    for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
      const PointsView block = points.subview(begin, std::min(kBlock, points.size() - begin));
      find_supervoxels(block, instance_of.data() + begin);
      meet_supervoxels(block.size(), out.met_of.data() + begin);
      rank_points(begin, block.size(), out.met_of.data() + begin);
    }
    order(points, instance_count, out);
  }

 private:
  // Part of an instance that lies in one voxel. The indices along x and y have 16 bits each.
  struct Supervoxel {
    std::int32_t xy = 0;
    std::int32_t z = 0;
    std::int32_t instance = -2;  // -1: points that get no sample; -2: no supervoxel

    static Supervoxel none() { return {0, 0, -1}; }
    friend bool operator==(const Supervoxel& a, const Supervoxel& b) {
      return ((a.xy ^ b.xy) | (a.z ^ b.z) | (a.instance ^ b.instance)) == 0;
    }
    friend std::uint32_t voxel_hash(const Supervoxel& s) {
      return static_cast<std::uint32_t>(detail::mixed_hash(s.xy, s.z, s.instance));
    }
  };
  using SupervoxelTable = VoxelHashTable<Supervoxel>;
  static constexpr int kHalf = 16;           // bits
  static constexpr std::size_t kBlock = 64;  // points that are worked off together
  // Ranks are hashes of rounded coordinates, so that they do not depend on the last bits, which
  // change when the sensor frame rotates.
  static constexpr float kPlacesPerMetre = 64.0F;

  void begin_scan() {
    table_.clear();
    table_.insert(Supervoxel::none());  // number 0
    samples_.clear();
  }

  // The supervoxel of each point, and its rank there.
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
      rank.store(&rank_[at.begin]);
      const Int xy = keep(is_sampled, (floor(px * per_metre) << kHalf) +
                                          (floor(py * per_metre) & Int((1 << kHalf) - 1)));
      const Int z = keep(is_sampled, floor(pz * per_metre));
      const Int kept_instance = select(is_sampled, instance, Int(-1));
      xy.store(&xy_[at.begin]);
      z.store(&z_[at.begin]);
      kept_instance.store(&instance_[at.begin]);
      mixed_hash(xy, z, kept_instance).store(&hash_[at.begin]);
    });
  }

  // Most points lie in the supervoxel that was met last in the first slot of its hash.
  void meet_supervoxels(std::size_t count, std::uint32_t* met_of) {
    detail::grow(supervoxels_, table_.size() + kBlock);
    table_.reserve(table_.size() + kBlock);
    for (std::size_t i = 0; i < count; ++i) {
      const Supervoxel supervoxel = {xy_[i], z_[i], instance_[i]};
      const SupervoxelTable::Slot& slot = table_.first_slot(static_cast<std::uint32_t>(hash_[i]));
      met_of[i] = slot.key == supervoxel ? slot.number : meet_supervoxel(supervoxel, i);
    }
  }

  std::uint32_t meet_supervoxel(const Supervoxel& supervoxel, std::size_t i) {
    const std::uint32_t number = table_.insert(supervoxel, static_cast<std::uint32_t>(hash_[i]));
    supervoxels_[number] = supervoxel;
    return number;
  }

  // Consecutive points mostly share a row, and each change of a row depends on the change before:
  // points from four parts of the block alternate.
  void rank_points(std::size_t begin, std::size_t count, const std::uint32_t* met_of) {
    constexpr std::size_t kStretches = 4, kLength = kBlock / kStretches;
    samples_.make_rows(table_.size());
    const auto rank = [&](std::size_t i) {
      samples_.add(met_of[i], static_cast<std::uint32_t>(rank_[i]),
                   static_cast<std::uint32_t>(begin + i));
    };
    if (count < kBlock) {
      for (std::size_t i = 0; i < count; ++i) rank(i);
      return;
    }
    for (std::size_t i = 0; i < kLength; ++i) {
      for (std::size_t k = 0; k < kStretches; ++k) rank(i + k * kLength);
    }
  }

  static VoxelKey place_of(const Supervoxel& cell) {
    return voxel_key(cell.xy >> kHalf, static_cast<std::int16_t>(cell.xy), cell.z);
  }

  // A counting sort: supervoxels by instance, and their samples with them.
  void order(PointsView points, std::size_t instance_count, InstanceSamples& out) {
    const std::size_t supervoxel_count = table_.size() - 1;
    out.supervoxel_begin.assign(instance_count + 1, 0);
    for (std::size_t met = 1; met <= supervoxel_count; ++met) {
      ++out.supervoxel_begin[static_cast<std::uint32_t>(supervoxels_[met].instance) + 1];
    }
    for (std::size_t i = 1; i <= instance_count; ++i) {
      out.supervoxel_begin[i] += out.supervoxel_begin[i - 1];
    }
    next_.assign(out.supervoxel_begin.begin(), out.supervoxel_begin.end());
    out.met.resize(supervoxel_count + 1);
    out.met[0] = kNoCluster;
    out.place.resize(supervoxel_count);
    out.instance_of.resize(supervoxel_count);
    detail::grow(ordered_, supervoxel_count);
    for (std::size_t met = 1; met <= supervoxel_count; ++met) {
      const Supervoxel& supervoxel = supervoxels_[met];
      const auto instance = static_cast<std::uint32_t>(supervoxel.instance);
      const std::uint32_t to = next_[instance]++;
      out.met[met] = to;
      out.place[to] = place_of(supervoxel);
      out.instance_of[to] = instance;
      ordered_[to] = static_cast<std::uint32_t>(met);
    }
    copy_samples(points, supervoxel_count, out);
  }

  // Copies the maximum number of samples of each supervoxel without a branch; the next supervoxel
  // overwrites the excess.
  void copy_samples(PointsView points, std::size_t supervoxel_count, InstanceSamples& out) {
    const std::size_t most = samples_.most();
    const std::size_t capacity =
        std::min(supervoxel_count * most, points.size() + most) + detail::kMaxPackWidth;
    out.points.grow(capacity);
    detail::grow(out.supervoxel_of, capacity);
    out.sample_begin.resize(supervoxel_count + 1);
    float* const x = out.points.x.data();
    float* const y = out.points.y.data();
    float* const z = out.points.z.data();
    std::uint32_t* const supervoxel_of = out.supervoxel_of.data();
    std::size_t to = 0;
    for (std::size_t s = 0; s < supervoxel_count; ++s) {
      out.sample_begin[s] = static_cast<std::uint32_t>(to);
      const std::uint32_t met = ordered_[s];
      for (std::size_t k = 0; k < most; ++k) {
        const std::size_t i = samples_.number(met, k);
        x[to + k] = points.x[i];
        y[to + k] = points.y[i];
        z[to + k] = points.z[i];
        supervoxel_of[to + k] = static_cast<std::uint32_t>(s);
      }
      to += samples_.count(met);
    }
    out.sample_begin[supervoxel_count] = static_cast<std::uint32_t>(to);
  }

  float supervoxels_per_metre_;
  float max_range_;
  SupervoxelTable table_{4096};  // numbers as met_of counts them; 0: no sample
  // By point of a block.
  std::array<std::int32_t, kBlock> xy_ = {}, z_ = {}, instance_ = {}, hash_ = {}, rank_ = {};
  detail::SmallestK samples_;            // by supervoxel
  std::vector<Supervoxel> supervoxels_;  // by number in the table; unused places at the end
  std::vector<std::uint32_t> next_;
  std::vector<std::uint32_t> ordered_;  // numbers in the table, by instance
};

}  // namespace dynains
