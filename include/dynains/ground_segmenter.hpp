// Ground segmentation by concentric zones (Patchwork, Lim et al., RA-L 2021), the "off-the-shelf
// ground segmentation" of the paper: the plane is divided into rings and sectors, each patch gets
// its own plane, and a patch whose plane is steep, high or rough is not ground. Beyond Patchwork,
// neither is one that lies far over the patches around it: the side of a truck, seen by one beam.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "dynains/ground/half_space.hpp"
#include "dynains/ground/lowest_mean.hpp"
#include "dynains/ground/patch_heights.hpp"
#include "dynains/ground/patch_sample.hpp"
#include "dynains/ground/patch_sort.hpp"
#include "dynains/ground/point_record.hpp"
#include "dynains/ground/zone_table.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/plane_fit.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/arc_tangent.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/capacity.hpp"
#include "dynains/simd/lanes.hpp"
#include "dynains/simd/wide_lanes.hpp"
#include "dynains/stage/ground_config.hpp"
#include "dynains/stage/ground_split.hpp"

namespace dynains {

/// Splits a scan into ground and the rest.
class GroundSegmenter {
 public:
  using Config = GroundConfig;

  static constexpr std::size_t kZones = detail::kZoneCount;
  /// Rings and sectors of each zone, from the inside out (Patchwork).
  static constexpr std::array<std::int32_t, kZones> kRings = {2, 4, 4, 4};
  static constexpr std::array<std::int32_t, kZones> kSectors = {16, 32, 54, 32};
  static constexpr std::size_t kPatches = 2 * 16 + 4 * 32 + 4 * 54 + 4 * 32;
  static constexpr std::size_t kCheckedRings = GroundConfig::kCheckedRings;
  /// Patches that are compared with those around them: all but those of the outermost zone, where a
  /// slope of a few percent is a step from ring to ring.
  static constexpr std::size_t kSteppedPatches =
      kPatches - static_cast<std::size_t>(kRings.back() * kSectors.back());

  GroundSegmenter() : GroundSegmenter(Config()) {}

  /// Throws ConfigError.
  explicit GroundSegmenter(const Config& config) : config_((config.validate(), config)) {
    adapt(SensorModel::typical());
    const double inner = config_.ground_min_range;
    const double outer = config_.ground_max_range;
    // Zone edges as in Patchwork: at 1/8, 1/4 and 1/2 of the way.
    const std::array<double, kZones + 1> edges = {
        inner, (7 * inner + outer) / 8, (3 * inner + outer) / 4, (inner + outer) / 2, outer};
    std::int32_t first_patch = 0;
    std::int32_t first_ring = 0;
    for (std::size_t i = 0; i < kZones; ++i) {
      zones_[i] = {static_cast<float>(edges[i]),
                   static_cast<float>(kRings[i] / (edges[i + 1] - edges[i])),
                   static_cast<float>(kSectors[i] / (2.0 * M_PI)),
                   static_cast<float>(first_patch),
                   static_cast<float>(kRings[i] - 1),
                   static_cast<float>(kSectors[i])};
      for (std::int32_t p = 0; p < kRings[i] * kSectors[i]; ++p) {
        const auto patch = static_cast<std::size_t>(first_patch) + static_cast<std::size_t>(p);
        ring_of_patch_[patch] = first_ring + p / kSectors[i];
      }
      first_patch += kRings[i] * kSectors[i];
      first_ring += kRings[i];
    }
  }

  const Config& config() const { return config_; }

  /// Whether the height of the sensor was left to be found in the scans.
  bool needs_sensor() const { return config_.sensor_height == 0.0; }

  /// Takes the sensor's height unless it was given; that of a typical sensor until then.
  void adapt(const SensorModel& sensor) {
    height_ = config_.sensor_height > 0.0 ? config_.sensor_height : sensor.height;
  }

  /// Splits `scan` (metres, sensor frame, z up, finite coordinates). `input` numbers its points and
  /// is handed on with them. Points outside the rings and points of sparse patches are not ground.
  /// Order within `split` is by patch, then as scanned; but where a patch turned out not to be
  /// ground, the last of the ground take its place.
  void segment(PointsView scan, Span<const std::uint32_t> input, GroundSplit& split) {
    detail::grow(patch_of_, scan.size() + detail::kMaxPackWidth);
    find_patches(scan);
    sorted_.sort(scan, input.data(), patch_of_.data());
    sample_.reserve(std::min(scan.size(), static_cast<std::size_t>(config_.ground_fit_points)));
    heights_.clear();
    split.resize(scan.size());
    detail::run_max_packs([&](auto packs) {
      using Packs = decltype(packs);
      Output<Packs> out(split);
      // By patch: where its ground begins in the split, and how many points are left of it.
      PatchCounts begin{};
      PatchCounts rest{};
      for (std::size_t p = 0; p < kPatches; ++p) {
        begin[p] = out.count();
        rest[p] = segment_patch(p, sorted_.records() + sorted_.begin(p), size_of(p), out);
      }
      begin[kPatches] = out.count();
      rest[kPatches] = size_of(kPatches);
      if (config_.ground_step > 0.0) take_back_hanging(begin, rest, out);
      split.ground_count = out.count();
      for (std::size_t p = 0; p <= kPatches; ++p) {
        out.put(sorted_.records() + sorted_.begin(p), rest[p]);
      }
    });
  }

 private:
  // Constants of a zone; small whole numbers are exact in floats.
  struct Zone {
    float inner;  // m
    float rings_per_metre;
    float sectors_per_radian;
    float first_patch;
    float last_ring;
    float sectors;
  };

  // Writes points to the split, one behind the other.
  template <class Packs>
  class Output {
   public:
    using Columns = std::array<typename Packs::Float, 4>;

    explicit Output(GroundSplit& split)
        : x_(split.points.x.data()),
          y_(split.points.y.data()),
          z_(split.points.z.data()),
          input_(split.input.data()) {}

    std::size_t count() const { return count_; }

    // The first ones of as many points as there are lanes.
    void put(const Columns& points, std::size_t count) {
      store(points, count_);
      count_ += count;
    }

    void put(const detail::PointRecord* from, std::size_t count) {
      for (std::size_t i = 0; i < count; i += Packs::kCount) {
        store(detail::load_columns<Packs>(from + i), count_ + i);
      }
      count_ += count;
    }

    // The points from `begin` on; the last ones take their place.
    void take_back(std::size_t begin, std::size_t count, detail::PointRecord* to) {
      for (std::size_t i = begin; i < begin + count; ++i) {
        to[i - begin] = {x_[i], y_[i], z_[i], input_[i]};
      }
      const std::size_t moved = std::min(count, count_ - (begin + count));
      for (float* const values : {x_, y_, z_}) {
        std::copy_n(values + count_ - moved, moved, values + begin);
      }
      std::copy_n(input_ + count_ - moved, moved, input_ + begin);
      count_ -= count;
    }

   private:
    void store(const Columns& points, std::size_t at) {
      points[0].store(x_ + at);
      points[1].store(y_ + at);
      points[2].store(z_ + at);
      points[3].store(reinterpret_cast<float*>(input_) + at);
    }

    std::size_t count_ = 0;
    float* const x_;
    float* const y_;
    float* const z_;
    std::uint32_t* const input_;
  };

  void find_patches(PointsView scan) {
    detail::run_max_packs([&](auto packs) {
      using Packs = decltype(packs);
      using Float = typename Packs::Float;
      using Int = typename Packs::Int;
      // Read once: the compiler cannot know that stores leave members alone.
      using detail::PackConstant;
      const auto of_zone = [&](float Zone::*constant) {
        return detail::ZoneTable(
            {zones_[0].*constant, zones_[1].*constant, zones_[2].*constant, zones_[3].*constant});
      };
      const detail::ZoneTable inner = of_zone(&Zone::inner);
      const detail::ZoneTable rings_per_metre = of_zone(&Zone::rings_per_metre);
      const detail::ZoneTable sectors_per_radian = of_zone(&Zone::sectors_per_radian);
      const detail::ZoneTable first_patch = of_zone(&Zone::first_patch);
      const detail::ZoneTable last_ring = of_zone(&Zone::last_ring);
      const detail::ZoneTable sector_count = of_zone(&Zone::sectors);
      const std::array<PackConstant, kZones - 1> edges = {zones_[1].inner, zones_[2].inner,
                                                          zones_[3].inner};
      const PackConstant nearest(static_cast<float>(config_.ground_min_range));
      const PackConstant farthest(static_cast<float>(config_.ground_max_range));
      const PackConstant pi(detail::kPi);
      const PackConstant one(1.0F);
      const float* const xs = scan.x.data();
      const float* const ys = scan.y.data();
      std::int32_t* const patches = patch_of_.data();
      detail::for_slices<Packs>(scan.size(), [&](auto at) {
        const Float x = at.load(xs);
        const Float y = at.load(ys);
        const Float range = sqrt(x * x + y * y);
        const Float azimuth = detail::azimuth_of(y, x, range) + pi;
        const detail::BeyondEdges<typename Packs::Mask> beyond = {
            range >= edges[0], range >= edges[1], range >= edges[2]};
        const auto here = [&](const detail::ZoneTable& table) { return table.at(beyond); };
        const auto whole = [](const Float& value) { return to_float(truncate(value)); };
        const Float ring = whole(
            min((min(range, farthest) - here(inner)) * here(rings_per_metre), here(last_ring)));
        const Float sectors = here(sector_count);
        const Float sector = whole(min(azimuth * here(sectors_per_radian), sectors - one));
        const Float patch = here(first_patch) + ring * sectors + sector;
        const auto inside = (range >= nearest) & (range <= farthest);
        select(inside, truncate(patch), Int(static_cast<std::int32_t>(kPatches)))
            .store(patches + at.begin);
      });
    });
  }

  using PatchCounts = std::array<std::size_t, kPatches + 1>;

  std::size_t size_of(std::size_t patch) const { return sorted_.end(patch) - sorted_.begin(patch); }

  // Ground that hangs goes back to the rest of its patch. From the last one on, so that what takes
  // the place of a patch is ground for good.
  template <class Packs>
  void take_back_hanging(const PatchCounts& begin, PatchCounts& rest, Output<Packs>& ground) {
    const auto step = static_cast<float>(config_.ground_step);
    for (std::size_t p = kSteppedPatches; p-- > 0;) {
      const std::size_t found = begin[p + 1] - begin[p];
      if (found == 0 || !heights_.hangs(p, step)) continue;
      ground.take_back(begin[p], found, sorted_.records() + sorted_.begin(p) + rest[p]);
      rest[p] += found;
    }
  }

  // Puts the ground of a patch; the rest closes up at its front. Returns the size of the rest.
  template <class Packs>
  std::size_t segment_patch(std::size_t patch, detail::PointRecord* records, std::size_t count,
                            Output<Packs>& ground) {
    if (count < static_cast<std::size_t>(config_.ground_min_points)) return count;
    const std::optional<detail::HalfSpace> ground_below = find_ground(patch, records, count);
    if (!ground_below) return count;
    const detail::HalfSpace& below = *ground_below;

    std::size_t rest = 0;
    for (std::size_t i = 0; i < count; i += Packs::kCount) {
      const std::size_t length = std::min(Packs::kCount, count - i);
      const unsigned all = (1U << length) - 1U;
      const auto points = detail::load_columns<Packs>(records + i);
      const std::array<typename Packs::Float, 3> local = {
          points[0] - below.x0, points[1] - below.y0, points[2] - below.z0};
      const unsigned bits = below.contains(local).bits() & all;
      if (bits == all) {
        ground.put(points, length);
      } else if (bits == 0) {
        detail::move_to_front(records + i, length, records + rest);
        rest += length;
      } else {
        ground.put(detail::pick<Packs>(records + i, bits, points), detail::count_ones(bits));
        rest += detail::move_some_to_front<Packs>(records + i, length, ~bits, records + rest);
      }
    }
    return rest;
  }

  // Where the ground of a patch lies, if it has any. A function of its own: within one for sixteen
  // lanes, the compiler may contract products and sums of single numbers if nobody forbids it.
  [[gnu::noinline]] std::optional<detail::HalfSpace> find_ground(std::size_t patch,
                                                                 const detail::PointRecord* records,
                                                                 std::size_t count) {
    std::optional<detail::HalfSpace> result;
    detail::run_packs([&](auto packs) {
      using Packs = decltype(packs);
      sample_.take<Packs>(records, count, static_cast<std::size_t>(config_.ground_fit_points));
      detail::LowestMean<GroundConfig::kMaxLowest, Packs> lowest(
          static_cast<std::size_t>(config_.ground_lowest_points));
      const float seed_height = lowest.of(sample_.heights(), sample_.size(), floor_of(patch));
      detail::HalfSpace below(records->x, records->y, seed_height,
                              static_cast<float>(config_.ground_seed_margin));
      if (fit_ground<Packs>(patch, seed_height, below)) result = below;
    });
    return result;
  }

  // Height below which points of the patch are noise.
  float floor_of(std::size_t patch) const {
    const bool innermost_zone = static_cast<std::int32_t>(patch) < kRings[0] * kSectors[0];
    return innermost_zone ? static_cast<float>(-(1.0 + config_.ground_below) * height_)
                          : -std::numeric_limits<float>::infinity();
  }

  // From the points near the seed height, a horizontal half space, to those near the plane. Returns
  // whether these are ground.
  template <class Packs>
  bool fit_ground(std::size_t patch, float seed_height, detail::HalfSpace& below) {
    detail::Plane plane;
    for (int i = 0; i < config_.ground_iterations; ++i) {
      const detail::PlaneMoments moments = sample_.moments<Packs>(below);
      if (moments.count < 3.0) return false;
      plane = detail::fit_plane(moments);
      below.end_above(plane, config_.ground_distance);
      // From the same points, the next plane would be the same.
      const bool had_all = moments.count == static_cast<double>(sample_.size());
      if (had_all && sample_.is_inside<Packs>(below)) break;
    }
    if (!is_ground(patch, plane, seed_height)) return false;
    heights_.set(patch, static_cast<float>(plane.mean_z + static_cast<double>(seed_height)));
    return true;
  }

  // Of a plane over the seed height; high ones must be flat near the sensor.
  bool is_ground(std::size_t patch, const detail::Plane& plane, float seed_height) const {
    if (plane.normal_z < config_.ground_uprightness) return false;
    const auto ring = static_cast<std::size_t>(ring_of_patch_[patch]);
    if (ring >= kCheckedRings) return true;
    const double elevation = plane.mean_z + static_cast<double>(seed_height) + height_;
    return !(elevation > config_.ground_elevation[ring] &&
             plane.flatness >= config_.ground_flatness[ring]);
  }

  Config config_;
  double height_ = 0.0;  // m
  std::array<Zone, kZones> zones_{};
  std::array<std::int32_t, kPatches> ring_of_patch_{};
  std::vector<std::int32_t> patch_of_;
  detail::PatchSort<kPatches + 1> sorted_;  // the last for points that are in no patch
  detail::PatchSample sample_;              // of the patch at hand
  detail::PatchHeights<kPatches> heights_{kRings, kSectors};
};

}  // namespace dynains
