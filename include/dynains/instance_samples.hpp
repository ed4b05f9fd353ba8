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
  std::vector<std::uint32_t> met_of;  ///< by point of the scan: its supervoxel's position in `met`
  std::vector<std::uint32_t> met;     ///< supervoxels as the scan meets them, behind one for none

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
  };
  // Consecutive points in one voxel, or without instance.
  struct Run {
    Voxel voxel;
    std::uint32_t begin;
    std::uint32_t slot;
  };
  struct Sample {
    std::uint32_t met;  // its supervoxel, as InstanceSamples::met_of counts them
    std::uint32_t point;
  };
  // Number 0 stands for none.
  struct Supervoxel {
    SupervoxelPlace place;
    std::uint32_t instance;
    std::uint32_t samples;
  };
  // Direct-mapped memory of the voxels met last, with their supervoxels. A voxel that was pushed
  // out and comes back gets a second sample, which does no harm; nothing is ever searched.
  struct Recent {
    SupervoxelPlace place = 0;
    std::uint32_t instance = kNoCluster;
    std::uint32_t met = 0;

    bool is(const Voxel& voxel) const { return place == voxel.place && instance == voxel.instance; }
  };
  static constexpr std::size_t kSlots = 1U << 14;
  // Points are looked up in blocks, so that the memory has time to answer; one bit of a word each.
  static constexpr std::size_t kBlock = 64;

  static std::uint32_t slot_of(const Voxel& voxel) {
    return static_cast<std::uint32_t>(detail::place_hash(voxel.place, voxel.instance) % kSlots);
  }

  void begin_scan() {
    recent_.assign(kSlots, Recent());
    supervoxel_slots_.assign(kSlots, 0);
    samples_.clear();
    supervoxels_.assign(1, {0, kNoCluster, 0});
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
      __builtin_prefetch(&recent_[run.slot]);
    }
    for (auto* const values : {&x_, &y_, &z_, &instance_}) (*values)[0] = (*values)[kBlock];
  }

  // What `met_of` says of the points of a run; takes a sample if its voxel has none.
  std::uint32_t take_run(const Run& run) {
    if (run.voxel.instance == kNoCluster) return 0;
    Recent& recent = recent_[run.slot];
    if (!recent.is(run.voxel)) {
      const std::uint32_t met =
          find_supervoxel({supervoxel_place(run.voxel.place), run.voxel.instance});
      recent = {run.voxel.place, run.voxel.instance, met};
      ++supervoxels_[met].samples;
      samples_.push_back({met, run.begin});
    }
    return recent.met;
  }

  std::uint32_t find_supervoxel(const Voxel& voxel) {
    std::uint32_t& number = supervoxel_slots_[slot_of(voxel)];
    const Supervoxel& known = supervoxels_[number];
    if (known.place != voxel.place || known.instance != voxel.instance) {
      number = static_cast<std::uint32_t>(supervoxels_.size());
      supervoxels_.push_back({voxel.place, voxel.instance, 0});
    }
    return number;
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

  // Two counting sorts: supervoxels by instance, samples by supervoxel.
  void order(PointsView points, std::size_t instance_count, InstanceSamples& out) {
    const std::size_t supervoxel_count = supervoxels_.size() - 1;
    const std::size_t sample_count = samples_.size();
    out.supervoxel_begin.assign(instance_count + 1, 0);
    for (std::size_t met = 1; met <= supervoxel_count; ++met) {
      ++out.supervoxel_begin[supervoxels_[met].instance + 1];
    }
    for (std::size_t i = 1; i <= instance_count; ++i) {
      out.supervoxel_begin[i] += out.supervoxel_begin[i - 1];
    }
    next_.assign(out.supervoxel_begin.begin(), out.supervoxel_begin.end());
    out.met.resize(supervoxel_count + 1);
    out.met[0] = kNoCluster;
    out.place.resize(supervoxel_count);
    out.instance_of.resize(supervoxel_count);
    out.sample_begin.assign(supervoxel_count + 1, 0);
    for (std::size_t met = 1; met <= supervoxel_count; ++met) {
      const Supervoxel& supervoxel = supervoxels_[met];
      const std::uint32_t to = next_[supervoxel.instance]++;
      out.met[met] = to;
      out.sample_begin[to + 1] = supervoxel.samples;
      out.place[to] = supervoxel.place;
      out.instance_of[to] = supervoxel.instance;
    }
    for (std::size_t s = 1; s <= supervoxel_count; ++s) {
      out.sample_begin[s] += out.sample_begin[s - 1];
    }
    out.points.grow(sample_count + detail::kLanes);
    out.supervoxel_of.resize(sample_count);
    next_.assign(out.sample_begin.begin(), out.sample_begin.end());
    for (const Sample& sample : samples_) {
      const std::uint32_t supervoxel = out.met[sample.met];
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
  std::vector<Recent> recent_;
  std::vector<std::uint32_t> supervoxel_slots_;  // into supervoxels_
  std::vector<Sample> samples_;
  std::vector<Supervoxel> supervoxels_;
  std::vector<std::uint32_t> next_;
};

}  // namespace dynains
