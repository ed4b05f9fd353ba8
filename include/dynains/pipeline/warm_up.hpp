// Scans that are pushed and forgotten, so that buffers have their sizes before the first real scan.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace dynains::detail {

/// Coordinates x, y, z of `points` points: a street between two walls, scanned ring by ring. Half
/// of them are ground, as on most scans.
inline std::vector<float> synthetic_scan(std::size_t points) {
  constexpr double kHeight = 1.7, kHalfStreet = 12.0, kFarthest = 60.0;  // m
  constexpr std::size_t kRings = 64;
  const std::size_t in_ring = points / kRings + 1;
  std::vector<float> xyz;
  xyz.reserve(3 * points);
  for (std::size_t i = 0; i < points; ++i) {
    const double azimuth =
        2.0 * M_PI * static_cast<double>(i % in_ring) / static_cast<double>(in_ring);
    const std::size_t ring = i / in_ring;
    const double share = static_cast<double>(ring) / static_cast<double>(kRings);
    const double slope = 0.1 - 0.5 * share;  // of the beam
    const double to_wall = std::min(kHalfStreet / std::abs(std::sin(azimuth)), kFarthest);
    const double to_ground = slope < 0.0 ? -kHeight / slope : kFarthest;
    const double range = std::min(to_wall, to_ground);
    xyz.push_back(static_cast<float>(range * std::cos(azimuth)));
    xyz.push_back(static_cast<float>(range * std::sin(azimuth)));
    xyz.push_back(static_cast<float>(range * slope));
  }
  return xyz;
}

/// While it lives, scans that are pushed do not enter the map, which may be on a disk; at its end
/// the pipeline forgets them.
template <class Pipeline>
class WarmUp {
 public:
  explicit WarmUp(Pipeline& pipeline) : pipeline_(pipeline) { pipeline_.build_map_ = false; }
  WarmUp(const WarmUp&) = delete;
  WarmUp& operator=(const WarmUp&) = delete;
  ~WarmUp() {
    pipeline_.build_map_ = pipeline_.config_.build_map;
    pipeline_.forget_scans();
  }

 private:
  Pipeline& pipeline_;
};

}  // namespace dynains::detail
