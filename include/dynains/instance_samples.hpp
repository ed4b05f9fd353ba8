// Few points that stand for many: samples of the instances of one scan, grouped in supervoxels.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Supervoxel of points that were not sampled.
inline constexpr std::uint32_t kNoSupervoxel = 0xFFFFFFFFU;

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
  PointBuffer points;                           ///< padded for wide loads
  std::vector<std::uint32_t> sample_begin;      ///< by supervoxel, one more than supervoxels
  std::vector<SupervoxelPlace> place;           ///< by supervoxel
  std::vector<std::uint32_t> supervoxel_begin;  ///< by instance, one more than instances
  std::vector<std::uint32_t> supervoxel_of;     ///< by point of the scan, or kNoSupervoxel

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
    order(instance_count, out);
  }

 private:
  struct Sample {
    float x, y, z;
    std::uint32_t supervoxel;
  };
  struct Supervoxel {
    std::int32_t x, y, z;
    std::uint32_t instance;
    std::uint32_t samples;
  };
  // Direct-mapped memory of the voxels met last. A voxel that was pushed out and comes back gets a
  // second sample, which does no harm; nothing is ever searched.
  struct Recent {
    std::int32_t x, y, z;
    std::uint32_t instance;
    std::uint32_t supervoxel;
    std::uint32_t generation;
  };
  static constexpr std::size_t kRecent = 1U << 14;

  static std::size_t hash(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t instance) {
    std::uint64_t h = static_cast<std::uint32_t>(x);
    h = h * 0x9E3779B97F4A7C15ULL + static_cast<std::uint32_t>(y);
    h = h * 0x9E3779B97F4A7C15ULL + static_cast<std::uint32_t>(z);
    h = h * 0x9E3779B97F4A7C15ULL + instance;
    h *= 0x9E3779B97F4A7C15ULL;
    return static_cast<std::size_t>(h >> 40);
  }

  static std::int32_t floor_divide(std::int32_t a, std::int32_t b) {
    const std::int32_t quotient = a / b;
    return a % b < 0 ? quotient - 1 : quotient;
  }

  void find_samples(PointsView points, Span<const std::uint32_t> instance_of,
                    InstanceSamples& out) {
    recent_.resize(kRecent);
    table_.resize(kRecent);
    ++generation_;
    samples_.clear();
    supervoxels_.clear();
    out.supervoxel_of.resize(points.size());
    const float far_squared = max_range_ * max_range_;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float px = points.x[i];
      const float py = points.y[i];
      const std::uint32_t instance = instance_of[i];
      if (instance == kNoCluster || !(px * px + py * py <= far_squared)) {
        out.supervoxel_of[i] = kNoSupervoxel;
        continue;
      }
      const std::int32_t x = floor_to_int(px * samples_per_metre_);
      const std::int32_t y = floor_to_int(py * samples_per_metre_);
      const std::int32_t z = floor_to_int(points.z[i] * samples_per_metre_);
      Recent& recent = recent_[hash(x, y, z, instance) % kRecent];
      if (recent.generation != generation_ || recent.x != x || recent.y != y || recent.z != z ||
          recent.instance != instance) {
        recent = {x, y, z, instance, find_supervoxel(x, y, z, instance), generation_};
        ++supervoxels_[recent.supervoxel].samples;
        samples_.push_back({px, py, points.z[i], recent.supervoxel});
      }
      out.supervoxel_of[i] = recent.supervoxel;
    }
  }

  static std::int32_t floor_to_int(float value) {
    const auto whole = static_cast<std::int32_t>(value);
    return static_cast<float>(whole) > value ? whole - 1 : whole;
  }

  std::uint32_t find_supervoxel(std::int32_t x, std::int32_t y, std::int32_t z,
                                std::uint32_t instance) {
    x = floor_divide(x, voxels_per_supervoxel_);
    y = floor_divide(y, voxels_per_supervoxel_);
    z = floor_divide(z, voxels_per_supervoxel_);
    Recent& recent = table_[hash(x, y, z, instance) % kRecent];
    if (recent.generation != generation_ || recent.x != x || recent.y != y || recent.z != z ||
        recent.instance != instance) {
      recent = {x, y, z, instance, static_cast<std::uint32_t>(supervoxels_.size()), generation_};
      supervoxels_.push_back({x, y, z, instance, 0});
    }
    return recent.supervoxel;
  }

  // Two counting sorts: supervoxels by instance, samples by supervoxel.
  void order(std::size_t instance_count, InstanceSamples& out) {
    out.supervoxel_begin.assign(instance_count + 1, 0);
    for (const Supervoxel& s : supervoxels_) ++out.supervoxel_begin[s.instance + 1];
    for (std::size_t i = 1; i <= instance_count; ++i) {
      out.supervoxel_begin[i] += out.supervoxel_begin[i - 1];
    }
    next_.assign(out.supervoxel_begin.begin(), out.supervoxel_begin.end());
    place_.resize(supervoxels_.size());
    out.place.resize(supervoxels_.size());
    out.sample_begin.assign(supervoxels_.size() + 1, 0);
    for (std::size_t s = 0; s < supervoxels_.size(); ++s) {
      place_[s] = next_[supervoxels_[s].instance]++;
      out.sample_begin[place_[s] + 1] = supervoxels_[s].samples;
      out.place[place_[s]] = pack_place(supervoxels_[s].x, supervoxels_[s].y, supervoxels_[s].z);
    }
    for (std::size_t s = 1; s <= supervoxels_.size(); ++s) {
      out.sample_begin[s] += out.sample_begin[s - 1];
    }
    for (std::uint32_t& supervoxel : out.supervoxel_of) {
      if (supervoxel != kNoSupervoxel) supervoxel = place_[supervoxel];
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
  std::uint32_t generation_ = 0;
  std::vector<Recent> recent_;
  std::vector<Recent> table_;
  std::vector<Sample> samples_;
  std::vector<Supervoxel> supervoxels_;
  std::vector<std::uint32_t> place_;
  std::vector<std::uint32_t> next_;
};

}  // namespace dynains
