// Polar points given by hand in degrees, or drawn at random.
#pragma once

#include "dynains/clusters/cluster_set.hpp"
#include "support/standard.hpp"

namespace dynains::test {

constexpr double kRadiansPerDegree = M_PI / 180.0;

inline void add(PolarBuffer& points, double range, double azimuth_degrees, double z) {
  const std::size_t at = points.size();
  points.resize(at + 1);
  points.range[at] = static_cast<float>(range);
  points.azimuth[at] = static_cast<float>(azimuth_degrees * kRadiansPerDegree);
  points.z[at] = static_cast<float>(z);
}

/// Points of some ranges, one after the other.
inline PolarBuffer gathered(PolarView window, Span<const PointRange> ranges) {
  PolarBuffer result;
  for (const PointRange& part : ranges) {
    for (std::size_t i = part.begin; i < part.end; ++i) {
      const std::size_t at = result.size();
      result.resize(at + 1);
      result.range[at] = window.range[i];
      result.azimuth[at] = window.azimuth[i];
      result.z[at] = window.z[i];
    }
  }
  return result;
}

/// Distance of `value` from the nearest whole number.
inline double off_integer(double value) { return std::abs(value - std::round(value)); }

}  // namespace dynains::test
