// Patches around the sensor: four concentric zones, divided into rings and sectors (Patchwork).
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "dynains/points.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Numbers patches from the inside out: by zone, ring, and azimuth from -pi on.
class ConcentricZones {
 public:
  static constexpr std::size_t kZones = 4;
  /// Rings of each zone, and sectors of each ring of the zone (Patchwork).
  static constexpr std::array<std::int32_t, kZones> kRings = {2, 4, 4, 4};
  static constexpr std::array<std::int32_t, kZones> kSectors = {16, 32, 54, 32};
  static constexpr std::size_t kPatches = 2 * 16 + 4 * 32 + 4 * 54 + 4 * 32;
  /// Adjacent patches: two in the same ring, three in each adjacent ring. kPatches fills the array
  /// for patches of the first and the last ring.
  using Neighbours = std::array<std::size_t, 8>;

  /// Zones between two distances from the sensor (m).
  ConcentricZones(double min_range, double max_range)
      : min_range_(static_cast<float>(min_range)), max_range_(static_cast<float>(max_range)) {
    const std::array<double, kZones + 1> edges = {min_range, (7 * min_range + max_range) / 8,
                                                  (3 * min_range + max_range) / 4,
                                                  (min_range + max_range) / 2, max_range};
    std::int32_t patch = 0;
    std::size_t ring = 0;
    for (std::size_t i = 0; i < kZones; ++i) {
      zones_.inner_edge[i] = static_cast<float>(edges[i]);
      zones_.rings_per_metre[i] = static_cast<float>(kRings[i] / (edges[i + 1] - edges[i]));
      zones_.sectors_per_radian[i] = static_cast<float>(kSectors[i] / (2.0 * M_PI));
      zones_.first_patch[i] = static_cast<float>(patch);
      zones_.last_ring[i] = static_cast<float>(kRings[i] - 1);
      zones_.sectors[i] = static_cast<float>(kSectors[i]);
      for (std::int32_t k = 0; k < kRings[i]; ++k, ++ring, patch += kSectors[i]) {
        rings_[ring] = {patch, kSectors[i]};
      }
    }
    for (ring = 0; ring < rings_.size(); ++ring) find_neighbours(ring);
  }

  /// Number of the ring of a patch, counted over all zones.
  std::size_t ring(std::size_t patch) const { return ring_of_patch_[patch]; }

  const Neighbours& neighbours(std::size_t patch) const { return neighbours_[patch]; }

  /// Writes the patch of each point (m, sensor frame), kPatches for points outside the zones, and
  /// kPatches + 1 for points below `lowest` (m). `patch_of` must have room for kPackWidth more
  /// numbers.
  void find_patches(PointsView points, float lowest, std::int32_t* patch_of) const {
    with_packs([&](auto packs) {
      using Packs = decltype(packs);
      using Float = typename Packs::Float;
      using Int = typename Packs::Int;
      // A local copy: the compiler must assume that a store changes members.
      const Zones zones = zones_;
      const PackConstant min_range(min_range_), max_range(max_range_), bottom(lowest), pi(kPi),
          one(1.0F);
      const float* const xs = points.x.data();
      const float* const ys = points.y.data();
      std::int32_t* const patches = patch_of;
      for_slices<Packs>(0, points.size(), [&](auto at) {
        const Float x = at.load(xs);
        const Float y = at.load(ys);
        const Float range = sqrt(x * x + y * y);
        const Float azimuth = azimuth_of(y, x, range) + pi;
        const std::array<typename Packs::Mask, kZones> is_in_or_beyond = {
            range >= Float(zones.inner_edge[0]), range >= Float(zones.inner_edge[1]),
            range >= Float(zones.inner_edge[2]), range >= Float(zones.inner_edge[3])};
        // A constant of the zone of each point.
        const auto here = [&](const ByZone& values) {
          Float result(values[0]);
          for (std::size_t i = 1; i < kZones; ++i) {
            result = select(is_in_or_beyond[i], Float(values[i]), result);
          }
          return result;
        };
        const auto whole = [](const Float& value) { return to_float(truncate(value)); };
        const Float depth = min(range, max_range) - here(zones.inner_edge);
        const Float ring = whole(min(depth * here(zones.rings_per_metre), here(zones.last_ring)));
        const Float sectors = here(zones.sectors);
        const Float sector = whole(min(azimuth * here(zones.sectors_per_radian), sectors - one));
        const Float patch = here(zones.first_patch) + ring * sectors + sector;
        const auto inside = (range >= min_range) & (range <= max_range);
        const Int outside(static_cast<std::int32_t>(kPatches));
        select(at.load(points.z.data()) < bottom, outside + Int(1),
               select(inside, truncate(patch), outside))
            .store(patches + at.begin);
      });
    });
  }

 private:
  using ByZone = std::array<float, kZones>;
  struct Zones {  // small whole numbers are exact in floats
    ByZone inner_edge;
    ByZone rings_per_metre;
    ByZone sectors_per_radian;
    ByZone first_patch;
    ByZone last_ring;
    ByZone sectors;
  };

  struct Ring {
    std::int32_t first_patch;
    std::int32_t sectors;
    std::size_t patch(std::int32_t sector) const {
      const std::int32_t patch = first_patch + (sector + sectors) % sectors;
      return static_cast<std::size_t>(patch);
    }
  };

  void find_neighbours(std::size_t ring) {
    for (std::int32_t sector = 0; sector < rings_[ring].sectors; ++sector) {
      const std::size_t patch = rings_[ring].patch(sector);
      ring_of_patch_[patch] = ring;
      neighbours_[patch].fill(kPatches);
      auto next = neighbours_[patch].begin();
      for (const std::int32_t step : {-1, 1}) *next++ = rings_[ring].patch(sector + step);
      for (const std::size_t other : {ring - 1, ring + 1}) {  // below 0, it wraps around
        if (other >= rings_.size()) continue;
        const std::int32_t nearest =
            (2 * sector + 1) * rings_[other].sectors / (2 * rings_[ring].sectors);
        for (const std::int32_t step : {-1, 0, 1}) *next++ = rings_[other].patch(nearest + step);
      }
    }
  }

  float min_range_;  // m
  float max_range_;  // m
  Zones zones_{};
  std::array<Ring, kRings[0] + kRings[1] + kRings[2] + kRings[3]> rings_{};
  std::array<std::size_t, kPatches> ring_of_patch_{};
  std::array<Neighbours, kPatches> neighbours_{};
};

}  // namespace dynains::detail
