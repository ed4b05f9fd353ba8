// Few points that stand for many: samples of the instances of one scan, grouped in supervoxels.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/detail/cell_memory.hpp"
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

/// Its place along z, up to a constant.
inline std::int32_t layer_of(SupervoxelPlace place) {
  return static_cast<std::int32_t>(place & ((std::uint64_t{1} << 21) - 1));
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

/// Takes one sample per voxel and instance, up to some per supervoxel.
class InstanceSampler {
 public:
  /// `sample_size`, `supervoxel_size`, `max_range`: metres; a supervoxel is a whole number of
  /// sample voxels wide and has at most `most_samples`, 1 to 64: voxels of wider ones than four
  /// share their place among the parts of CellMemory.
  InstanceSampler(double sample_size, double supervoxel_size, double max_range,
                  std::uint32_t most_samples)
      : samples_per_metre_(static_cast<float>(1.0 / sample_size)),
        voxels_per_supervoxel_(
            static_cast<float>(std::max(1.0, std::round(supervoxel_size / sample_size)))),
        max_range_(static_cast<float>(max_range)),
        most_samples_(most_samples) {}

  /// Which of up to 64 points, a bit each, lie in another voxel than their predecessor; the first
  /// does.
  std::uint64_t find_changes(PointsView points) const {
    using namespace detail;
    const Constant8 per_metre(samples_per_metre_);
    std::array<std::array<std::int32_t, kBlock + kLanes>, 3> voxel;
    std::uint64_t changes = 0;
    run_lanes([&](auto lanes) {
      using Lanes = decltype(lanes);
      using Int = typename Lanes::Int;
      for_places<Lanes>(points.size(), [&](const auto& at) {
        floor(at.load(points.x.data()) * per_metre).store(&voxel[0][at.begin + 1]);
        floor(at.load(points.y.data()) * per_metre).store(&voxel[1][at.begin + 1]);
        floor(at.load(points.z.data()) * per_metre).store(&voxel[2][at.begin + 1]);
      });
      for (auto& line : voxel) line[0] = 0;
      for (std::size_t i = 0; i < points.size(); i += kLanes) {
        const auto same = same_as_next<Int>(&voxel[0][i]) & same_as_next<Int>(&voxel[1][i]) &
                          same_as_next<Int>(&voxel[2][i]);
        changes |= std::uint64_t{(~same).bits()} << i;
      }
    });
    return changes | 1;
  }

  /// `points`: one scan, sensor frame; `instance_of`: its instances below `instance_count`, or
  /// kNoCluster. Points beyond the range and without instance get no sample.
  void sample(PointsView points, Span<const std::uint32_t> instance_of, std::size_t instance_count,
              InstanceSamples& out) {
    begin_scan();
    detail::make_room(out.met_of, points.size());
    out.met_of.resize(points.size());
    for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
      const PointsView block = points.subview(begin, std::min(kBlock, points.size() - begin));
      find_supervoxels(block, instance_of.data() + begin);
      take_samples(block, out.met_of.data() + begin);
    }
    order(instance_count, out);
  }

 private:
  struct Sample {
    float x, y, z;
    std::uint32_t met;  // its supervoxel, as InstanceSamples::met_of counts them
  };
  // Number 0 stands for none.
  struct Supervoxel {
    std::int32_t xy, z, instance;  // as CellBlock has them
    std::uint32_t samples;
  };
  static constexpr std::size_t kBlock = 64;  // points that are worked off together

  // Points come in the order of small patches, so that little has to be remembered: a supervoxel
  // that was forgotten and comes back counts as another, which does no harm.
  void begin_scan() {
    memory_.clear();
    sample_count_ = 0;
    supervoxel_count_ = 1;
  }

  // The supervoxel of each point, and which of its voxels the point lies in.
  void find_supervoxels(PointsView points, const std::uint32_t* instance_of) {
    using namespace detail;
    const Constant8 per_metre(samples_per_metre_), per_voxel(1.0F / voxels_per_supervoxel_);
    const Constant8 voxels(voxels_per_supervoxel_), far_squared(max_range_ * max_range_);
    // The half keeps the quotient so far from whole numbers that the product of floats rounds to
    // the right side for all indices below 2^20.
    static constexpr Constant8 kCentre(0.5F);
    for_lanes(points.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      using Int = typename decltype(at)::Int;
      const Float px = at.load(points.x.data());
      const Float py = at.load(points.y.data());
      const Float pz = at.load(points.z.data());
      const Int instance = at.load(instance_of);
      const auto is_sampled = (px * px + py * py <= far_squared) &
                              ~(instance == Int(static_cast<std::int32_t>(kNoCluster)));
      const auto split = [&](const Float& coordinate, Int& place) {
        const Float voxel = to_float(floor(coordinate * per_metre));
        place = floor((voxel + Float(kCentre)) * Float(per_voxel));
        return truncate(voxel - to_float(place) * voxels) & Int(CellMemory::kParts - 1);
      };
      Int x, y, z;
      const Int part_x = split(px, x);
      const Int part_y = split(py, y);
      const Int part_z = split(pz, z);
      const Int part =
          part_x + (part_y << CellMemory::kPartBits) + (part_z << 2 * CellMemory::kPartBits);
      CellMemory::put(is_sampled, x, y, z, instance, part, at.begin, cells_);
    });
  }

  // The first point of each voxel, of supervoxels that have room. Most points are of voxels that
  // are remembered.
  void take_samples(PointsView points, std::uint32_t* met_of) {
    detail::grow(samples_, sample_count_ + kBlock);
    detail::grow(supervoxels_, supervoxel_count_ + kBlock);
    for (std::size_t i = 0; i < points.size(); ++i) {
      detail::CellMemory::Entry& entry = memory_.at(cells_, i);
      const bool known = !entry.is_other(cells_, i) && entry.has_part(cells_, i);
      met_of[i] = known ? entry.number : take_sample(points, i, entry);
    }
  }

  // Returns its supervoxel. `entry`: where its cell is remembered, or will be.
  std::uint32_t take_sample(PointsView points, std::size_t i, detail::CellMemory::Entry& entry) {
    if (entry.is_other(cells_, i)) {
      supervoxels_[supervoxel_count_] = {cells_.xy[i], cells_.z[i], cells_.instance[i], 0};
      entry = {cells_.xy[i], cells_.z[i], cells_.instance[i], supervoxel_count_++, 0};
    }
    const std::uint32_t met = entry.number;
    samples_[sample_count_++] = {points.x[i], points.y[i], points.z[i], met};
    entry.parts |= std::uint64_t{1} << static_cast<unsigned>(cells_.part[i]);
    if (++supervoxels_[met].samples >= most_samples_) entry.parts = detail::CellMemory::kAllParts;
    return met;
  }

  static SupervoxelPlace place_of(const Supervoxel& cell) {
    return pack_place(cell.xy >> detail::CellMemory::kHalf, static_cast<std::int16_t>(cell.xy),
                      cell.z);
  }

  // Two counting sorts: supervoxels by instance, samples by supervoxel.
  void order(std::size_t instance_count, InstanceSamples& out) {
    const std::size_t supervoxel_count = supervoxel_count_ - 1;
    const std::size_t sample_count = sample_count_;
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
    out.sample_begin.assign(supervoxel_count + 1, 0);
    for (std::size_t met = 1; met <= supervoxel_count; ++met) {
      const Supervoxel& supervoxel = supervoxels_[met];
      const auto instance = static_cast<std::uint32_t>(supervoxel.instance);
      const std::uint32_t to = next_[instance]++;
      out.met[met] = to;
      out.sample_begin[to + 1] = supervoxel.samples;
      out.place[to] = place_of(supervoxel);
      out.instance_of[to] = instance;
    }
    for (std::size_t s = 1; s <= supervoxel_count; ++s) {
      out.sample_begin[s] += out.sample_begin[s - 1];
    }
    out.points.grow(sample_count + detail::kLanes);
    out.supervoxel_of.resize(sample_count);
    next_.assign(out.sample_begin.begin(), out.sample_begin.end());
    for (std::size_t i = 0; i < sample_count; ++i) {
      const Sample& sample = samples_[i];
      const std::uint32_t supervoxel = out.met[sample.met];
      const std::uint32_t to = next_[supervoxel]++;
      out.supervoxel_of[to] = supervoxel;
      out.points.x[to] = sample.x;
      out.points.y[to] = sample.y;
      out.points.z[to] = sample.z;
    }
  }

  float samples_per_metre_;
  float voxels_per_supervoxel_;
  float max_range_;
  std::uint32_t most_samples_;
  detail::CellMemory memory_;             // of supervoxels, numbered as met_of counts them
  detail::CellBlock<kBlock> cells_ = {};  // of the points of a block
  // Longer than what is in use.
  std::size_t sample_count_ = 0;
  std::vector<Sample> samples_;
  std::uint32_t supervoxel_count_ = 1;
  std::vector<Supervoxel> supervoxels_;
  std::vector<std::uint32_t> next_;
};

}  // namespace dynains
