#include "own_body_range.hpp"

#include <algorithm>
#include <vector>

#include "dynains/sensor/own_body.hpp"
#include "io/points/finite_points.hpp"

namespace dynains::program {

double own_body_range(const Recording& recording, const ScanRange& range, double otherwise) {
  constexpr std::size_t kScans = 24;
  constexpr double kLeastMotion = 5.0;  // m
  const std::size_t count = std::min(kScans, range.size());
  std::vector<PointBuffer> scans;
  RecordedScan scan;
  double motion = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = range.first + (count == 1 ? 0 : k * (range.size() - 1) / (count - 1));
    motion = std::max(motion, (recording.T_world_sensor(i).translation() -
                               recording.T_world_sensor(range.first).translation())
                                  .norm());
    recording.read_scan(i, scan);
    scans.push_back(finite_points(scan));
  }
  if (motion < kLeastMotion) return otherwise;
  const OwnBody body = estimate_own_body(scans);
  return body.known ? std::min(body.min_range(), otherwise) : otherwise;
}

}  // namespace dynains::program
