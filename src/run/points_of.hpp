// Recorded scans as the clouds that removers take.
#pragma once

#include <cstddef>

#include "dynains/io/recording.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"

namespace dynains::program {

inline RawPoints<float> points_of(const RecordedScan& scan) {
  return {scan.xyzi.data(), scan.size(), 4};
}

/// Copies the coordinates of a scan.
inline void copy_points(const RecordedScan& scan, PointBuffer& points) {
  const std::size_t size = scan.size();
  points.resize(size);
  const float* const from = scan.xyzi.data();
  float* const x = points.x.data();
  float* const y = points.y.data();
  float* const z = points.z.data();
  for (std::size_t i = 0; i < size; ++i) {
    x[i] = from[4 * i];
    y[i] = from[4 * i + 1];
    z[i] = from[4 * i + 2];
  }
}

}  // namespace dynains::program
