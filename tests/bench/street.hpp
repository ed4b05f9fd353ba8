// Scans for benchmarks: a long lane between pillars with one van.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "dynains/points.hpp"
#include "support/scene.hpp"

namespace dynains::bench {

/// Scans of about 110,000 points, at 10 Hz and 10 m/s. Made once.
inline const std::vector<test::Scan>& street_scans() {
  static const std::vector<test::Scan> scans = [] {
    test::Scene scene;
    for (int i = -5; i < 12; ++i) {
      for (const double y : {-14.0, -9.0, 9.0, 14.0}) {
        scene.boxes.push_back({{8.0 * i - 1.0, y - 1.5, 0.0}, {8.0 * i + 1.5, y + 1.0, 4.0}});
      }
    }
    scene.boxes.push_back(test::van(12.0, 3.5, {-6.0, 0.0, 0.0}));
    return test::drive(scene, 16, 10.0);
  }();
  return scans;
}

inline PointBuffer buffer_of(const test::Scan& scan) {
  PointBuffer result;
  for (const Eigen::Vector3f& p : scan.points) result.push_back(p.x(), p.y(), p.z());
  return result;
}

/// Value below which a `share` of the values lies.
inline double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace dynains::bench
