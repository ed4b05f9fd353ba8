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
      const std::size_t size = std::min(kBlock, points.size() - begin);
      find_voxels(points.subview(begin, size), instance_of.data() + begin);
      find_new_voxels(size, out.met_of.data() + begin);
      find_supervoxels();
      take_samples(points.subview(begin, size), out.met_of.data() + begin);
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
  using Block = detail::CellBlock<kBlock>;

  // Points come in the order of small patches, so that little has to be remembered: a voxel that
  // was forgotten and comes back gets a second sample, which does no harm.
  void begin_scan() {
    voxels_met_.clear();
    supervoxels_met_.clear();
    sample_count_ = 0;
    supervoxel_count_ = 1;
  }

  void find_voxels(PointsView points, const std::uint32_t* instance_of) {
    using namespace detail;
    const Constant8 per_metre(samples_per_metre_);
    const Constant8 far_squared(max_range_ * max_range_);
    for_lanes(points.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      using Int = typename decltype(at)::Int;
      const Float px = at.load(points.x.data());
      const Float py = at.load(points.y.data());
      const Float pz = at.load(points.z.data());
      const Int instance = at.load(instance_of);
      const auto is_sampled = (px * px + py * py <= far_squared) &
                              ~(instance == Int(static_cast<std::int32_t>(kNoCluster)));
      CellMemory::put(is_sampled, floor(px * per_metre), floor(py * per_metre),
                      floor(pz * per_metre), instance, at.begin, voxels_);
    });
  }

  // What `met_of` says of points whose voxels are remembered; the voxels of the others, in the
  // order of their first points. Until their supervoxels are known, they are remembered by number.
  void find_new_voxels(std::size_t size, std::uint32_t* met_of) {
    std::size_t unknown_count = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const detail::CellMemory::Entry& entry = voxels_met_.at(voxels_, i);
      met_of[i] = entry.number;
      unknown_[unknown_count] = static_cast<std::uint8_t>(i);
      unknown_count += entry.is_other(voxels_, i) ? 1 : 0;
    }
    std::uint32_t count = 0;
    for (std::size_t k = 0; k < unknown_count; ++k) {
      const std::size_t i = unknown_[k];
      detail::CellMemory::Entry& entry = voxels_met_.at(voxels_, i);
      if (entry.is_other(voxels_, i)) {
        entry = {voxels_.xy[i], voxels_.z[i], voxels_.instance[i], count};
        new_[count] = static_cast<std::uint8_t>(i);
        supervoxels_of_new_.xy[count] = entry.xy;
        supervoxels_of_new_.z[count] = entry.z;
        supervoxels_of_new_.instance[count] = entry.instance;
        ++count;
      }
      voxel_of_unknown_[k] = static_cast<std::uint8_t>(entry.number);
    }
    unknown_count_ = unknown_count;
    new_count_ = count;
  }

  void find_supervoxels() {
    using namespace detail;
    const Constant8 per_voxel(supervoxels_per_voxel_);
    run_lanes([&](auto lanes) {
      using Float = typename decltype(lanes)::Float;
      using Int = typename decltype(lanes)::Int;
      // The half keeps the quotient so far from whole numbers that the product of floats rounds to
      // the right side for all indices below 2^20.
      static constexpr Constant8 kCentre(0.5F);
      const auto supervoxel = [&](const Int& voxel) {
        return floor((to_float(voxel) + Float(kCentre)) * Float(per_voxel));
      };
      Block& cells = supervoxels_of_new_;
      for (std::size_t i = 0; i < new_count_; i += kLanes) {
        const Int xy = Int::load(&cells.xy[i]);
        const Int x = xy >> CellMemory::kHalf;
        const Int y = (xy << CellMemory::kHalf) >> CellMemory::kHalf;
        const Int instance = Int::load(&cells.instance[i]);
        CellMemory::put(~(instance == Int(-1)), supervoxel(x), supervoxel(y),
                        supervoxel(Int::load(&cells.z[i])), instance, i, cells);
      }
    });
  }

  // One of each new voxel. Of new voxels that share an entry, the last one stays there.
  void take_samples(PointsView points, std::uint32_t* met_of) {
    detail::grow(samples_, sample_count_ + kBlock);
    detail::grow(supervoxels_, supervoxel_count_ + kBlock);
    for (std::size_t k = 0; k < new_count_; ++k) {
      const std::size_t i = new_[k];
      const std::uint32_t met = number_of_supervoxel(k);
      detail::CellMemory::Entry& entry = voxels_met_.at(voxels_, i);
      if (!entry.is_other(voxels_, i)) entry.number = met;
      ++supervoxels_[met].samples;
      samples_[sample_count_++] = {points.x[i], points.y[i], points.z[i], met};
      met_of_new_[k] = met;
    }
    for (std::size_t k = 0; k < unknown_count_; ++k) {
      met_of[unknown_[k]] = met_of_new_[voxel_of_unknown_[k]];
    }
  }

  // Writes a new one in any case, since no branch could foretell whether it is one.
  std::uint32_t number_of_supervoxel(std::size_t k) {
    const Block& cells = supervoxels_of_new_;
    detail::CellMemory::Entry& entry = supervoxels_met_.at(cells, k);
    const bool is_new = entry.is_other(cells, k);
    const std::uint32_t next = supervoxel_count_;
    supervoxels_[next] = {cells.xy[k], cells.z[k], cells.instance[k], 0};
    supervoxel_count_ = next + (is_new ? 1 : 0);
    entry = {cells.xy[k], cells.z[k], cells.instance[k], is_new ? next : entry.number};
    return entry.number;
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
  float supervoxels_per_voxel_;
  float max_range_;
  detail::CellMemory voxels_met_;  // with their supervoxels, as met_of counts them
  detail::CellMemory supervoxels_met_;
  // Of a block: voxels of its points; which of these were not remembered, and which new voxel each
  // of the latter is; first points, supervoxels and their numbers of the new ones.
  Block voxels_ = {};
  std::size_t unknown_count_ = 0;
  std::array<std::uint8_t, kBlock> unknown_ = {};
  std::array<std::uint8_t, kBlock> voxel_of_unknown_ = {};
  std::size_t new_count_ = 0;
  std::array<std::uint8_t, kBlock> new_ = {};
  Block supervoxels_of_new_ = {};
  std::array<std::uint32_t, kBlock> met_of_new_ = {};
  // Longer than what is in use.
  std::size_t sample_count_ = 0;
  std::vector<Sample> samples_;
  std::uint32_t supervoxel_count_ = 1;
  std::vector<Supervoxel> supervoxels_;
  std::vector<std::uint32_t> next_;
};

}  // namespace dynains
