// How high the ground of a patch lies, compared with that of the patches around it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace dynains::detail {

/// Heights of the ground in patches of concentric zones, which count from the inside out, ring by
/// ring, then by sector.
template <std::size_t kPatches>
class PatchHeights {
 public:
  /// Rings of each zone, and sectors of each of its rings.
  template <std::size_t kZones>
  PatchHeights(const std::array<std::int32_t, kZones>& rings,
               const std::array<std::int32_t, kZones>& sectors) {
    std::vector<Ring> all;
    std::int32_t first = 0;
    for (std::size_t zone = 0; zone < kZones; ++zone) {
      for (std::int32_t ring = 0; ring < rings[zone]; ++ring) {
        all.push_back({first, sectors[zone]});
        first += sectors[zone];
      }
    }
    clear();
    for (std::size_t ring = 0; ring < all.size(); ++ring) {
      for (std::int32_t sector = 0; sector < all[ring].sectors; ++sector) {
        Around& around = around_[all[ring].patch(sector)];
        around.fill(kPatches);
        auto next = around.begin();
        for (const std::int32_t step : {-1, 1}) *next++ = all[ring].patch(sector + step);
        for (const std::size_t other : {ring - 1, ring + 1}) {  // the first wraps to none
          if (other >= all.size()) continue;
          const std::int32_t beside =
              (2 * sector + 1) * all[other].sectors / (2 * all[ring].sectors);
          for (const std::int32_t step : {-1, 0, 1}) *next++ = all[other].patch(beside + step);
        }
      }
    }
  }

  /// Nothing is known of any patch.
  void clear() { heights_.fill(kNone); }
  void set(std::size_t patch, float height) { heights_[patch] = height; }

  /// Whether a patch lies more than `step` (m) over most of the patches around it: those beside it
  /// in its ring, and three in each of the next rings. On a slope, as many are higher as are lower.
  /// Not if less than four of them hold ground.
  bool hangs(std::size_t patch, float step) const {
    constexpr int kFewest = 4;
    const float limit = heights_[patch] - step;
    int known = 0;
    int lower = 0;
    for (const std::size_t other : around_[patch]) {
      known += std::isnan(heights_[other]) ? 0 : 1;
      lower += heights_[other] < limit ? 1 : 0;
    }
    return known >= kFewest && 2 * lower > known;
  }

 private:
  static constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

  struct Ring {
    std::int32_t first;  // patch
    std::int32_t sectors;
    std::size_t patch(std::int32_t sector) const {
      const std::int32_t number = first + (sector + sectors) % sectors;
      return static_cast<std::size_t>(number);
    }
  };
  using Around = std::array<std::size_t, 8>;  // kPatches stands for none

  std::array<float, kPatches + 1> heights_;  // m, of the sensor's frame; the last is of none
  std::array<Around, kPatches> around_;
};

}  // namespace dynains::detail
