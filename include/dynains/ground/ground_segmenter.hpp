// Ground segmentation by Patchwork (Lim et al., RA-L 2021), the "off-the-shelf ground segmentation"
// of the paper: the surroundings are divided into patches by rings and sectors, each patch gets its
// own plane, and a patch whose plane is steep, or high and rough, is not ground. Beyond Patchwork,
// a patch far above its neighbours is not ground either, like the side of a truck that one beam
// hits.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "dynains/ground/concentric_zones.hpp"
#include "dynains/ground/ground_config.hpp"
#include "dynains/ground/ground_split.hpp"
#include "dynains/ground/lowest_mean.hpp"
#include "dynains/ground/patch_sample.hpp"
#include "dynains/ground/patch_sort.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/plane_fit.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/simd/point_record.hpp"

namespace dynains {

/// Splits a scan into ground and other points.
class GroundSegmenter {
 public:
  using Config = GroundConfig;

  GroundSegmenter() : GroundSegmenter(Config()) {}

  /// Throws ConfigError.
  explicit GroundSegmenter(const Config& config)
      : config_((config.validate(), config)),
        zones_(config.ground_min_range, config.ground_max_range) {
    adapt(SensorModel::typical());
  }

  const Config& config() const { return config_; }

  /// Whether the height of the sensor is to be estimated from scans.
  bool needs_sensor() const { return config_.sensor_height == 0.0; }

  /// Sets the height of the sensor, unless the configuration gives it. Until then, it is the height
  /// of a typical sensor.
  void adapt(const SensorModel& sensor) {
    height_ = config_.sensor_height > 0.0 ? config_.sensor_height : sensor.height;
  }

  /// Splits `scan` (m, sensor frame, z up, finite coordinates). `input`: index of each point in the
  /// input of the remover. Points outside the rings and points of patches with few points are not
  /// ground. Points below `noise_depth` lie behind the last point of `split`. Points of `split` are
  /// ordered by patch, then as in the scan; only where a patch turned out not to be ground, the
  /// last ground points take its place.
  void segment(PointsView scan, Span<const std::uint32_t> input, GroundSplit& split) {
    detail::grow(patch_of_, scan.size() + detail::kMaxPackWidth);
    zones_.find_patches(scan, patch_of_.data());
    if (config_.noise_depth > 0.0) find_noise(scan);
    sorted_.sort(scan, input.data(), patch_of_.data());
    sample_.reserve(std::min(scan.size(), static_cast<std::size_t>(config_.ground_fit_points)));
    heights_.fill(kNoGround);
    split.resize(scan.size());
    detail::with_largest_packs([&](auto packs) {
      using Packs = decltype(packs);
      Output<Packs> out(split);
      // By patch: begin of its ground in the split, and number of its other points.
      PatchCounts begin{};
      PatchCounts rest{};
      for (std::size_t p = 0; p < kPatches; ++p) {
        begin[p] = out.count();
        rest[p] = segment_patch(p, sorted_.records() + sorted_.begin(p), size_of(p), out);
      }
      begin[kPatches] = out.count();
      rest[kPatches] = size_of(kPatches);
      if (config_.ground_step > 0.0) take_back_overhangs(begin, rest, out);
      split.ground_count = out.count();
      for (std::size_t p = 0; p <= kPatches; ++p) {
        out.put(sorted_.records() + sorted_.begin(p), rest[p]);
      }
      split.count = out.count();
      out.put(sorted_.records() + sorted_.begin(kNoise), size_of(kNoise));
    });
  }

 private:
  static constexpr std::size_t kPatches = detail::ConcentricZones::kPatches;
  static constexpr std::size_t kNoise = kPatches + 1;  // points below `noise_depth`
  static constexpr float kNoGround = std::numeric_limits<float>::quiet_NaN();
  using PatchCounts = std::array<std::size_t, kPatches + 1>;  // last: points in no patch

  // Appends points to the split.
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

    // The first `count` points of packs.
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

    // Moves `count` points from index `begin` on to `to`. The last points of the output take their
    // place.
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

  void find_noise(PointsView scan) {
    const auto lowest = static_cast<float>(-config_.noise_depth * height_);
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (scan.z[i] < lowest) patch_of_[i] = static_cast<std::int32_t>(kNoise);
    }
  }

  std::size_t size_of(std::size_t patch) const { return sorted_.end(patch) - sorted_.begin(patch); }

  // Whether the ground of a patch lies more than `ground_step` above that of most neighbours. False
  // if fewer than four neighbours have ground. On a slope, as many neighbours are higher as lower.
  bool overhangs(std::size_t patch) const {
    constexpr int kMinKnown = 4;
    const float limit = heights_[patch] - static_cast<float>(config_.ground_step);
    int known = 0;
    int lower = 0;
    for (const std::size_t other : zones_.neighbours(patch)) {
      known += std::isnan(heights_[other]) ? 0 : 1;
      lower += heights_[other] < limit ? 1 : 0;
    }
    return known >= kMinKnown && 2 * lower > known;
  }

  // Returns ground that overhangs to the other points of its patch. Not in the outermost zone,
  // where a slope of a few percent is a step from ring to ring. From the last patch to the first,
  // so that the points that take the place of a patch were checked before.
  template <class Packs>
  void take_back_overhangs(const PatchCounts& begin, PatchCounts& rest, Output<Packs>& ground) {
    using Zones = detail::ConcentricZones;
    constexpr int kOutermost = Zones::kRings.back() * Zones::kSectors.back();
    for (std::size_t p = kPatches - static_cast<std::size_t>(kOutermost); p-- > 0;) {
      const std::size_t found = begin[p + 1] - begin[p];
      if (found == 0 || !overhangs(p)) continue;
      ground.take_back(begin[p], found, sorted_.records() + sorted_.begin(p) + rest[p]);
      rest[p] += found;
    }
  }

  // Appends the ground of a patch to `ground` and moves its other points to the front of `records`.
  // Returns the number of the others.
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

  // The half space of the ground points of a patch, if it has ground. Not inlined: in a function
  // for AVX-512, the compiler may contract products and sums of single numbers.
  [[gnu::noinline]] std::optional<detail::HalfSpace> find_ground(std::size_t patch,
                                                                 const detail::PointRecord* records,
                                                                 std::size_t count) {
    std::optional<detail::HalfSpace> result;
    detail::with_packs([&](auto packs) {
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

  // Height (m, sensor frame) below which points of the patch are noise.
  float floor_of(std::size_t patch) const {
    constexpr std::size_t kFirstZoneRings = detail::ConcentricZones::kRings[0];
    const bool is_in_first_zone = zones_.ring(patch) < kFirstZoneRings;
    return is_in_first_zone ? static_cast<float>(-(1.0 + config_.ground_below) * height_)
                            : -std::numeric_limits<float>::infinity();
  }

  // Iterates from the half space below the seed height to the one below the plane. Returns whether
  // its points are ground.
  template <class Packs>
  bool fit_ground(std::size_t patch, float seed_height, detail::HalfSpace& below) {
    detail::Plane plane;
    for (int i = 0; i < config_.ground_iterations; ++i) {
      const detail::PlaneMoments moments = sample_.moments<Packs>(below);
      if (moments.count < 3.0) return false;
      plane = detail::fit_plane(moments);
      below.set_below(plane, config_.ground_distance);
      // If the points do not change, the plane does not either.
      const bool had_all = moments.count == static_cast<double>(sample_.size());
      if (had_all && sample_.is_inside<Packs>(below)) break;
    }
    if (!is_ground(patch, plane, seed_height)) return false;
    heights_[patch] = static_cast<float>(plane.mean_z + static_cast<double>(seed_height));
    return true;
  }

  // `plane`: relative to the seed height. Near the sensor, high patches must be flat.
  bool is_ground(std::size_t patch, const detail::Plane& plane, float seed_height) const {
    if (plane.normal_z < config_.ground_uprightness) return false;
    const std::size_t ring = zones_.ring(patch);
    if (ring >= GroundConfig::kCheckedRings) return true;
    const double elevation = plane.mean_z + static_cast<double>(seed_height) + height_;
    return !(elevation > config_.ground_elevation[ring] &&
             plane.flatness >= config_.ground_flatness[ring]);
  }

  Config config_;
  detail::ConcentricZones zones_;
  double height_ = 0.0;  // m, sensor over the ground
  std::vector<std::int32_t> patch_of_;
  detail::PatchSort<kPatches + 2> sorted_;
  detail::PatchSample sample_;                 // of the current patch
  std::array<float, kPatches + 1> heights_{};  // m, ground of each patch; last: none
};

}  // namespace dynains
