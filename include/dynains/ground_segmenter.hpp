// Ground segmentation by concentric zones (Patchwork, Lim et al., RA-L 2021), the "off-the-shelf
// ground segmentation" of the paper: the plane is divided into rings and sectors, each patch gets
// its own plane, and a patch whose plane is steep, high or rough is not ground.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/detail/arc_tangent.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/detail/plane_fit.hpp"
#include "dynains/detail/room.hpp"
#include "dynains/detail/wide_lanes.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor_model.hpp"

namespace dynains {

/// One scan, reordered: ground points first, all others behind. What follows works on ranges of
/// it, never on copies.
struct GroundSplit {
  PointBuffer points;                ///< may be longer than size(): padded for wide loads
  std::vector<std::uint32_t> input;  ///< number of each point in the input of the remover
  std::size_t ground_count = 0;
  std::size_t count = 0;

  PointsView ground() const { return PointsView(points).subview(0, ground_count); }
  PointsView non_ground() const {
    return PointsView(points).subview(ground_count, count - ground_count);
  }
  void resize(std::size_t size) {
    count = size;
    const std::size_t padded = size + detail::kLanes;
    points.grow(padded);
    detail::grow(input, padded);
  }
};

/// Splits a scan into ground and the rest.
class GroundSegmenter {
 public:
  static constexpr std::size_t kZones = 4;
  /// Rings and sectors of each zone, from the inside out (Patchwork).
  static constexpr std::array<std::int32_t, kZones> kRings = {2, 4, 4, 4};
  static constexpr std::array<std::int32_t, kZones> kSectors = {16, 32, 54, 32};
  static constexpr std::size_t kPatches = 2 * 16 + 4 * 32 + 4 * 54 + 4 * 32;
  /// The innermost rings, where height and roughness of a patch are checked.
  static constexpr std::size_t kCheckedRings = 4;
  static constexpr int kMaxLowest = 64;

  struct Config {
    double sensor_height = 0.0;         ///< m, sensor origin over the ground; 0: from the scans
    double ground_min_range = 1.0;      ///< m, inner edge of the first ring
    double ground_max_range = 100.0;    ///< m, outer edge of the last ring
    int ground_iterations = 3;          ///< plane fits per patch
    int ground_lowest_points = 10;      ///< points whose mean height seeds the plane
    int ground_min_points = 11;         ///< patches with fewer points are not ground
    double ground_seed_margin = 0.5;    ///< m above the seed height
    double ground_distance = 0.125;     ///< m, a ground point lies less than this above the plane
    double ground_uprightness = 0.707;  ///< smallest z of the unit normal
    double ground_below = 0.1;          ///< share of sensor_height below ground taken for noise
    /// Largest height (m over ground) of a patch in the four inner rings, unless it is flat.
    std::array<double, kCheckedRings> ground_elevation = {0.523, 0.7246, 0.872, 1.118};
    /// Largest flatness that lets a patch above that height still be ground.
    std::array<double, kCheckedRings> ground_flatness = {0.0, 1.25e-4, 1.85e-4, 1.85e-4};

    /// The height of KITTI's sensor, given.
    static Config paper() {
      Config config;
      config.sensor_height = 1.723;
      return config;
    }

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"sensor_height", self.sensor_height, closed(0, 100), "m",
                        "height of the sensor over the ground; 0: from the scans"});
      visitor(Parameter{"ground_min_range", self.ground_min_range, closed(0, 100), "m",
                        "inner edge of the first ring of ground patches (Patchwork)"});
      visitor(Parameter{"ground_max_range", self.ground_max_range, closed(1, 1000), "m",
                        "outer edge of the last ring of ground patches (Patchwork)"});
      visitor(Parameter{"ground_iterations", self.ground_iterations, closed(1, 10), "",
                        "plane fits per patch (Patchwork)"});
      visitor(Parameter{"ground_lowest_points", self.ground_lowest_points, closed(1, kMaxLowest),
                        "", "lowest points of a patch that seed its plane (Patchwork)"});
      visitor(Parameter{"ground_min_points", self.ground_min_points, closed(3, 1000), "",
                        "patches with fewer points are not ground (Patchwork)"});
      visitor(
          Parameter{"ground_seed_margin", self.ground_seed_margin, half_open_below(0, 10), "m",
                    "height over the seeds up to which points enter the first fit (Patchwork)"});
      visitor(Parameter{"ground_distance", self.ground_distance, half_open_below(0, 2), "m",
                        "height over the plane up to which points are ground (Patchwork)"});
      visitor(Parameter{"ground_uprightness", self.ground_uprightness, closed(0, 1), "",
                        "smallest vertical component of a ground plane's normal (Patchwork)"});
      visitor(Parameter{"ground_below", self.ground_below, closed(0, 10), "",
                        "depth under the ground, as a share of sensor_height, from which points "
                        "of the inner zone do not seed a plane (Patchwork)"});
      visitor(
          Parameter{"ground_elevation_1", self.ground_elevation[0], closed(-100, 100), "m",
                    "height over ground from which a patch of ring 1 must be flat (Patchwork)"});
      visitor(Parameter{"ground_elevation_2", self.ground_elevation[1], closed(-100, 100), "m",
                        "the same for ring 2"});
      visitor(Parameter{"ground_elevation_3", self.ground_elevation[2], closed(-100, 100), "m",
                        "the same for ring 3"});
      visitor(Parameter{"ground_elevation_4", self.ground_elevation[3], closed(-100, 100), "m",
                        "the same for ring 4"});
      visitor(Parameter{"ground_flatness_1", self.ground_flatness[0], closed(0, 1), "",
                        "flatness below which a high patch of ring 1 is ground (Patchwork)"});
      visitor(Parameter{"ground_flatness_2", self.ground_flatness[1], closed(0, 1), "",
                        "the same for ring 2"});
      visitor(Parameter{"ground_flatness_3", self.ground_flatness[2], closed(0, 1), "",
                        "the same for ring 3"});
      visitor(Parameter{"ground_flatness_4", self.ground_flatness[3], closed(0, 1), "",
                        "the same for ring 4"});
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
  /// Order within `split` is by patch, then as scanned.
  void segment(PointsView scan, Span<const std::uint32_t> input, GroundSplit& split) {
    sort_by_patch(scan, input);
    split.resize(scan.size());
    rest_.resize(scan.size());
    Output out = {split, rest_};
    for (std::size_t p = 0; p < kPatches; ++p) segment_patch(p, out);
    out.put_rest(sorted_, patch_begin_[kPatches], scan.size());
    split.ground_count = out.ground_count;
    copy(rest_, 0, out.rest_count, split, out.ground_count);
  }

 private:
  static constexpr std::size_t kFewestInStreak = 4;  // points on average, to move them together

  // Constants of a zone; small whole numbers are exact in floats.
  struct Zone {
    float inner;  // m
    float rings_per_metre;
    float sectors_per_radian;
    float first_patch;
    float last_ring;
    float sectors;
  };

  // What is beyond the inner edge of a zone is beyond those before. So a constant of the zone in
  // which a point lies is that of the first, with the differences to later ones flipped bit by bit.
  struct ZoneConstant {
    std::array<detail::Constant8, kZones> of;
    std::array<detail::Constant8, kZones> flip = {
        of[0], of[0].bits_changed(of[1]), of[1].bits_changed(of[2]), of[2].bits_changed(of[3])};
  };

  static void copy(const GroundSplit& from, std::size_t begin, std::size_t count, GroundSplit& to,
                   std::size_t at) {
    detail::copy(&from.points.x[begin], count, &to.points.x[at]);
    detail::copy(&from.points.y[begin], count, &to.points.y[at]);
    detail::copy(&from.points.z[begin], count, &to.points.z[at]);
    detail::copy(&from.input[begin], count, &to.input[at]);
  }

  // Ground goes straight to the front of the split, the rest into a buffer of its own, because it
  // cannot be known yet where it begins.
  struct Output {
    GroundSplit& ground;
    GroundSplit& rest;
    std::size_t ground_count = 0;
    std::size_t rest_count = 0;

    void put_rest(const GroundSplit& from, std::size_t begin, std::size_t end) {
      copy(from, begin, end - begin, rest, rest_count);
      rest_count += end - begin;
    }
    // Up to eight points; bit k of `is_ground` belongs to the k-th.
    void put(const GroundSplit& from, std::size_t begin, std::size_t count, unsigned is_ground) {
      if (is_ground == 0) return put_rest(from, begin, begin + count);
      if (is_ground == (1U << count) - 1U) {
        copy(from, begin, count, ground, ground_count);
        ground_count += count;
        return;
      }
      // Written to both places, since no branch could foretell the right one.
      for (std::size_t k = 0; k < count; ++k) {
        const unsigned bit = (is_ground >> k) & 1U;
        put_one(from, begin + k, ground, ground_count);
        put_one(from, begin + k, rest, rest_count);
        ground_count += bit;
        rest_count += 1U - bit;
      }
    }
    static void put_one(const GroundSplit& from, std::size_t i, GroundSplit& to, std::size_t at) {
      to.points.x[at] = from.points.x[i];
      to.points.y[at] = from.points.y[i];
      to.points.z[at] = from.points.z[i];
      to.input[at] = from.input[i];
    }
  };

  // Counting sort; stable, so that points keep the order of the scan within their patch.
  void sort_by_patch(PointsView scan, Span<const std::uint32_t> input) {
    const std::size_t count = scan.size();
    sorted_.resize(count);
    detail::grow(patch_of_, count + detail::kLanes);
    find_patches(scan);
    patch_begin_.fill(0);
    // Scans that come beam by beam have long streaks of points in one patch, those that come column
    // by column have none.
    if (detail::count_changes(patch_of_.data(), count) > count / kFewestInStreak) {
      sort_points(scan, input);
    } else {
      sort_streaks(scan, input);
    }
  }

  // From the sizes of patches, each in the place behind its own, to where they begin.
  void add_up_sizes() {
    for (std::size_t p = 1; p < patch_begin_.size(); ++p) patch_begin_[p] += patch_begin_[p - 1];
  }

  void sort_points(PointsView scan, Span<const std::uint32_t> input) {
    const std::int32_t* const patch_of = patch_of_.data();
    for (std::size_t i = 0; i < scan.size(); ++i) {
      ++patch_begin_[static_cast<std::size_t>(patch_of[i]) + 1];
    }
    add_up_sizes();
    auto next = patch_begin_;
    float* const x = sorted_.points.x.data();
    float* const y = sorted_.points.y.data();
    float* const z = sorted_.points.z.data();
    std::uint32_t* const numbers = sorted_.input.data();
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const std::size_t to = next[static_cast<std::size_t>(patch_of[i])]++;
      x[to] = scan.x[i];
      y[to] = scan.y[i];
      z[to] = scan.z[i];
      numbers[to] = input[i];
    }
  }

  // What is counted and moved are whole streaks: no counter waits for its own last increment.
  void sort_streaks(PointsView scan, Span<const std::uint32_t> input) {
    streak_end_.clear();
    std::size_t begin = 0;
    detail::for_each_change(patch_of_.data(), scan.size(), [&](std::size_t length) {
      patch_begin_[static_cast<std::size_t>(patch_of_[begin]) + 1] += length;
      begin += length;
      streak_end_.push_back(static_cast<std::uint32_t>(begin));
    });
    add_up_sizes();
    auto next = patch_begin_;
    begin = 0;
    for (const std::uint32_t end : streak_end_) {
      const std::size_t length = end - begin;
      std::size_t& to = next[static_cast<std::size_t>(patch_of_[begin])];
      detail::copy(&scan.x[begin], length, &sorted_.points.x[to]);
      detail::copy(&scan.y[begin], length, &sorted_.points.y[to]);
      detail::copy(&scan.z[begin], length, &sorted_.points.z[to]);
      detail::copy(&input[begin], length, &sorted_.input[to]);
      to += length;
      begin = end;
    }
  }

  void find_patches(PointsView scan) {
    using detail::Constant8;
    // Read once: the compiler cannot know that stores leave members alone.
    const auto of_zone = [&](float Zone::*constant) {
      return ZoneConstant{
          {zones_[0].*constant, zones_[1].*constant, zones_[2].*constant, zones_[3].*constant}};
    };
    const ZoneConstant inner = of_zone(&Zone::inner);
    const ZoneConstant rings_per_metre = of_zone(&Zone::rings_per_metre);
    const ZoneConstant sectors_per_radian = of_zone(&Zone::sectors_per_radian);
    const ZoneConstant first_patch = of_zone(&Zone::first_patch);
    const ZoneConstant last_ring = of_zone(&Zone::last_ring);
    const ZoneConstant sector_count = of_zone(&Zone::sectors);
    const Constant8 nearest(static_cast<float>(config_.ground_min_range));
    const Constant8 farthest(static_cast<float>(config_.ground_max_range));
    const Constant8 pi(detail::kPi);
    const Constant8 one(1.0F);
    std::int32_t* const patches = patch_of_.data();

    detail::for_lanes(scan.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      using Int = typename decltype(at)::Int;
      const Float x = at.load(scan.x.data());
      const Float y = at.load(scan.y.data());
      const Float range = sqrt(x * x + y * y);
      const Float azimuth = detail::azimuth_of(y, x, range) + pi;
      const auto beyond_1 = range >= inner.of[1];
      const auto beyond_2 = range >= inner.of[2];
      const auto beyond_3 = range >= inner.of[3];
      const auto here = [&](const ZoneConstant& constant) {
        return float_of(bits_of(Float(constant.of[0])) ^
                        (beyond_1 & bits_of(Float(constant.flip[1]))) ^
                        (beyond_2 & bits_of(Float(constant.flip[2]))) ^
                        (beyond_3 & bits_of(Float(constant.flip[3]))));
      };
      const auto whole = [](const Float& value) { return to_float(truncate(value)); };
      const Float ring =
          whole(min((min(range, farthest) - here(inner)) * here(rings_per_metre), here(last_ring)));
      const Float sectors = here(sector_count);
      const Float sector = whole(min(azimuth * here(sectors_per_radian), sectors - one));
      const Float patch = here(first_patch) + ring * sectors + sector;
      const auto inside = (range >= nearest) & (range <= farthest);
      select(inside, truncate(patch), Int(static_cast<std::int32_t>(kPatches)))
          .store(patches + at.begin);
    });
  }

  void segment_patch(std::size_t patch, Output& out) const {
    const std::size_t begin = patch_begin_[patch];
    const std::size_t end = patch_begin_[patch + 1];
    const auto reject = [&] { out.put_rest(sorted_, begin, end); };
    if (end - begin < static_cast<std::size_t>(config_.ground_min_points)) return reject();

    const bool innermost_zone = static_cast<std::int32_t>(patch) < kRings[0] * kSectors[0];
    const double h = height_;
    const float floor = innermost_zone ? static_cast<float>(-(1.0 + config_.ground_below) * h)
                                       : -std::numeric_limits<float>::infinity();
    const float seed_height = lowest_mean(begin, end, floor);

    // First fit: the points near the seed height, as a horizontal half space; then the plane.
    const float x0 = sorted_.points.x[begin];
    const float y0 = sorted_.points.y[begin];
    HalfSpace below(x0, y0, seed_height, static_cast<float>(config_.ground_seed_margin));
    detail::Plane plane;
    for (int i = 0; i < config_.ground_iterations; ++i) {
      const detail::PlaneMoments moments = sum_moments(begin, end, below);
      if (moments.count < 3.0) return reject();
      plane = detail::fit_plane(moments);
      below.x = static_cast<float>(plane.normal_x);
      below.y = static_cast<float>(plane.normal_y);
      below.z = static_cast<float>(plane.normal_z);
      below.offset =
          static_cast<float>(config_.ground_distance + plane.normal_x * plane.mean_x +
                             plane.normal_y * plane.mean_y + plane.normal_z * plane.mean_z);
    }
    if (plane.normal_z < config_.ground_uprightness) return reject();
    const auto ring = static_cast<std::size_t>(ring_of_patch_[patch]);
    if (ring < kCheckedRings) {
      const double elevation = plane.mean_z + static_cast<double>(seed_height) + h;
      if (elevation > config_.ground_elevation[ring] &&
          plane.flatness >= config_.ground_flatness[ring]) {
        return reject();
      }
    }

    detail::run_lanes([&](auto lanes) {
      using Lanes = decltype(lanes);
      for (std::size_t i = begin; i < end; i += detail::kLanes) {
        const unsigned bits = below.inside(below.template local<Lanes>(sorted_.points, i)).bits();
        const std::size_t count = std::min(detail::kLanes, end - i);
        out.put(sorted_, i, count, bits & ((1U << count) - 1U));
      }
    });
  }

  // Points with normal . (p - origin) < offset; the origin of the fit is near the points.
  struct HalfSpace {
    HalfSpace(float origin_x, float origin_y, float origin_z, float distance)
        : x0(origin_x), y0(origin_y), z0(origin_z), offset(distance) {}

    detail::Constant8 x0, y0, z0;
    detail::Constant8 x = 0.0F, y = 0.0F, z = 1.0F, offset;

    template <class Lanes>
    std::array<typename Lanes::Float, 3> local(const PointBuffer& points, std::size_t i) const {
      using Float = typename Lanes::Float;
      return {Float::load(&points.x[i]) - x0, Float::load(&points.y[i]) - y0,
              Float::load(&points.z[i]) - z0};
    }
    template <class Float>
    auto inside(const std::array<Float, 3>& p) const {
      return x * p[0] + y * p[1] + z * p[2] < offset;
    }
  };

  detail::PlaneMoments sum_moments(std::size_t begin, std::size_t end,
                                   const HalfSpace& space) const {
    static constexpr detail::Constant8 kZero(0.0F), kOne(1.0F);
    std::array<float, 10> sums;
    detail::run_lanes([&](auto lanes) {
      using Lanes = decltype(lanes);
      using Float = typename Lanes::Float;
      Float n = kZero, sx = kZero, sy = kZero, sz = kZero, sxx = kZero, sxy = kZero, sxz = kZero,
            syy = kZero, syz = kZero, szz = kZero;
      const auto add = [&](const std::array<Float, 3>& p, const typename Lanes::Mask& member) {
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
      };
      std::size_t i = begin;
      for (; i + detail::kLanes <= end; i += detail::kLanes) {
        const auto p = space.template local<Lanes>(sorted_.points, i);
        add(p, space.inside(p));
      }
      if (i < end) {
        const auto p = space.template local<Lanes>(sorted_.points, i);
        add(p, space.inside(p) & detail::lanes_below<Lanes>(end - i));
      }
      sums = {sum(n),   sum(sx),  sum(sy),  sum(sz),  sum(sxx),
              sum(sxy), sum(sxz), sum(syy), sum(syz), sum(szz)};
    });
    return {sums[0], sums[1], sums[2], sums[3], sums[4],
            sums[5], sums[6], sums[7], sums[8], sums[9]};
  }

  // The lowest values met so far, in order.
  struct Lowest {
    std::size_t wanted;
    std::size_t found = 0;
    std::array<float, kMaxLowest> values{};

    void add(float value) {
      if (found == wanted && !(value < values[found - 1])) return;
      std::size_t at = found < wanted ? found++ : wanted - 1;
      for (; at > 0 && values[at - 1] > value; --at) values[at] = values[at - 1];
      values[at] = value;
    }
    float limit() const {
      return found == wanted ? values[found - 1] : std::numeric_limits<float>::infinity();
    }
  };

  // Mean height of the lowest points that are not below `floor`; all of them if there are fewer.
  // Points often come in the order of their height. So the lowest of each of some interleaved
  // groups bound the result first, and only the few points within the bound are sorted in.
  float lowest_mean(std::size_t begin, std::size_t end, float floor) const {
    using detail::Float8;
    Lowest lowest{static_cast<std::size_t>(config_.ground_lowest_points)};
    const Float8 infinity(std::numeric_limits<float>::infinity());
    const auto heights = [&](std::size_t i) {
      const Float8 z = Float8::load(&sorted_.points.z[i]);
      detail::Mask8 valid = z >= Float8(floor);
      if (end - i < detail::kLanes) {
        valid = valid & detail::lanes_below<detail::NarrowLanes>(end - i);
      }
      return select(valid, z, infinity);
    };
    const std::size_t groups = (lowest.wanted - 1) / detail::kLanes + 1;
    for (std::size_t group = 0; group < groups; ++group) {
      Float8 least = infinity;
      for (std::size_t i = begin + group * detail::kLanes; i < end; i += groups * detail::kLanes) {
        least = min(heights(i), least);
      }
      float values[detail::kLanes];
      least.store(values);
      for (const float value : values) lowest.add(value);
    }
    const Float8 bound(lowest.limit());
    lowest.found = 0;
    for (std::size_t i = begin; i < end; i += detail::kLanes) {
      const Float8 z = heights(i);
      for (unsigned bits = ((z <= bound) & (z < infinity)).bits(); bits != 0; bits &= bits - 1) {
        lowest.add(sorted_.points.z[i + static_cast<std::size_t>(__builtin_ctz(bits))]);
      }
    }
    if (lowest.found == 0) return floor;
    float total = 0.0F;
    for (std::size_t i = 0; i < lowest.found; ++i) total += lowest.values[i];
    return total / static_cast<float>(lowest.found);
  }

  Config config_;
  double height_ = 0.0;  // m
  std::array<Zone, kZones> zones_{};
  std::array<std::int32_t, kPatches> ring_of_patch_{};
  std::array<std::size_t, kPatches + 2> patch_begin_{};
  std::vector<std::int32_t> patch_of_;
  std::vector<std::uint32_t> streak_end_;
  GroundSplit sorted_;  // by patch
  GroundSplit rest_;
};

}  // namespace dynains
