// Few points that stand for many: samples of the instances of one scan, grouped in supervoxels.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/detail/cell_hash.hpp"
#include "dynains/detail/wide_lanes.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Place of a supervoxel in its grid, packed: ordered by x, then y, then z.
using SupervoxelPlace = std::uint64_t;

inline SupervoxelPlace pack_place(std::int32_t x, std::int32_t y, std::int32_t z) {
  constexpr std::int64_t kOffset = std::int64_t{1} << 20;
  return static_cast<std::uint64_t>(x + kOffset) << 42 |
         static_cast<std::uint64_t>(y + kOffset) << 21 | static_cast<std::uint64_t>(z + kOffset);
}

inline std::array<std::int32_t, 3> unpack_place(SupervoxelPlace place) {
  constexpr std::uint64_t kField = (std::uint64_t{1} << 21) - 1;
  constexpr std::int32_t kOffset = 1 << 20;
  return {static_cast<std::int32_t>(place >> 42) - kOffset,
          static_cast<std::int32_t>(place >> 21 & kField) - kOffset,
          static_cast<std::int32_t>(place & kField) - kOffset};
}

/// The place beside another, some steps along each axis.
inline SupervoxelPlace neighbour(SupervoxelPlace place, int dx, int dy, int dz) {
  return place + (static_cast<std::uint64_t>(static_cast<std::int64_t>(dx)) << 42) +
         (static_cast<std::uint64_t>(static_cast<std::int64_t>(dy)) << 21) +
         static_cast<std::uint64_t>(static_cast<std::int64_t>(dz));
}

/// The samples of one scan in its sensor frame: instance-major, then supervoxel-major, so that
/// what belongs together is one range.
struct InstanceSamples {
  PointBuffer points;                           ///< padded for wide loads
  std::vector<std::uint32_t> sample_begin;      ///< by supervoxel, one more than supervoxels
  std::vector<SupervoxelPlace> place;           ///< by supervoxel
  std::vector<std::uint32_t> supervoxel_begin;  ///< by instance, one more than instances
  std::vector<std::uint32_t> supervoxel_of;     ///< by sample
  std::vector<std::uint32_t> instance_of;       ///< by supervoxel
  /// By point of the scan: 0 if it has no supervoxel, else one more than the position of its
  /// supervoxel in `met`.
  std::vector<std::uint32_t> met_of;
  std::vector<std::uint32_t> met;  ///< supervoxels in the order in which the scan meets them

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

/// Takes one sample per voxel and instance.
class InstanceSampler {
 public:
  /// `sample_size`, `supervoxel_size`, `max_range`: metres; a supervoxel is a whole number of
  /// sample voxels wide.
  InstanceSampler(double sample_size, double supervoxel_size, double max_range)
      : samples_per_metre_(static_cast<float>(1.0 / sample_size)),
        supervoxels_per_voxel_(
            static_cast<float>(1.0 / std::max(1.0, std::round(supervoxel_size / sample_size)))),
        max_range_(static_cast<float>(max_range)) {}

  /// `points`: one scan, sensor frame; `instance_of`: its instances below `instance_count`, or
  /// kNoCluster. Points beyond the range and without instance get no sample.
  void sample(PointsView points, Span<const std::uint32_t> instance_of, std::size_t instance_count,
              InstanceSamples& out) {
    begin_scan();
    detail::make_room(out.met_of, points.size());
    out.met_of.resize(points.size());
    for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
      const std::size_t size = std::min(kBlock, points.size() - begin);
      find_voxels(points.subview(begin, size), instance_of.data() + begin);
      find_runs(begin, size);
      for (std::size_t run = 1; run <= runs_; ++run) met_of_run_[run] = take_run(run_[run]);
      spread_runs(size, out.met_of.data() + begin);
    }
    order(points, instance_count, out);
  }

 private:
  struct Voxel {
    SupervoxelPlace place;
    std::uint32_t instance;

    bool operator==(const Voxel& other) const {
      return place == other.place && instance == other.instance;
    }
  };
  // Consecutive points in one voxel, or without instance.
  struct Run {
    Voxel voxel;
    std::uint32_t begin;
    std::uint32_t slot;
  };
  struct Sample {
    Voxel voxel;
    std::uint32_t supervoxel;
    std::uint32_t point;
  };
  struct Supervoxel {
    Voxel voxel;
    std::uint32_t samples;
  };
  // Direct-mapped memory of the voxels met last: where they stand in an array. A voxel that was
  // pushed out and comes back gets a second sample, which does no harm; nothing is ever searched.
  static constexpr std::size_t kSlots = 1U << 14;
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFFU;
  // Points are looked up in blocks, so that the memory has time to answer; one bit of a word each.
  static constexpr std::size_t kBlock = 64;

  static std::uint32_t slot_of(const Voxel& voxel) {
    return static_cast<std::uint32_t>(detail::place_hash(voxel.place, voxel.instance) % kSlots);
  }

  void begin_scan() {
    slots_.assign(kSlots, kEmpty);
    supervoxel_slots_.assign(kSlots, kEmpty);
    samples_.clear();
    supervoxels_.clear();
    instance_[0] = static_cast<std::int32_t>(kNoCluster);
    met_of_run_[0] = 0;
    runs_ = 0;
  }

  // Voxels of a block, behind that of the last point before it. Points that are not to be sampled
  // have no instance.
  void find_voxels(PointsView points, const std::uint32_t* instance_of) {
    using namespace detail;
    const Constant8 per_metre(samples_per_metre_);
    const Constant8 far_squared(max_range_ * max_range_);
    for_lanes(points.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      using Int = typename decltype(at)::Int;
      std::int32_t* const instance = &instance_[at.begin + 1];
      std::memcpy(instance, &instance_of[at.begin], at.size() * sizeof(std::int32_t));
      const Float px = at.load(points.x.data());
      const Float py = at.load(points.y.data());
      const Float pz = at.load(points.z.data());
      floor(px * per_metre).store(&x_[at.begin + 1]);
      floor(py * per_metre).store(&y_[at.begin + 1]);
      floor(pz * per_metre).store(&z_[at.begin + 1]);
      const Int none(static_cast<std::int32_t>(kNoCluster));
      select(px * px + py * py <= far_squared, Int::load(instance), none).store(instance);
    });
  }

  // Beams that follow each other mostly end in the same voxel: only where the voxel changes does a
  // run begin. The last run of the block before goes on as number 0.
  void find_runs(std::size_t first, std::size_t size) {
    using namespace detail;
    std::uint64_t begins = 0;
    run_lanes([&](auto lanes) {
      using Int = typename decltype(lanes)::Int;
      for (std::size_t i = 0; i < kBlock; i += kLanes) {
        const auto same = [i](const std::int32_t* values) {
          return Int::load(&values[i]) == Int::load(&values[i + 1]);
        };
        const auto follows =
            same(x_.data()) & same(y_.data()) & same(z_.data()) & same(instance_.data());
        begins |= std::uint64_t{~follows.bits() & 0xFFU} << i;
      }
    });
    if (size < kBlock) begins &= (std::uint64_t{1} << size) - 1;
    begins_ = begins;
    met_of_run_[0] = met_of_run_[runs_];
    runs_ = 0;
    for (std::uint64_t left = begins; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(__builtin_ctzll(left));
      Run& run = run_[++runs_];
      run.voxel = {pack_place(x_[i + 1], y_[i + 1], z_[i + 1]),
                   static_cast<std::uint32_t>(instance_[i + 1])};
      run.begin = static_cast<std::uint32_t>(first + i);
      run.slot = slot_of(run.voxel);
      __builtin_prefetch(&slots_[run.slot]);
    }
    for (auto* const values : {&x_, &y_, &z_, &instance_}) (*values)[0] = (*values)[kBlock];
  }

  // What `met_of` says of the points of a run; takes a sample if its voxel has none.
  std::uint32_t take_run(const Run& run) {
    if (run.voxel.instance == kNoCluster) return 0;
    std::uint32_t& number = slots_[run.slot];
    if (number == kEmpty || !(samples_[number].voxel == run.voxel)) {
      number = static_cast<std::uint32_t>(samples_.size());
      const std::uint32_t s =
          find_supervoxel({supervoxel_place(run.voxel.place), run.voxel.instance});
      ++supervoxels_[s].samples;
      samples_.push_back({run.voxel, s, run.begin});
    }
    return samples_[number].supervoxel + 1;
  }

  void spread_runs(std::size_t size, std::uint32_t* met_of) const {
    std::uint64_t begins = begins_;
    std::size_t run = 0;
    for (std::size_t i = 0; i < size; ++i) {
      run += begins & 1U;
      begins >>= 1U;
      met_of[i] = met_of_run_[run];
    }
  }

  SupervoxelPlace supervoxel_place(SupervoxelPlace sample) const {
    const std::array<std::int32_t, 3> at = unpack_place(sample);
    return pack_place(supervoxel_index(at[0]), supervoxel_index(at[1]), supervoxel_index(at[2]));
  }

  // Floor of the quotient. The half keeps it so far from whole numbers that the product of floats
  // rounds to the right side for all indices below 2^20.
  std::int32_t supervoxel_index(std::int32_t sample_index) const {
    const float quotient = (static_cast<float>(sample_index) + 0.5F) * supervoxels_per_voxel_;
    const auto whole = static_cast<std::int32_t>(quotient);
    return whole - (static_cast<float>(whole) > quotient ? 1 : 0);
  }

  std::uint32_t find_supervoxel(const Voxel& voxel) {
    std::uint32_t& number = supervoxel_slots_[slot_of(voxel)];
    if (number == kEmpty || !(supervoxels_[number].voxel == voxel)) {
      number = static_cast<std::uint32_t>(supervoxels_.size());
      supervoxels_.push_back({voxel, 0});
    }
    return number;
  }

  // Two counting sorts: supervoxels by instance, samples by supervoxel.
  void order(PointsView points, std::size_t instance_count, InstanceSamples& out) {
    out.supervoxel_begin.assign(instance_count + 1, 0);
    for (const Supervoxel& s : supervoxels_) ++out.supervoxel_begin[s.voxel.instance + 1];
    for (std::size_t i = 1; i <= instance_count; ++i) {
      out.supervoxel_begin[i] += out.supervoxel_begin[i - 1];
    }
    next_.assign(out.supervoxel_begin.begin(), out.supervoxel_begin.end());
    out.met.resize(supervoxels_.size());
    out.place.resize(supervoxels_.size());
    out.instance_of.resize(supervoxels_.size());
    out.sample_begin.assign(supervoxels_.size() + 1, 0);
    for (std::size_t s = 0; s < supervoxels_.size(); ++s) {
      const std::uint32_t to = next_[supervoxels_[s].voxel.instance]++;
      out.met[s] = to;
      out.sample_begin[to + 1] = supervoxels_[s].samples;
      out.place[to] = supervoxels_[s].voxel.place;
      out.instance_of[to] = supervoxels_[s].voxel.instance;
    }
    for (std::size_t s = 1; s <= supervoxels_.size(); ++s) {
      out.sample_begin[s] += out.sample_begin[s - 1];
    }
    out.points.grow(samples_.size() + detail::kLanes);
    out.supervoxel_of.resize(samples_.size());
    next_.assign(out.sample_begin.begin(), out.sample_begin.end());
    for (const Sample& sample : samples_) {
      const std::uint32_t supervoxel = out.met[sample.supervoxel];
      const std::uint32_t to = next_[supervoxel]++;
      out.supervoxel_of[to] = supervoxel;
      out.points.x[to] = points.x[sample.point];
      out.points.y[to] = points.y[sample.point];
      out.points.z[to] = points.z[sample.point];
    }
  }

  float samples_per_metre_;
  float supervoxels_per_voxel_;
  float max_range_;
  // By point of a block, behind the last one before it.
  std::array<std::int32_t, kBlock + 1> x_ = {}, y_ = {}, z_ = {}, instance_ = {};
  std::uint64_t begins_ = 0;  // points of the block with which a run begins
  // From 1 on; 0 is the last run of the block before.
  std::array<Run, kBlock + 1> run_;
  std::array<std::uint32_t, kBlock + 1> met_of_run_ = {};
  std::size_t runs_ = 0;
  std::vector<std::uint32_t> slots_;             // into samples_
  std::vector<std::uint32_t> supervoxel_slots_;  // into supervoxels_
  std::vector<Sample> samples_;
  std::vector<Supervoxel> supervoxels_;
  std::vector<std::uint32_t> next_;
};

}  // namespace dynains
