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
#include <numeric>
#include <optional>
#include <vector>

#include "dynains/ground/concentric_zones.hpp"
#include "dynains/ground/ground_config.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/plane_fit.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Points p with normal . (p - origin) < offset (m). The origin must be near the points, to keep
/// floats accurate.
struct HalfSpace {
  /// The points less than `distance` above the origin.
  HalfSpace(float origin_x, float origin_y, float origin_z, float distance)
      : x0(origin_x), y0(origin_y), z0(origin_z), offset(distance) {}

  /// Sets it to the points less than `distance` above a plane, which is relative to the origin.
  void set_below(const Plane& plane, double distance) {
    x = static_cast<float>(plane.normal_x);
    y = static_cast<float>(plane.normal_y);
    z = static_cast<float>(plane.normal_z);
    offset = static_cast<float>(distance + plane.normal_x * plane.mean_x +
                                plane.normal_y * plane.mean_y + plane.normal_z * plane.mean_z);
  }

  /// `local`: coordinates relative to the origin.
  template <class Float>
  auto contains(const std::array<Float, 3>& local) const {
    return x * local[0] + y * local[1] + z * local[2] < offset;
  }

  /// The points of a slice, relative to the origin; then points outside of all half spaces below
  /// a plane.
  template <class Slice>
  auto local(const Slice& at, PointsView points) const {
    using Float = typename Slice::Float;
    const Float infinity(std::numeric_limits<float>::infinity());
    return std::array<Float, 3>{at.load(points.x.data()) - x0, at.load(points.y.data()) - y0,
                                at.padded(at.load(points.z.data()) - z0, infinity)};
  }

  PackConstant x0, y0, z0;                    // origin
  PackConstant x = 0.0F, y = 0.0F, z = 1.0F;  // normal
  PackConstant offset;
};

/// Moments of the points in a half space, relative to its origin. For use within with_packs.
template <class Packs>
PlaneMoments moments_within(const HalfSpace& space, PointsView points) {
  static constexpr PackConstant kZero(0.0F), kOne(1.0F);
  using Float = typename Packs::Float;
  Float n = kZero, sx = kZero, sy = kZero, sz = kZero, sxx = kZero, sxy = kZero, sxz = kZero,
        syy = kZero, syz = kZero, szz = kZero;
  for_slices<Packs>(points.size(), [&](const auto& at) {
    const std::array<Float, 3> p = space.local(at, points);
    const auto member = space.contains(p);
    const Float x = keep(member, p[0]);
    const Float y = keep(member, p[1]);
    const Float z = keep(member, p[2]);
    n = n + keep(member, Float(kOne));
    sx = sx + x;
    sy = sy + y;
    sz = sz + z;
    sxx = sxx + x * x;
    sxy = sxy + x * y;
    sxz = sxz + x * z;
    syy = syy + y * y;
    syz = syz + y * z;
    szz = szz + z * z;
  });
  return {sum(n),   sum(sx),  sum(sy),  sum(sz),  sum(sxx),
          sum(sxy), sum(sxz), sum(syy), sum(syz), sum(szz)};
}

/// Mean of the `wanted` lowest values that are at least `floor`: of all if there are fewer, and
/// `floor` if there are none. `kept`: working memory.
inline float mean_of_lowest(Span<const float> values, std::size_t wanted, float floor,
                            std::vector<float>& kept) {
  grow(kept, values.size());
  const auto last = std::copy_if(values.begin(), values.end(), kept.begin(),
                                 [floor](float value) { return value >= floor; });
  const auto count = std::min(static_cast<std::ptrdiff_t>(wanted), last - kept.begin());
  if (count == 0) return floor;
  const auto end = kept.begin() + count;
  std::nth_element(kept.begin(), end, last);
  std::sort(kept.begin(), end);
  return std::accumulate(kept.begin(), end, 0.0F) / static_cast<float>(count);
}

}  // namespace dynains::detail

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
  /// ground. Points below `noise_depth` lie behind the last point of `split`. The ground points of
  /// `split` are ordered by patch, then as in the scan, and so are the others; only where a patch
  /// turned out not to be ground, its ground points follow its others.
  void segment(PointsView scan, Span<const std::uint32_t> input, GroundSplit& split) {
    detail::grow(patch_of_, scan.size() + detail::kPackWidth);
    zones_.find_patches(scan, patch_of_.data());
    if (config_.noise_depth > 0.0) find_noise(scan);
    sort(scan.size());
    heights_.fill(kNoGround);
    for (std::size_t p = 0; p < kPatches; ++p) segment_patch(scan, p);
    if (config_.ground_step > 0.0) take_back_overhangs();
    split.resize(scan.size());
    std::size_t count = 0;
    const auto write = [&](std::size_t begin, std::size_t end) {
      for (std::size_t at = begin; at < end; ++at, ++count) {
        const std::size_t i = order_[at];
        split.points.x[count] = scan.x[i];
        split.points.y[count] = scan.y[i];
        split.points.z[count] = scan.z[i];
        split.input[count] = input[i];
      }
    };
    for (std::size_t p = 0; p < kPatches; ++p) write(ground_begin_[p], begin_[p + 1]);
    split.ground_count = count;
    for (std::size_t p = 0; p < kPatches; ++p) write(begin_[p], ground_begin_[p]);
    write(begin_[kPatches], begin_[kNoise]);
    split.count = count;
    write(begin_[kNoise], scan.size());
  }

 private:
  static constexpr std::size_t kPatches = detail::ConcentricZones::kPatches;
  static constexpr std::size_t kNoise = kPatches + 1;  // points below `noise_depth`
  static constexpr float kNoGround = std::numeric_limits<float>::quiet_NaN();

  // Counting sort by patch; the points of a patch keep the order of the scan.
  void sort(std::size_t count) {
    detail::grow(order_, count);
    begin_.fill(0);
    for (std::size_t i = 0; i < count; ++i) ++begin_[patch(i) + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    next_ = begin_;
    for (std::size_t i = 0; i < count; ++i) {
      order_[next_[patch(i)]++] = static_cast<std::uint32_t>(i);
    }
  }
  std::size_t patch(std::size_t point) const { return static_cast<std::size_t>(patch_of_[point]); }

  void find_noise(PointsView scan) {
    const auto lowest = static_cast<float>(-config_.noise_depth * height_);
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (scan.z[i] < lowest) patch_of_[i] = static_cast<std::int32_t>(kNoise);
    }
  }

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

  // Ground that overhangs is none. Not in the outermost zone, where a slope of a few percent is a
  // step from ring to ring.
  void take_back_overhangs() {
    using Zones = detail::ConcentricZones;
    const std::int32_t outermost = Zones::kRings.back() * Zones::kSectors.back();
    for (std::size_t p = 0; p < kPatches - static_cast<std::size_t>(outermost); ++p) {
      if (overhangs(p)) ground_begin_[p] = begin_[p + 1];
    }
  }

  // Orders the points of a patch: its ground last.
  void segment_patch(PointsView scan, std::size_t patch) {
    const std::size_t end = begin_[patch + 1];
    const std::size_t size = end - begin_[patch];
    ground_begin_[patch] = end;
    if (size < static_cast<std::size_t>(config_.ground_min_points)) return;
    std::uint32_t* const order = order_.data() + begin_[patch];
    patch_.grow(size);
    for (std::size_t k = 0; k < size; ++k) {
      patch_.x[k] = scan.x[order[k]];
      patch_.y[k] = scan.y[order[k]];
      patch_.z[k] = scan.z[order[k]];
    }
    const PointsView points = PointsView(patch_).subview(0, size);
    const std::optional<detail::HalfSpace> below = find_ground(patch, points);
    if (!below) return;
    detail::grow(ground_, size);
    std::size_t rest = 0;
    std::size_t ground = 0;
    detail::with_packs([&](auto packs) {
      detail::for_slices<decltype(packs)>(size, [&](const auto& at) {
        const unsigned is_ground = below->contains(below->local(at, points)).bits();
        for (std::size_t k = 0; k < at.size(); ++k) {
          const std::uint32_t point = order[at.begin + k];
          order[rest] = point;
          ground_[ground] = point;
          (is_ground >> k & 1U) != 0 ? ++ground : ++rest;
        }
      });
    });
    std::copy_n(ground_.data(), ground, order + rest);
    ground_begin_[patch] = end - ground;
  }

  // The half space of the ground points of a patch, if it has ground.
  std::optional<detail::HalfSpace> find_ground(std::size_t patch, PointsView all) {
    const PointsView points = sample_of(all);
    const float seed_height =
        detail::mean_of_lowest(points.z, static_cast<std::size_t>(config_.ground_lowest_points),
                               floor_of(patch), heights_of_points_);
    detail::HalfSpace below(points.x[0], points.y[0], seed_height,
                            static_cast<float>(config_.ground_seed_margin));
    if (!fit_ground(patch, points, seed_height, below)) return std::nullopt;
    return below;
  }

  // All points of a patch, or at most `ground_fit_points`, in runs of eight that are spread evenly.
  PointsView sample_of(PointsView points) {
    constexpr std::size_t kRun = 8;
    const auto most = static_cast<std::size_t>(config_.ground_fit_points);
    if (points.size() <= most) return points;
    const std::size_t runs = most / kRun;
    sample_.resize(runs * kRun);
    for (std::size_t run = 0; run < runs; ++run) {
      const std::size_t begin = run * points.size() / runs;
      std::copy_n(points.x.data() + begin, kRun, sample_.x.data() + run * kRun);
      std::copy_n(points.y.data() + begin, kRun, sample_.y.data() + run * kRun);
      std::copy_n(points.z.data() + begin, kRun, sample_.z.data() + run * kRun);
    }
    return sample_;
  }

  // Height (m, sensor frame) below which points of the patch are noise.
  float floor_of(std::size_t patch) const {
    const bool is_in_first_zone =
        zones_.ring(patch) < static_cast<std::size_t>(detail::ConcentricZones::kRings.front());
    return is_in_first_zone ? static_cast<float>(-(1.0 + config_.ground_below) * height_)
                            : -std::numeric_limits<float>::infinity();
  }

  // Iterates from the half space below the seed height to the one below the plane. Returns whether
  // its points are ground.
  bool fit_ground(std::size_t patch, PointsView points, float seed_height,
                  detail::HalfSpace& below) {
    detail::Plane plane;
    for (int i = 0; i < config_.ground_iterations; ++i) {
      detail::PlaneMoments moments;
      detail::with_packs(
          [&](auto packs) { moments = detail::moments_within<decltype(packs)>(below, points); });
      if (moments.count < 3.0) return false;
      plane = detail::fit_plane(moments);
      below.set_below(plane, config_.ground_distance);
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
  double height_ = 0.0;                                     // m, sensor over the ground
  std::vector<std::int32_t> patch_of_;                      // by point
  std::vector<std::uint32_t> order_;                        // the points of a scan, by patch
  std::array<std::size_t, kPatches + 3> begin_{}, next_{};  // in order_: of each patch
  std::array<std::size_t, kPatches> ground_begin_{};        // in order_: of the ground of a patch
  PointBuffer patch_, sample_;                              // of the current patch
  std::vector<std::uint32_t> ground_;                       // of the current patch
  std::vector<float> heights_of_points_;                    // m, of the current patch
  std::array<float, kPatches + 1> heights_{};               // m, ground of each patch; last: none
};

}  // namespace dynains
