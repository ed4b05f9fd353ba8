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
  /// Consecutive points of the scan in one supervoxel.
  struct Streak {
    std::uint32_t begin, end;
    std::uint32_t supervoxel;
  };
  PointBuffer points;                           ///< padded for wide loads
  std::vector<std::uint32_t> sample_begin;      ///< by supervoxel, one more than supervoxels
  std::vector<SupervoxelPlace> place;           ///< by supervoxel
  std::vector<std::uint32_t> supervoxel_begin;  ///< by instance, one more than instances
  std::vector<Streak> streaks;                  ///< all points of the scan that have a supervoxel

  std::size_t size() const { return sample_begin.empty() ? 0 : sample_begin.back(); }
  std::size_t supervoxel_count() const {
    return sample_begin.empty() ? 0 : sample_begin.size() - 1;
  }
  std::size_t instance_count() const {
    return supervoxel_begin.empty() ? 0 : supervoxel_begin.size() - 1;
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
    find_samples(points, instance_of, out);
    most_streaks_ = std::max(most_streaks_, out.streaks.size());
    order(points, instance_count, out);
  }

 private:
  struct Voxel {
    SupervoxelPlace place;
    std::uint32_t instance;
  };
  // Consecutive points in one voxel.
  struct Run {
    Voxel voxel;
    std::uint32_t begin, end;
  };
  struct Sample {
    std::uint32_t supervoxel;
    std::uint32_t point;
  };
  struct Supervoxel {
    Voxel voxel;
    std::uint32_t samples;
  };
  // Direct-mapped memory of the voxels met last, with their supervoxels. A voxel that was pushed
  // out and comes back gets a second sample, which does no harm; nothing is ever searched.
  struct Recent {
    SupervoxelPlace place = 0;
    std::uint32_t instance = kNoCluster;
    std::uint32_t supervoxel = 0;

    bool is(const Voxel& voxel) const { return place == voxel.place && instance == voxel.instance; }
  };
  static constexpr std::size_t kRecent = 1U << 14;
  // Runs are looked up in groups, so that the memory has time to answer.
  static constexpr std::size_t kRuns = 64;

  static std::size_t hash(const Voxel& voxel) {
    return detail::place_hash(voxel.place, voxel.instance) % kRecent;
  }

  // Beams that follow each other mostly end in the same voxel: eight points at a time are compared
  // with those before them, and only where the voxel changes does a run begin.
  void find_samples(PointsView points, Span<const std::uint32_t> instance_of,
                    InstanceSamples& out) {
    using namespace detail;
    recent_samples_.assign(kRecent, Recent());
    recent_supervoxels_.assign(kRecent, Recent());
    samples_.clear();
    supervoxels_.clear();
    out.streaks.clear();
    out.streaks.reserve(most_streaks_);
    const Constant8 per_metre(samples_per_metre_);
    const Constant8 far_squared(max_range_ * max_range_);
    // Each with the last one of the eight before in front.
    std::int32_t x[kLanes + 1] = {};
    std::int32_t y[kLanes + 1] = {};
    std::int32_t z[kLanes + 1] = {};
    std::int32_t instance[kLanes + 1] = {};
    unsigned is_open = 0;  // whether the point before belongs to the last run
    runs_ = 0;
    for_lanes(points.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      using Int = typename decltype(at)::Int;
      const std::size_t first = at.begin;
      std::memcpy(&instance[1], &instance_of[first], at.size() * sizeof(std::int32_t));
      const Float px = at.load(points.x.data());
      const Float py = at.load(points.y.data());
      const Int instances = Int::load(&instance[1]);
      const Int vx = floor(px * per_metre);
      const Int vy = floor(py * per_metre);
      const Int vz = floor(at.load(points.z.data()) * per_metre);
      vx.store(&x[1]);
      vy.store(&y[1]);
      vz.store(&z[1]);
      const Int none(static_cast<std::int32_t>(kNoCluster));
      const unsigned taken = ((px * px + py * py <= far_squared) & ~(instances == none)).bits() &
                             ((1U << at.size()) - 1);
      const unsigned same = ((vx == Int::load(x)) & (vy == Int::load(y)) & (vz == Int::load(z)) &
                             (instances == Int::load(instance)))
                                .bits();
      // Lanes whose point lies in the voxel of the point before, and lanes where that ends.
      const unsigned follows = taken & same & (taken << 1U | is_open);
      const unsigned ends = ~follows | 1U << kLanes;
      if ((follows & 1U) != 0) run_[runs_ - 1].end += count_zeros(ends);
      for (unsigned begins = taken & ends; begins != 0; begins &= begins - 1) {
        const std::uint32_t lane = count_zeros(begins);
        const auto begin = static_cast<std::uint32_t>(first) + lane;
        Run& run = run_[runs_++];
        run.voxel = {pack_place(x[lane + 1], y[lane + 1], z[lane + 1]),
                     static_cast<std::uint32_t>(instance[lane + 1])};
        run.begin = begin;
        run.end = begin + 1 + count_zeros(ends >> (lane + 1));
        __builtin_prefetch(&recent_samples_[hash(run.voxel)]);
      }
      if (runs_ > kRuns - kLanes) take_runs(1, out);
      is_open = taken >> (kLanes - 1);
      x[0] = x[kLanes];
      y[0] = y[kLanes];
      z[0] = z[kLanes];
      instance[0] = instance[kLanes];
    });
    take_runs(0, out);
  }

  static std::uint32_t count_zeros(unsigned bits) {
    return static_cast<std::uint32_t>(__builtin_ctz(bits));
  }

  // Streaks and samples from all runs but the last `left`, which may grow.
  void take_runs(std::size_t left, InstanceSamples& out) {
    for (std::size_t i = 0; i + left < runs_; ++i) {
      const Run& run = run_[i];
      const std::uint32_t supervoxel = find_voxel(run.voxel, run.begin);
      if (!out.streaks.empty() && out.streaks.back().end == run.begin &&
          out.streaks.back().supervoxel == supervoxel) {
        out.streaks.back().end = run.end;
      } else {
        out.streaks.push_back({run.begin, run.end, supervoxel});
      }
    }
    if (left < runs_)
      std::copy_n(run_.begin() + static_cast<std::ptrdiff_t>(runs_ - left), left, run_.begin());
    runs_ = std::min(runs_, left);
  }

  // Supervoxel of the voxel in which a point lies.
  std::uint32_t find_voxel(const Voxel& voxel, std::uint32_t point) {
    Recent& recent = recent_samples_[hash(voxel)];
    if (!recent.is(voxel)) {
      recent = {voxel.place, voxel.instance,
                find_supervoxel({supervoxel_place(voxel.place), voxel.instance})};
      ++supervoxels_[recent.supervoxel].samples;
      samples_.push_back({recent.supervoxel, point});
    }
    return recent.supervoxel;
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
    Recent& recent = recent_supervoxels_[hash(voxel)];
    if (!recent.is(voxel)) {
      recent = {voxel.place, voxel.instance, static_cast<std::uint32_t>(supervoxels_.size())};
      supervoxels_.push_back({voxel, 0});
    }
    return recent.supervoxel;
  }

  // Two counting sorts: supervoxels by instance, samples by supervoxel.
  void order(PointsView points, std::size_t instance_count, InstanceSamples& out) {
    out.supervoxel_begin.assign(instance_count + 1, 0);
    for (const Supervoxel& s : supervoxels_) ++out.supervoxel_begin[s.voxel.instance + 1];
    for (std::size_t i = 1; i <= instance_count; ++i) {
      out.supervoxel_begin[i] += out.supervoxel_begin[i - 1];
    }
    next_.assign(out.supervoxel_begin.begin(), out.supervoxel_begin.end());
    place_.resize(supervoxels_.size());
    out.place.resize(supervoxels_.size());
    out.sample_begin.assign(supervoxels_.size() + 1, 0);
    for (std::size_t s = 0; s < supervoxels_.size(); ++s) {
      place_[s] = next_[supervoxels_[s].voxel.instance]++;
      out.sample_begin[place_[s] + 1] = supervoxels_[s].samples;
      out.place[place_[s]] = supervoxels_[s].voxel.place;
    }
    for (std::size_t s = 1; s <= supervoxels_.size(); ++s) {
      out.sample_begin[s] += out.sample_begin[s - 1];
    }
    for (InstanceSamples::Streak& streak : out.streaks) {
      streak.supervoxel = place_[streak.supervoxel];
    }
    out.points.grow(samples_.size() + detail::kLanes);
    next_.assign(out.sample_begin.begin(), out.sample_begin.end());
    for (const Sample& sample : samples_) {
      const std::uint32_t to = next_[place_[sample.supervoxel]]++;
      out.points.x[to] = points.x[sample.point];
      out.points.y[to] = points.y[sample.point];
      out.points.z[to] = points.z[sample.point];
    }
  }

  float samples_per_metre_;
  float supervoxels_per_voxel_;
  float max_range_;
  std::size_t most_streaks_ = 0;
  std::array<Run, kRuns> run_;
  std::size_t runs_ = 0;
  std::vector<Recent> recent_samples_;
  std::vector<Recent> recent_supervoxels_;
  std::vector<Sample> samples_;
  std::vector<Supervoxel> supervoxels_;
  std::vector<std::uint32_t> place_;
  std::vector<std::uint32_t> next_;
};

}  // namespace dynains
