// Few points that stand for many: samples of the instances of one scan, grouped in supervoxels.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/detail/cell_hash.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Place of a supervoxel in its grid, packed: ordered by x, then y, then z.
using SupervoxelPlace = std::uint64_t;

inline SupervoxelPlace pack_place(std::int32_t x, std::int32_t y, std::int32_t z) {
  constexpr std::int64_t kOffset = std::int64_t{1} << 20;
  return static_cast<std::uint64_t>(x + kOffset) << 42 |
         static_cast<std::uint64_t>(y + kOffset) << 21 | static_cast<std::uint64_t>(z + kOffset);
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
        voxels_per_supervoxel_(
            std::max(1, static_cast<std::int32_t>(std::lround(supervoxel_size / sample_size)))),
        max_range_(static_cast<float>(max_range)) {}

  /// `points`: one scan, sensor frame; `instance_of`: its instances below `instance_count`, or
  /// kNoCluster. Points beyond the range and without instance get no sample.
  void sample(PointsView points, Span<const std::uint32_t> instance_of, std::size_t instance_count,
              InstanceSamples& out) {
    find_samples(points, instance_of, out);
    most_streaks_ = std::max(most_streaks_, out.streaks.size());
    order(instance_count, out);
  }

 private:
  struct Voxel {
    std::int32_t x, y, z;
    std::uint32_t instance;

    bool operator==(const Voxel& other) const {
      return x == other.x && y == other.y && z == other.z && instance == other.instance;
    }
  };
  struct Sample {
    Voxel voxel;
    float x, y, z;
    std::uint32_t supervoxel;
  };
  struct Supervoxel {
    Voxel voxel;
    std::uint32_t samples;
  };
  // Direct-mapped memory of the voxels met last: their numbers. A voxel that was pushed out and
  // comes back gets a second sample, which does no harm; nothing is ever searched.
  static constexpr std::size_t kRecent = 1U << 14;
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr unsigned kAllLanes = (1U << detail::kLanes) - 1;

  static std::size_t hash(const Voxel& voxel) {
    return detail::cell_hash(voxel.x, voxel.y, voxel.z, voxel.instance) % kRecent;
  }

  static std::int32_t floor_divide(std::int32_t a, std::int32_t b) {
    const std::int32_t quotient = a / b;
    return a % b < 0 ? quotient - 1 : quotient;
  }

  // Beams that follow each other mostly end in the same voxel: eight points at a time are compared
  // with those before them, and only where the voxel changes is it looked up.
  void find_samples(PointsView points, Span<const std::uint32_t> instance_of,
                    InstanceSamples& out) {
    using namespace detail;
    recent_samples_.assign(kRecent, kNone);
    recent_supervoxels_.assign(kRecent, kNone);
    samples_.clear();
    supervoxels_.clear();
    out.streaks.clear();
    out.streaks.reserve(most_streaks_);
    const Float8 per_metre(samples_per_metre_);
    const Float8 far_squared(max_range_ * max_range_);
    const Int8 none(static_cast<std::int32_t>(kNoCluster));
    // Each with the last one of the eight before in front.
    std::int32_t x[kLanes + 1] = {};
    std::int32_t y[kLanes + 1] = {};
    std::int32_t z[kLanes + 1] = {};
    std::int32_t instance[kLanes + 1] = {};
    std::uint32_t open = kNone;  // of the point before
    for_lanes(points, [&](Float8 px, Float8 py, Float8 pz, std::size_t first) {
      const std::size_t lanes = std::min(kLanes, points.size() - first);
      std::memcpy(&instance[1], &instance_of[first], lanes * sizeof(std::int32_t));
      const Int8 instances = Int8::load(&instance[1]);
      const Int8 vx = floor(px * per_metre);
      const Int8 vy = floor(py * per_metre);
      const Int8 vz = floor(pz * per_metre);
      vx.store(&x[1]);
      vy.store(&y[1]);
      vz.store(&z[1]);
      const unsigned taken = (first_lanes(lanes) & (px * px + py * py <= far_squared) &
                              ~(instances == none))
                                 .bits();
      const unsigned same = ((vx == Int8::load(x)) & (vy == Int8::load(y)) &
                             (vz == Int8::load(z)) & (instances == Int8::load(instance)))
                                .bits();
      const auto begin = static_cast<std::uint32_t>(first);
      if ((taken & same) == kAllLanes && open != kNone) {
        out.streaks.back().end += static_cast<std::uint32_t>(kLanes);
      } else if (taken == 0) {
        open = kNone;
      } else {
        for (std::uint32_t lane = 0; lane < lanes; ++lane) {
          if ((taken >> lane & 1U) == 0) {
            open = kNone;
            continue;
          }
          const std::uint32_t before = open;
          if (open == kNone || (same >> lane & 1U) == 0) {
            const std::size_t i = first + lane;
            const Voxel voxel = {x[lane + 1], y[lane + 1], z[lane + 1],
                                 static_cast<std::uint32_t>(instance[lane + 1])};
            open = find_voxel(voxel, points.x[i], points.y[i], points.z[i]);
          }
          if (open == before) {
            ++out.streaks.back().end;
          } else {
            out.streaks.push_back({begin + lane, begin + lane + 1, open});
          }
        }
      }
      x[0] = x[kLanes];
      y[0] = y[kLanes];
      z[0] = z[kLanes];
      instance[0] = instance[kLanes];
    });
  }

  // Supervoxel of a point.
  std::uint32_t find_voxel(const Voxel& voxel, float x, float y, float z) {
    std::uint32_t& recent = recent_samples_[hash(voxel)];
    if (recent == kNone || !(samples_[recent].voxel == voxel)) {
      recent = static_cast<std::uint32_t>(samples_.size());
      samples_.push_back({voxel, x, y, z, find_supervoxel(voxel)});
      ++supervoxels_[samples_.back().supervoxel].samples;
    }
    return samples_[recent].supervoxel;
  }

  std::uint32_t find_supervoxel(const Voxel& sample) {
    const Voxel voxel = {floor_divide(sample.x, voxels_per_supervoxel_),
                         floor_divide(sample.y, voxels_per_supervoxel_),
                         floor_divide(sample.z, voxels_per_supervoxel_), sample.instance};
    std::uint32_t& recent = recent_supervoxels_[hash(voxel)];
    if (recent == kNone || !(supervoxels_[recent].voxel == voxel)) {
      recent = static_cast<std::uint32_t>(supervoxels_.size());
      supervoxels_.push_back({voxel, 0});
    }
    return recent;
  }

  // Two counting sorts: supervoxels by instance, samples by supervoxel.
  void order(std::size_t instance_count, InstanceSamples& out) {
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
      const Voxel& voxel = supervoxels_[s].voxel;
      out.place[place_[s]] = pack_place(voxel.x, voxel.y, voxel.z);
    }
    for (std::size_t s = 1; s <= supervoxels_.size(); ++s) {
      out.sample_begin[s] += out.sample_begin[s - 1];
    }
    for (InstanceSamples::Streak& streak : out.streaks) {
      streak.supervoxel = place_[streak.supervoxel];
    }
    const std::size_t padded = samples_.size() + detail::kLanes;
    if (out.points.size() < padded) out.points.resize(padded);
    next_.assign(out.sample_begin.begin(), out.sample_begin.end());
    for (const Sample& sample : samples_) {
      const std::uint32_t to = next_[place_[sample.supervoxel]]++;
      out.points.x[to] = sample.x;
      out.points.y[to] = sample.y;
      out.points.z[to] = sample.z;
    }
  }

  float samples_per_metre_;
  std::int32_t voxels_per_supervoxel_;
  float max_range_;
  std::size_t most_streaks_ = 0;
  std::vector<std::uint32_t> recent_samples_;
  std::vector<std::uint32_t> recent_supervoxels_;
  std::vector<Sample> samples_;
  std::vector<Supervoxel> supervoxels_;
  std::vector<std::uint32_t> place_;
  std::vector<std::uint32_t> next_;
};

}  // namespace dynains
