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
#include <vector>

#include "dynains/detail/arc_tangent.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/detail/lowest_mean.hpp"
#include "dynains/detail/patch_heights.hpp"
#include "dynains/detail/patch_sort.hpp"
#include "dynains/detail/plane_fit.hpp"
#include "dynains/detail/point_record.hpp"
#include "dynains/detail/room.hpp"
#include "dynains/detail/wide_lanes.hpp"
#include "dynains/detail/zone_table.hpp"
#include "dynains/ground_config.hpp"
#include "dynains/ground_split.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor_model.hpp"

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
    detail::grow(patch_of_, scan.size() + detail::kLanes);
    find_patches(scan);
    sorted_.sort(scan, input.data(), patch_of_.data());
    patch_.grow(scan.size() + detail::kLanes);
    heights_.clear();
    split.resize(scan.size());
    detail::run_lanes([&](auto lanes) {
      using Lanes = decltype(lanes);
      Output<Lanes> out(split);
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
  template <class Lanes>
  class Output {
   public:
    explicit Output(GroundSplit& split)
        : x_(split.points.x.data()),
          y_(split.points.y.data()),
          z_(split.points.z.data()),
          input_(split.input.data()) {}

    std::size_t count() const { return count_; }

    void put(const detail::PointRecord* from, std::size_t count) {
      for (std::size_t i = 0; i < count; i += detail::kLanes) put_eight(from + i, i);
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
    void put_eight(const detail::PointRecord* from, std::size_t ahead) {
      const auto columns = detail::load_columns<Lanes>(from);
      const std::size_t at = count_ + ahead;
      columns[0].store(x_ + at);
      columns[1].store(y_ + at);
      columns[2].store(z_ + at);
      columns[3].store(reinterpret_cast<float*>(input_) + at);
    }

    std::size_t count_ = 0;
    float* const x_;
    float* const y_;
    float* const z_;
    std::uint32_t* const input_;
  };

  void find_patches(PointsView scan) {
    detail::run_lanes([&](auto lanes) {
      using Lanes = decltype(lanes);
      using Float = typename Lanes::Float;
      using Int = typename Lanes::Int;
      // Read once: the compiler cannot know that stores leave members alone.
      using detail::Constant8;
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
      const std::array<Constant8, kZones - 1> edges = {zones_[1].inner, zones_[2].inner,
                                                       zones_[3].inner};
      const Constant8 nearest(static_cast<float>(config_.ground_min_range));
      const Constant8 farthest(static_cast<float>(config_.ground_max_range));
      const Constant8 pi(detail::kPi);
      const Constant8 one(1.0F);
      const float* const xs = scan.x.data();
      const float* const ys = scan.y.data();
      std::int32_t* const patches = patch_of_.data();
      detail::for_places<Lanes>(scan.size(), [&](auto at) {
        const Float x = at.load(xs);
        const Float y = at.load(ys);
        const Float range = sqrt(x * x + y * y);
        const Float azimuth = detail::azimuth_of(y, x, range) + pi;
        const detail::BeyondEdges<typename Lanes::Mask> beyond = {
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

  // Points with normal . (p - origin) < offset; the origin of the fit is near the points.
  struct HalfSpace {
    HalfSpace(float origin_z, float distance) : z0(origin_z), offset(distance) {}

    detail::Constant8 z0;
    detail::Constant8 x = 0.0F, y = 0.0F, z = 1.0F, offset;

    template <class Lanes>
    std::array<typename Lanes::Float, 3> local(const PointBuffer& points, std::size_t i) const {
      using Float = typename Lanes::Float;
      return {Float::load(&points.x[i]), Float::load(&points.y[i]), Float::load(&points.z[i]) - z0};
    }
    template <class Float>
    auto inside(const std::array<Float, 3>& p) const {
      return x * p[0] + y * p[1] + z * p[2] < offset;
    }
  };

  using PatchCounts = std::array<std::size_t, kPatches + 1>;

  std::size_t size_of(std::size_t patch) const { return sorted_.end(patch) - sorted_.begin(patch); }

  // Ground that hangs goes back to the rest of its patch. From the last one on, so that what takes
  // the place of a patch is ground for good.
  template <class Lanes>
  void take_back_hanging(const PatchCounts& begin, PatchCounts& rest, Output<Lanes>& ground) {
    const auto step = static_cast<float>(config_.ground_step);
    for (std::size_t p = kSteppedPatches; p-- > 0;) {
      const std::size_t found = begin[p + 1] - begin[p];
      if (found == 0 || !heights_.hangs(p, step)) continue;
      ground.take_back(begin[p], found, sorted_.records() + sorted_.begin(p) + rest[p]);
      rest[p] += found;
    }
  }

  // Points of a patch that are ground.
  enum class Found { kNone, kSome, kAll };

  // Puts the ground of a patch; the rest closes up at its front. Returns the size of the rest.
  template <class Lanes>
  std::size_t segment_patch(std::size_t patch, detail::PointRecord* records, std::size_t count,
                            Output<Lanes>& ground) {
    if (count < static_cast<std::size_t>(config_.ground_min_points)) return count;
    lay_out<Lanes>(records, count);
    detail::LowestMean<GroundConfig::kMaxLowest, Lanes> lowest(
        static_cast<std::size_t>(config_.ground_lowest_points));
    const float seed_height = lowest.of(patch_.z.data(), count, floor_of(patch));
    HalfSpace below(seed_height, static_cast<float>(config_.ground_seed_margin));
    const Found found_ground = fit_ground<Lanes>(patch, count, seed_height, below);
    if (found_ground == Found::kNone) return count;
    if (found_ground == Found::kAll) {
      ground.put(records, count);
      return 0;
    }

    std::size_t rest = 0;
    for (std::size_t i = 0; i < count; i += detail::kLanes) {
      const std::size_t length = std::min(detail::kLanes, count - i);
      const unsigned all = (1U << length) - 1U;
      const unsigned bits = below.inside(below.template local<Lanes>(patch_, i)).bits();
      if (bits == all) {
        ground.put(records + i, length);
      } else if (bits == 0) {
        detail::move_to_front(records + i, length, records + rest);
        rest += length;
      } else {
        // Written to both places, since no branch could foretell the right one.
        detail::PointRecord inside[detail::kLanes] = {};
        std::size_t found = 0;
        for (std::size_t k = 0; k < length; ++k) {
          const unsigned bit = (bits >> k) & 1U;
          detail::copy_record(records + i + k, inside + found);
          detail::copy_record(records + i + k, records + rest);
          found += bit;
          rest += 1U - bit;
        }
        ground.put(inside, found);
      }
    }
    return rest;
  }

  // Height below which points of the patch are noise.
  float floor_of(std::size_t patch) const {
    const bool innermost_zone = static_cast<std::int32_t>(patch) < kRings[0] * kSectors[0];
    return innermost_zone ? static_cast<float>(-(1.0 + config_.ground_below) * height_)
                          : -std::numeric_limits<float>::infinity();
  }

  // From the points near the seed height, a horizontal half space, to those near the plane. Returns
  // how many of the patch these are if they are ground.
  template <class Lanes>
  Found fit_ground(std::size_t patch, std::size_t count, float seed_height, HalfSpace& below) {
    detail::Plane plane;
    bool is_whole = false;
    for (int i = 0; i < config_.ground_iterations; ++i) {
      const detail::PlaneMoments moments = sum_moments<Lanes>(patch_, count, below);
      if (moments.count < 3.0) return Found::kNone;
      plane = detail::fit_plane(moments);
      below.x = static_cast<float>(plane.normal_x);
      below.y = static_cast<float>(plane.normal_y);
      below.z = static_cast<float>(plane.normal_z);
      below.offset =
          static_cast<float>(config_.ground_distance + plane.normal_x * plane.mean_x +
                             plane.normal_y * plane.mean_y + plane.normal_z * plane.mean_z);
      // From the same points, the next plane would be the same.
      is_whole = moments.count == static_cast<double>(count) && contains<Lanes>(below, count);
      if (is_whole) break;
    }
    if (!is_ground(patch, plane, seed_height)) return Found::kNone;
    heights_.set(patch, static_cast<float>(plane.mean_z + static_cast<double>(seed_height)));
    return is_whole ? Found::kAll : Found::kSome;
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

  // Whether all points of the patch are inside.
  template <class Lanes>
  bool contains(const HalfSpace& space, std::size_t count) const {
    for (std::size_t i = 0; i < count; i += detail::kLanes) {
      const unsigned all = (1U << std::min(detail::kLanes, count - i)) - 1U;
      if (space.inside(space.template local<Lanes>(patch_, i)).bits() != all) return false;
    }
    return true;
  }

  // The points of a patch; x and y relative to an origin near them.
  template <class Lanes>
  void lay_out(const detail::PointRecord* records, std::size_t count) {
    using Float = typename Lanes::Float;
    const Float x0(records->x);
    const Float y0(records->y);
    float* const x = patch_.x.data();
    float* const y = patch_.y.data();
    float* const z = patch_.z.data();
    for (std::size_t i = 0; i < count; i += detail::kLanes) {
      const auto columns = detail::load_columns<Lanes>(records + i);
      (columns[0] - x0).store(x + i);
      (columns[1] - y0).store(y + i);
      columns[2].store(z + i);
    }
    // Behind the last one, there is nothing that is low or below a plane.
    Float(std::numeric_limits<float>::infinity()).store(z + count);
  }

  template <class Lanes>
  static detail::PlaneMoments sum_moments(const PointBuffer& points, std::size_t count,
                                          const HalfSpace& space) {
    static constexpr detail::Constant8 kZero(0.0F), kOne(1.0F);
    using Float = typename Lanes::Float;
    Float n = kZero, sx = kZero, sy = kZero, sz = kZero, sxx = kZero, sxy = kZero, sxz = kZero,
          syy = kZero, syz = kZero, szz = kZero;
    for (std::size_t i = 0; i < count; i += detail::kLanes) {
      const auto p = space.template local<Lanes>(points, i);
      const auto member = space.inside(p);
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

  Config config_;
  double height_ = 0.0;  // m
  std::array<Zone, kZones> zones_{};
  std::array<std::int32_t, kPatches> ring_of_patch_{};
  std::vector<std::int32_t> patch_of_;
  detail::PatchSort<kPatches + 1> sorted_;  // the last for points that are in no patch
  PointBuffer patch_;                       // the points of one patch
  detail::PatchHeights<kPatches> heights_{kRings, kSectors};
};

}  // namespace dynains
