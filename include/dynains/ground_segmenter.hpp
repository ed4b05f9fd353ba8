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
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor_model.hpp"

namespace dynains {

/// One scan, reordered: ground points first, all others behind. What follows works on ranges of
/// it, never on copies.
struct GroundSplit {
  PointBuffer points;                 ///< may be longer than size(): padded for wide loads
  std::vector<std::uint32_t> source;  ///< position of each point in the scan that was segmented
  std::size_t ground_count = 0;
  std::size_t count = 0;

  PointsView ground() const { return PointsView(points).subview(0, ground_count); }
  PointsView non_ground() const {
    return PointsView(points).subview(ground_count, count - ground_count);
  }
  void resize(std::size_t size) {
    count = size;
    const std::size_t padded = size + detail::kLanes;
    if (points.size() < padded) points.resize(padded);
    if (source.size() < padded) source.resize(padded);
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

  struct Config {
    double sensor_height = 0.0;          ///< m, sensor origin over the ground; 0: from the scans
    double ground_min_range = 1.0;       ///< m, inner edge of the first ring
    double ground_max_range = 100.0;     ///< m, outer edge of the last ring
    int ground_iterations = 3;           ///< plane fits per patch
    int ground_lowest_points = 10;       ///< points whose mean height seeds the plane
    int ground_min_points = 11;          ///< patches with fewer points are not ground
    double ground_seed_margin = 0.5;     ///< m above the seed height
    double ground_distance = 0.125;      ///< m, a ground point lies less than this above the plane
    double ground_uprightness = 0.707;   ///< smallest z of the unit normal
    double ground_below = 0.1;           ///< share of sensor_height below ground taken for noise
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
      visitor(Parameter{"ground_lowest_points", self.ground_lowest_points, closed(1, 64), "",
                        "lowest points of a patch that seed its plane (Patchwork)"});
      visitor(Parameter{"ground_min_points", self.ground_min_points, closed(3, 1000), "",
                        "patches with fewer points are not ground (Patchwork)"});
      visitor(Parameter{"ground_seed_margin", self.ground_seed_margin, half_open_below(0, 10), "m",
                        "height over the seeds up to which points enter the first fit (Patchwork)"});
      visitor(Parameter{"ground_distance", self.ground_distance, half_open_below(0, 2), "m",
                        "height over the plane up to which points are ground (Patchwork)"});
      visitor(Parameter{"ground_uprightness", self.ground_uprightness, closed(0, 1), "",
                        "smallest vertical component of a ground plane's normal (Patchwork)"});
      visitor(Parameter{"ground_below", self.ground_below, closed(0, 10), "",
                        "depth under the ground, as a share of sensor_height, from which points "
                        "of the inner zone do not seed a plane (Patchwork)"});
      visitor(Parameter{"ground_elevation_1", self.ground_elevation[0], closed(-100, 100), "m",
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
        throw ConfigError("GroundSegmenter.ground_min_range = " + std::to_string(ground_min_range) +
                          " must be less than ground_max_range = " +
                          std::to_string(ground_max_range));
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
    const std::array<double, kZones + 1> edges = {inner, (7 * inner + outer) / 8,
                                                  (3 * inner + outer) / 4, (inner + outer) / 2,
                                                  outer};
    std::int32_t first_patch = 0;
    std::int32_t first_ring = 0;
    for (std::size_t i = 0; i < kZones; ++i) {
      zones_[i] = {static_cast<float>(edges[i]),
                   static_cast<float>(kRings[i] / (edges[i + 1] - edges[i])),
                   static_cast<float>(kSectors[i] / (2.0 * M_PI)),
                   first_patch,
                   kRings[i] - 1,
                   kSectors[i]};
      for (std::int32_t p = 0; p < kRings[i] * kSectors[i]; ++p) {
        ring_of_patch_[static_cast<std::size_t>(first_patch + p)] =
            first_ring + p / kSectors[i];
      }
      first_patch += kRings[i] * kSectors[i];
      first_ring += kRings[i];
    }
  }

  const Config& config() const { return config_; }

  /// Takes the sensor's height unless it was given; that of a typical sensor until then.
  void adapt(const SensorModel& sensor) {
    height_ = config_.sensor_height > 0.0 ? config_.sensor_height : sensor.height;
  }

  /// Splits `scan` (metres, sensor frame, z up, finite coordinates). Points outside the rings and
  /// points of sparse patches are not ground. Order within `split` is by patch, then as scanned.
  void segment(PointsView scan, GroundSplit& split) {
    sort_by_patch(scan);
    std::size_t ground_count = 0;
    for (std::size_t p = 0; p < kPatches; ++p) ground_count += segment_patch(p);
    const std::size_t outside = patch_begin_[kPatches];
    std::fill(is_ground_.begin() + static_cast<std::ptrdiff_t>(outside),
              is_ground_.begin() + static_cast<std::ptrdiff_t>(scan.size()), std::uint8_t{0});
    split.resize(scan.size());
    split.ground_count = ground_count;
    partition(split);
  }

 private:
  struct Zone {
    float inner;               // m
    float rings_per_metre;
    float sectors_per_radian;
    std::int32_t first_patch;
    std::int32_t last_ring;
    std::int32_t sectors;
  };

  void reserve(std::size_t count) {
    const std::size_t padded = count + detail::kLanes;
    if (patch_of_.size() >= padded) return;
    patch_of_.resize(padded);
    is_ground_.resize(padded);
    sorted_.resize(padded);
    source_.resize(padded);
  }

  // Counting sort; stable, so that points keep the order of the scan within their patch.
  void sort_by_patch(PointsView scan) {
    reserve(scan.size());
    const std::size_t count = scan.size();
    const std::size_t whole = count - count % detail::kLanes;
    for (std::size_t i = 0; i < whole; i += detail::kLanes) {
      find_patches(detail::Float8::load(&scan.x[i]), detail::Float8::load(&scan.y[i]))
          .store(&patch_of_[i]);
    }
    if (whole < count) {
      float x[detail::kLanes] = {};
      float y[detail::kLanes] = {};
      std::copy(scan.x.begin() + whole, scan.x.end(), x);
      std::copy(scan.y.begin() + whole, scan.y.end(), y);
      find_patches(detail::Float8::load(x), detail::Float8::load(y)).store(&patch_of_[whole]);
    }

    patch_begin_.fill(0);
    for (std::size_t i = 0; i < count; ++i) {
      ++patch_begin_[static_cast<std::size_t>(patch_of_[i]) + 1];
    }
    for (std::size_t p = 1; p < patch_begin_.size(); ++p) patch_begin_[p] += patch_begin_[p - 1];
    auto next = patch_begin_;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t to = next[static_cast<std::size_t>(patch_of_[i])]++;
      sorted_.x[to] = scan.x[i];
      sorted_.y[to] = scan.y[i];
      sorted_.z[to] = scan.z[i];
      source_[to] = static_cast<std::uint32_t>(i);
    }
  }

  detail::Int8 find_patches(detail::Float8 x, detail::Float8 y) const {
    using detail::Float8;
    using detail::Int8;
    const Float8 range = detail::sqrt(x * x + y * y);
    const Float8 azimuth = detail::arc_tangent2(y, x) + Float8(detail::kPi);
    Float8 inner(zones_[0].inner);
    Float8 rings_per_metre(zones_[0].rings_per_metre);
    Float8 sectors_per_radian(zones_[0].sectors_per_radian);
    Int8 first_patch(zones_[0].first_patch);
    Int8 last_ring(zones_[0].last_ring);
    Int8 sectors(zones_[0].sectors);
    for (std::size_t i = 1; i < kZones; ++i) {
      const detail::Mask8 beyond = range >= Float8(zones_[i].inner);
      inner = select(beyond, Float8(zones_[i].inner), inner);
      rings_per_metre = select(beyond, Float8(zones_[i].rings_per_metre), rings_per_metre);
      sectors_per_radian = select(beyond, Float8(zones_[i].sectors_per_radian), sectors_per_radian);
      first_patch = select(beyond, Int8(zones_[i].first_patch), first_patch);
      last_ring = select(beyond, Int8(zones_[i].last_ring), last_ring);
      sectors = select(beyond, Int8(zones_[i].sectors), sectors);
    }
    const Float8 limited = detail::min(range, Float8(static_cast<float>(config_.ground_max_range)));
    const Int8 ring = detail::min(detail::truncate((limited - inner) * rings_per_metre), last_ring);
    const Int8 sector =
        detail::min(detail::truncate(azimuth * sectors_per_radian), sectors - Int8(1));
    // ring * sectors, in floats: SSE2 has no 32-bit product, and these numbers are small.
    const Int8 patch =
        first_patch + detail::truncate(to_float(ring) * to_float(sectors)) + sector;
    const detail::Mask8 inside =
        (range >= Float8(static_cast<float>(config_.ground_min_range))) &
        (range <= Float8(static_cast<float>(config_.ground_max_range)));
    return select(inside, patch, Int8(static_cast<std::int32_t>(kPatches)));
  }

  // Marks the ground points of one patch and returns how many there are.
  std::size_t segment_patch(std::size_t patch) {
    const std::size_t begin = patch_begin_[patch];
    const std::size_t end = patch_begin_[patch + 1];
    std::uint8_t* const flags = is_ground_.data() + begin;
    const auto reject = [&] {
      std::fill(flags, flags + (end - begin), std::uint8_t{0});
      return std::size_t{0};
    };
    if (end - begin < static_cast<std::size_t>(config_.ground_min_points)) return reject();

    const bool innermost_zone = patch < static_cast<std::size_t>(kRings[0] * kSectors[0]);
    const double h = height_;
    const float floor = innermost_zone ? static_cast<float>(-(1.0 + config_.ground_below) * h)
                                       : -std::numeric_limits<float>::infinity();
    const float seed_height = lowest_mean(begin, end, floor);

    // First fit: the points near the seed height, as a horizontal half space; then the plane.
    const float x0 = sorted_.x[begin];
    const float y0 = sorted_.y[begin];
    HalfSpace below{0.0F, 0.0F, 1.0F, static_cast<float>(config_.ground_seed_margin)};
    detail::Plane plane;
    for (int i = 0; i < config_.ground_iterations; ++i) {
      const detail::PlaneMoments moments = sum_moments(begin, end, x0, y0, seed_height, below);
      if (moments.count < 3.0) return reject();
      plane = detail::fit_plane(moments);
      below = {static_cast<float>(plane.normal_x), static_cast<float>(plane.normal_y),
               static_cast<float>(plane.normal_z),
               static_cast<float>(config_.ground_distance + plane.normal_x * plane.mean_x +
                                  plane.normal_y * plane.mean_y + plane.normal_z * plane.mean_z)};
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

    std::size_t count = 0;
    for (std::size_t i = begin; i < end; i += detail::kLanes) {
      const std::size_t lanes = std::min(detail::kLanes, end - i);
      const unsigned bits =
          (inside(i, x0, y0, seed_height, below) & detail::first_lanes(lanes)).bits();
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        const auto bit = static_cast<std::uint8_t>((bits >> lane) & 1U);
        is_ground_[i + lane] = bit;
        count += bit;
      }
    }
    return count;
  }

  // Points with normal . (p - origin) < offset.
  struct HalfSpace {
    float x, y, z, offset;
  };

  detail::Mask8 inside(std::size_t i, float x0, float y0, float z0, const HalfSpace& space) const {
    using detail::Float8;
    const Float8 x = Float8::load(&sorted_.x[i]) - Float8(x0);
    const Float8 y = Float8::load(&sorted_.y[i]) - Float8(y0);
    const Float8 z = Float8::load(&sorted_.z[i]) - Float8(z0);
    return Float8(space.x) * x + Float8(space.y) * y + Float8(space.z) * z < Float8(space.offset);
  }

  detail::PlaneMoments sum_moments(std::size_t begin, std::size_t end, float x0, float y0,
                                   float z0, const HalfSpace& space) const {
    using detail::Float8;
    Float8 count(0.0F);
    Float8 sx(0.0F), sy(0.0F), sz(0.0F);
    Float8 sxx(0.0F), sxy(0.0F), sxz(0.0F), syy(0.0F), syz(0.0F), szz(0.0F);
    for (std::size_t i = begin; i < end; i += detail::kLanes) {
      Float8 x = Float8::load(&sorted_.x[i]) - Float8(x0);
      Float8 y = Float8::load(&sorted_.y[i]) - Float8(y0);
      Float8 z = Float8::load(&sorted_.z[i]) - Float8(z0);
      detail::Mask8 member =
          Float8(space.x) * x + Float8(space.y) * y + Float8(space.z) * z < Float8(space.offset);
      if (end - i < detail::kLanes) member = member & detail::first_lanes(end - i);
      x = keep(member, x);
      y = keep(member, y);
      z = keep(member, z);
      count = count + keep(member, Float8(1.0F));
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
    return {sum(count), sum(sx),  sum(sy),  sum(sz),  sum(sxx),
            sum(sxy),   sum(sxz), sum(syy), sum(syz), sum(szz)};
  }

  // Mean height of the lowest points that are not below `floor`; all of them if there are fewer.
  // Exact selection: a short sorted list, which hardly any point enters after the first few.
  float lowest_mean(std::size_t begin, std::size_t end, float floor) {
    const auto wanted = static_cast<std::size_t>(config_.ground_lowest_points);
    std::array<float, 65> lowest;
    std::size_t found = 0;
    float limit = std::numeric_limits<float>::infinity();
    for (std::size_t i = begin; i < end; i += detail::kLanes) {
      const detail::Float8 z = detail::Float8::load(&sorted_.z[i]);
      detail::Mask8 candidate = (z < detail::Float8(limit)) & (z >= detail::Float8(floor));
      if (end - i < detail::kLanes) candidate = candidate & detail::first_lanes(end - i);
      unsigned bits = candidate.bits();
      for (; bits != 0; bits &= bits - 1) {
        const float value = sorted_.z[i + static_cast<std::size_t>(__builtin_ctz(bits))];
        if (!(value < limit)) continue;
        std::size_t at = found < wanted ? found++ : wanted - 1;
        for (; at > 0 && lowest[at - 1] > value; --at) lowest[at] = lowest[at - 1];
        lowest[at] = value;
        if (found == wanted) limit = lowest[wanted - 1];
      }
    }
    if (found == 0) return floor;
    float total = 0.0F;
    for (std::size_t i = 0; i < found; ++i) total += lowest[i];
    return total / static_cast<float>(found);
  }

  void partition(GroundSplit& split) const {
    std::size_t next[2] = {split.ground_count, 0};
    for (std::size_t i = 0; i < split.count; ++i) {
      const std::size_t to = next[is_ground_[i]]++;
      split.points.x[to] = sorted_.x[i];
      split.points.y[to] = sorted_.y[i];
      split.points.z[to] = sorted_.z[i];
      split.source[to] = source_[i];
    }
  }

  Config config_;
  double height_ = 0.0;  // m
  std::array<Zone, kZones> zones_{};
  std::array<std::int32_t, kPatches> ring_of_patch_{};
  std::array<std::size_t, kPatches + 2> patch_begin_{};
  std::vector<std::int32_t> patch_of_;
  std::vector<std::uint8_t> is_ground_;
  PointBuffer sorted_;
  std::vector<std::uint32_t> source_;
};

}  // namespace dynains
