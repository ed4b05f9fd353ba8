// Measured points of a scan.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Whether a beam has a return (x y z): finite, and not at the origin.
inline bool is_measured(const float* p) {
  return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]) &&
         (p[0] != 0.0F || p[1] != 0.0F || p[2] != 0.0F);
}

/// Calls `change(p)` with the position of each point of a scan, to change it in place.
template <class Change>
void for_each_position(RecordedScan& scan, Change&& change) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    change(Eigen::Map<Eigen::Vector3f>(scan.xyzi.data() + 4 * i));
  }
}

/// Copies every `step`-th point (m, sensor frame) of a scan, but leaves out points that are not
/// finite or lie at the origin.
inline PointBuffer finite_points(const RecordedScan& scan, std::size_t step = 1) {
  PointBuffer points;
  for (auto* const axis : {&points.x, &points.y, &points.z}) axis->reserve(scan.size() / step + 1);
  for (std::size_t i = 0; i < scan.size(); i += step) {
    const float* p = scan.xyzi.data() + 4 * i;
    if (is_measured(p)) points.push_back(p[0], p[1], p[2]);
  }
  return points;
}

/// The step of a sample of about 40,000 points of a scan. It is odd: scans list their beams in
/// turn, and their number is even, so an even step would leave out half of the beams.
inline std::size_t sample_step(const RecordedScan& scan) { return 1 + 2 * (scan.size() / 80000); }

/// A sample of the measured points of a scan, m, sensor frame.
inline PointBuffer sampled_points(const RecordedScan& scan) {
  return finite_points(scan, sample_step(scan));
}

}  // namespace dynains
