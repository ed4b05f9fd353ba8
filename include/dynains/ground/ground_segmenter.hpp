// Ground segmentation by Patchwork (Lim et al., RA-L 2021), the "off-the-shelf ground segmentation"
// of the paper: the surroundings are divided into patches by rings and sectors, each patch gets its
// own plane, and a patch whose plane is steep, or high and rough, is not ground. Beyond Patchwork,
// a patch far above its neighbours is not ground either, like the side of a truck that one beam
// hits.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "dynains/ground/concentric_zones.hpp"
#include "dynains/parameters.hpp"
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

  /// Eight points from index `i` on, relative to the origin.
  template <class Float>
  std::array<Float, 3> local(PointsView points, std::size_t i) const {
    return {Float::load(&points.x[i]) - x0, Float::load(&points.y[i]) - y0,
            Float::load(&points.z[i]) - z0};
  }

  PackConstant x0, y0, z0;                    // origin
  PackConstant x = 0.0F, y = 0.0F, z = 1.0F;  // normal
  PackConstant offset;
};

/// Moments of the points in a half space, relative to its origin. For use within with_packs.
/// `points`: ends with infinitely high ones up to a whole pack.
template <class Packs>
PlaneMoments moments_within(const HalfSpace& space, PointsView points) {
  static constexpr PackConstant kZero(0.0F), kOne(1.0F);
  using Float = typename Packs::Float;
  Float n = kZero, sx = kZero, sy = kZero, sz = kZero, sxx = kZero, sxy = kZero, sxz = kZero,
        syy = kZero, syz = kZero, szz = kZero;
  for (std::size_t i = 0; i < points.size(); i += Packs::kCount) {
    const std::array<Float, 3> p = space.local<Float>(points, i);
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
  }
  return {sum(n),   sum(sx),  sum(sy),  sum(sz),  sum(sxx),
          sum(sxy), sum(sxz), sum(syy), sum(syz), sum(szz)};
}

/// Mean of the `wanted` lowest finite values that are at least `floor`: of all if there are fewer,
/// and `floor` if there are none. `values`: of whole packs. `kept`: working memory.
template <class Packs>
float mean_of_lowest(Span<const float> values, std::size_t wanted, float floor,
                     std::vector<float>& kept) {
  using Float = typename Packs::Float;
  const Float infinity(std::numeric_limits<float>::infinity());
  const auto load = [&](std::size_t i) {
    const Float value = Float::load(&values[i]);
    return select(value >= Float(floor), value, infinity);
  };
  // The lowest values of as many parts as are wanted, at least, bound the wanted ones.
  const std::size_t parts = (wanted + Packs::kCount - 1) / Packs::kCount * Packs::kCount;
  grow(kept, values.size() + parts);
  for (std::size_t part = 0; part < parts; part += Packs::kCount) {
    Float lowest = infinity;
    for (std::size_t i = part; i < values.size(); i += parts) lowest = min(load(i), lowest);
    lowest.store(&kept[part]);
  }
  const auto begin = kept.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(wanted);
  std::nth_element(begin, end - 1, begin + static_cast<std::ptrdiff_t>(parts));
  const Float bound(kept[wanted - 1]);
  auto last = begin;
  for (std::size_t i = 0; i < values.size(); i += Packs::kCount) {
    const Float value = load(i);
    for_each_bit(((value <= bound) & (value < infinity)).bits(),
                 [&](std::size_t k) { *last++ = values[i + k]; });
  }
  if (last == begin) return floor;
  if (last > end) std::nth_element(begin, end, last);
  last = std::min(last, end);
  std::sort(begin, last);
  return std::accumulate(begin, last, 0.0F) / static_cast<float>(last - begin);
}

}  // namespace dynains::detail

namespace dynains {

/// Parameters of Patchwork, plus two additional ones: `ground_step` and `ground_fit_points`.
struct GroundConfig {
  /// Number of innermost rings in which the height and the flatness of a patch are checked.
  static constexpr std::size_t kCheckedRings = 4;

  double sensor_height = 0.0;         ///< m, sensor origin over the ground; 0: estimated from scans
  double ground_min_range = 1.0;      ///< m, inner edge of the first ring
  double ground_max_range = 100.0;    ///< m, outer edge of the last ring
  int ground_iterations = 3;          ///< plane fits per patch
  int ground_lowest_points = 10;      ///< points whose mean height seeds the plane
  int ground_min_points = 11;         ///< patches with fewer points are not ground
  int ground_fit_points = 512;        ///< maximum number of points that a plane is fitted to
  double ground_seed_margin = 0.5;    ///< m above the seed height
  double ground_distance = 0.125;     ///< m, ground points are less than this above the plane
  double ground_uprightness = 0.707;  ///< smallest z of the unit normal
  double ground_below = 0.1;  ///< depth of noise below the ground, as a ratio of sensor_height
  double noise_depth = 0.0;   ///< depth of noise below the sensor, as a ratio of sensor_height
  double ground_step = 0.5;   ///< m, a patch higher above its neighbours is not ground
  /// By inner ring: largest height (m over ground) of a ground patch that is not flat.
  std::array<double, kCheckedRings> ground_elevation = {0.523, 0.7246, 0.872, 1.118};
  /// By inner ring: flatness below which a patch above ground_elevation is ground.
  std::array<double, kCheckedRings> ground_flatness = {0.0, 1.25e-4, 1.85e-4, 1.85e-4};

  /// The values of the paper: no `ground_step`, the sensor height of KITTI, and the `noise_depth`
  /// of Patchwork.
  static GroundConfig paper() {
    GroundConfig config;
    config.sensor_height = 1.723;
    config.noise_depth = 1.8;
    config.ground_step = 0.0;
    return config;
  }

  /// The public implementation of the paper.
  static GroundConfig published() {
    GroundConfig config = paper();
    config.ground_min_points = 6;
    config.ground_fit_points = 1000000;
    return config;
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"sensor_height", self.sensor_height, closed(0, 100), "m",
                      "height of the sensor over the ground; 0: estimated from scans"});
    visitor(Parameter{"ground_min_range", self.ground_min_range, closed(0, 100), "m",
                      "inner edge of the first ring of ground patches"});
    visitor(Parameter{"ground_max_range", self.ground_max_range, closed(1, 1000), "m",
                      "outer edge of the last ring of ground patches"});
    visitor(Parameter{"ground_iterations", self.ground_iterations, closed(1, 10), "",
                      "plane fits per patch"});
    visitor(Parameter{"ground_lowest_points", self.ground_lowest_points, closed(1, 64), "",
                      "lowest points of a patch that seed its plane"});
    visitor(Parameter{"ground_min_points", self.ground_min_points, closed(3, 1000), "",
                      "patches with fewer points are not ground"});
    visitor(Parameter{"ground_fit_points", self.ground_fit_points, closed(64, 1000000), "",
                      "maximum number of points that the plane of a patch is fitted to"});
    visitor(Parameter{"ground_seed_margin", self.ground_seed_margin, half_open_below(0, 10), "m",
                      "height over the seeds up to which points enter the first fit"});
    visitor(Parameter{"ground_distance", self.ground_distance, half_open_below(0, 2), "m",
                      "height over the plane up to which points are ground"});
    visitor(Parameter{"ground_uprightness", self.ground_uprightness, closed(0, 1), "",
                      "smallest vertical component of a ground plane's normal"});
    visitor(Parameter{"ground_below", self.ground_below, closed(0, 10), "",
                      "depth under the ground, in sensor heights, from which points of the inner "
                      "zone seed no plane"});
    visitor(Parameter{"noise_depth", self.noise_depth, closed(0, 100), "",
                      "points deeper below the sensor, in sensor heights, are reflections and not "
                      "judged (Patchwork); 0: all are judged"});
    visitor(Parameter{"ground_step", self.ground_step, closed(0, 100), "m",
                      "a patch higher than this above most of its neighbours is not ground, except "
                      "in the outermost zone; 0: no check"});
    visitor(Parameter{"ground_elevation_1", self.ground_elevation[0], closed(-100, 100), "m",
                      "height over ground from which ring 1 must be flat"});
    visitor(Parameter{"ground_elevation_2", self.ground_elevation[1], closed(-100, 100), "m",
                      "height over ground from which ring 2 must be flat"});
    visitor(Parameter{"ground_elevation_3", self.ground_elevation[2], closed(-100, 100), "m",
                      "height over ground from which ring 3 must be flat"});
    visitor(Parameter{"ground_elevation_4", self.ground_elevation[3], closed(-100, 100), "m",
                      "height over ground from which ring 4 must be flat"});
    visitor(Parameter{"ground_flatness_1", self.ground_flatness[0], closed(0, 1), "",
                      "flatness below which high patches of ring 1 are ground"});
    visitor(Parameter{"ground_flatness_2", self.ground_flatness[1], closed(0, 1), "",
                      "flatness below which high patches of ring 2 are ground"});
    visitor(Parameter{"ground_flatness_3", self.ground_flatness[2], closed(0, 1), "",
                      "flatness below which high patches of ring 3 are ground"});
    visitor(Parameter{"ground_flatness_4", self.ground_flatness[3], closed(0, 1), "",
                      "flatness below which high patches of ring 4 are ground"});
  }

  /// Throws ConfigError.
  void validate() const {
    validate_parameters("GroundSegmenter", *this);
    if (!(ground_min_range < ground_max_range)) {
      throw ConfigError(
          "GroundSegmenter.ground_min_range = " + std::to_string(ground_min_range) +
          " must be less than ground_max_range = " + std::to_string(ground_max_range));
    }
  }
};

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
    const double depth = config_.noise_depth > 0.0 ? config_.noise_depth * height_ : kInfinity;
    zones_.find_patches(scan, static_cast<float>(-depth), patch_of_.data());
    detail::with_packs([&](auto packs) { sort<decltype(packs)>(scan, input); });
    heights_.fill(kNoGround);
    for (std::size_t p = 0; p < kPatches; ++p) segment_patch(p);
    find_overhangs();
    split.resize(scan.size());
    detail::with_packs([&](auto packs) { write<decltype(packs)>(split); });
  }

 private:
  static constexpr std::size_t kPatches = detail::ConcentricZones::kPatches;
  static constexpr std::size_t kLists = kPatches + 2;  // of patches, points outside, and noise
  static constexpr float kNoGround = std::numeric_limits<float>::quiet_NaN();
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();

  // Points with their indices in the input of the remover.
  template <class Coordinate, class Index>
  struct Columns {
    Coordinate *x, *y, *z;
    Index* input;
  };
  using ColumnsFrom = Columns<const float, const std::uint32_t>;
  using ColumnsTo = Columns<float, std::uint32_t>;

  template <class Packs>
  static void copy_pack(const ColumnsFrom& from, std::size_t i, const ColumnsTo& to,
                        std::size_t k) {
    using Float = typename Packs::Float;
    Float::load(from.x + i).store(to.x + k);
    Float::load(from.y + i).store(to.y + k);
    Float::load(from.z + i).store(to.z + k);
    using Int = typename Packs::Int;
    Int::load(reinterpret_cast<const std::int32_t*>(from.input + i))
        .store(reinterpret_cast<std::int32_t*>(to.input + k));
  }
  static void copy_point(const ColumnsFrom& from, std::size_t i, const ColumnsTo& to,
                         std::size_t k) {
    to.x[k] = from.x[i];
    to.y[k] = from.y[i];
    to.z[k] = from.z[i];
    to.input[k] = from.input[i];
  }

  // Counting sort by patch; the points of a patch keep the order of the scan. Neighbours in a scan
  // mostly share a patch, so it moves runs of points. Each list begins with a whole pack and ends
  // with room for one.
  template <class Packs>
  void sort(PointsView scan, Span<const std::uint32_t> input) {
    const auto for_each_run = [&](auto&& visit) {
      detail::for_each_run<Packs>(scan.size(), visit, patch_of_.data());
    };
    const auto patch = [&](std::size_t i) { return static_cast<std::size_t>(patch_of_[i]); };
    size_.fill(0);
    for_each_run([&](std::size_t begin, std::size_t end) { size_[patch(begin)] += end - begin; });
    std::size_t at = 0;
    for (std::size_t p = 0; p < kLists; ++p) {
      begin_[p] = next_[p] = at;
      at = (at + size_[p]) / Packs::kCount * Packs::kCount + 2 * Packs::kCount;
    }
    sorted_.grow(at);
    detail::grow(sorted_input_, at);
    is_ground_.assign(at / Packs::kCount, 0);
    const ColumnsFrom from = {scan.x.data(), scan.y.data(), scan.z.data(), input.data()};
    const ColumnsTo to = {sorted_.x.data(), sorted_.y.data(), sorted_.z.data(),
                          sorted_input_.data()};
    for_each_run([&](std::size_t begin, std::size_t end) {
      std::size_t& next = next_[patch(begin)];
      std::size_t k = next;
      next += end - begin;
      if (scan.size() < end + Packs::kCount) {
        for (std::size_t i = begin; i < end; ++i, ++k) copy_point(from, i, to, k);
        return;
      }
      for (std::size_t i = begin; i < end; i += Packs::kCount, k += Packs::kCount) {
        copy_pack<Packs>(from, i, to, k);
      }
    });
  }

  template <class Packs>
  void write(GroundSplit& split) const {
    const ColumnsFrom from = {sorted_.x.data(), sorted_.y.data(), sorted_.z.data(),
                              sorted_input_.data()};
    const ColumnsTo to = {split.points.x.data(), split.points.y.data(), split.points.z.data(),
                          split.input.data()};
    std::size_t count = 0;
    // Appends the points of a list that are ground, or those that are not.
    const auto append = [&](std::size_t list, bool is_ground) {
      const std::size_t end = begin_[list] + size_[list];
      for (std::size_t i = begin_[list]; i < end; i += Packs::kCount) {
        const unsigned all = Packs::kAll >> (Packs::kCount - std::min(Packs::kCount, end - i));
        const unsigned ground = is_ground_[i / Packs::kCount];
        const unsigned wanted = is_ground ? ground : ~ground & all;
        if (wanted == all) {
          copy_pack<Packs>(from, i, to, count);
          count += std::min(Packs::kCount, end - i);
        } else {
          detail::for_each_bit(wanted,
                               [&](std::size_t k) { copy_point(from, i + k, to, count++); });
        }
      }
    };
    for (std::size_t p = 0; p < kPatches; ++p) {
      if (!overhangs_[p]) append(p, true);
    }
    split.ground_count = count;
    for (std::size_t list = 0; list < kLists; ++list) {
      if (list == kPatches + 1) split.count = count;
      append(list, false);
      if (list < kPatches && overhangs_[list]) append(list, true);
    }
  }

  // Whether the ground of a patch lies more than `ground_step` above that of most neighbours. False
  // if fewer than four neighbours have ground. On a slope, as many neighbours are higher as lower.
  bool overhangs(std::size_t patch) const {
    const float limit = heights_[patch] - static_cast<float>(config_.ground_step);
    int known = 0;
    int lower = 0;
    for (const std::size_t other : zones_.neighbours(patch)) {
      known += std::isnan(heights_[other]) ? 0 : 1;
      lower += heights_[other] < limit ? 1 : 0;
    }
    return known >= 4 && 2 * lower > known;
  }

  // Ground that overhangs is none. Not in the outermost zone, where a slope of a few percent is a
  // step from ring to ring.
  void find_overhangs() {
    using Zones = detail::ConcentricZones;
    constexpr auto kOutermost = static_cast<std::size_t>(Zones::kRings.back()) *
                                static_cast<std::size_t>(Zones::kSectors.back());
    overhangs_.reset();
    if (config_.ground_step <= 0.0) return;
    for (std::size_t p = 0; p < kPatches - kOutermost; ++p) overhangs_[p] = overhangs(p);
  }

  // Finds the ground points of a patch.
  void segment_patch(std::size_t patch) {
    if (size_[patch] < static_cast<std::size_t>(config_.ground_min_points)) return;
    const std::size_t begin = begin_[patch];
    std::fill_n(&sorted_.z[begin + size_[patch]], detail::kPackWidth, kInfinity);
    const PointsView points = PointsView(sorted_).subview(begin, size_[patch]);
    detail::with_packs([&](auto packs) {
      using Packs = decltype(packs);
      const std::optional<detail::HalfSpace> below = find_ground<Packs>(patch, points);
      for (std::size_t i = 0; below && i < points.size(); i += Packs::kCount) {
        const auto position = below->template local<typename Packs::Float>(points, i);
        is_ground_[(begin + i) / Packs::kCount] =
            static_cast<std::uint8_t>(below->contains(position).bits());
      }
    });
  }

  // The half space of the ground points of a patch, if it has ground.
  template <class Packs>
  std::optional<detail::HalfSpace> find_ground(std::size_t patch, PointsView all) {
    const PointsView points = sample_of(all);
    const float seed_height = detail::mean_of_lowest<Packs>(
        points.z, static_cast<std::size_t>(config_.ground_lowest_points), floor_of(patch), lowest_);
    detail::HalfSpace below(points.x[0], points.y[0], seed_height,
                            static_cast<float>(config_.ground_seed_margin));
    if (!fit_ground<Packs>(patch, points, seed_height, below)) return std::nullopt;
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
                            : -kInfinity;
  }

  // Iterates from the half space below the seed height to the one below the plane. Returns whether
  // its points are ground.
  template <class Packs>
  bool fit_ground(std::size_t patch, PointsView points, float seed_height,
                  detail::HalfSpace& below) {
    detail::Plane plane;
    for (int i = 0; i < config_.ground_iterations; ++i) {
      const detail::PlaneMoments moments = detail::moments_within<Packs>(below, points);
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
  double height_ = 0.0;                                        // m, sensor over the ground
  std::vector<std::int32_t> patch_of_;                         // list of each point of the scan
  std::array<std::size_t, kLists> begin_{}, size_{}, next_{};  // of the lists in sorted_
  PointBuffer sorted_;                                         // by list
  std::vector<std::uint32_t> sorted_input_;
  std::vector<std::uint8_t> is_ground_;        // a bit for each point of sorted_
  std::bitset<kPatches> overhangs_;            // patches
  PointBuffer sample_;                         // of the current patch
  std::vector<float> lowest_;                  // m, of the current patch
  std::array<float, kPatches + 1> heights_{};  // m, ground of each patch; last: none
};

}  // namespace dynains
