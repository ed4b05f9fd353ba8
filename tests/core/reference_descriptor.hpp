// Direct implementation of Eq. 5-11: sets of points, double precision, the smallest arc by sorting.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "dynains/descriptors/occupancy_descriptor.hpp"
#include "polar_test_points.hpp"

namespace dynains::test {

struct ReferenceDescriptor {
  std::size_t radial_cells = 0;              // N_r
  std::size_t azimuth_cells = 0;             // N_theta
  std::vector<std::vector<double>> heights;  // H_k of each scan, then of scans 0 to k together
  double similarity = 0.0;                   // d
};

/// Empty if a point or an extent is so near to a border that float and double may differ, or if two
/// gaps between the points have almost equal widths.
inline std::optional<ReferenceDescriptor> describe(const OccupancyDescriptor::Config& config,
                                                   const ClusterView& cluster) {
  constexpr double kMargin = 1e-3;
  const double s_r = config.cell_range;
  const double s_theta = config.cell_azimuth * kRadiansPerDegree;
  const PolarBuffer all = gathered(cluster.window, cluster.ranges);
  const PolarView points = all.view();
  const double r_min = *std::min_element(points.range.begin(), points.range.end());
  const double r_max = *std::max_element(points.range.begin(), points.range.end());
  const double z_min = *std::min_element(points.z.begin(), points.z.end());

  // The smallest arc that contains all points begins after the widest gap between neighbours.
  std::vector<double> sorted(points.azimuth.begin(), points.azimuth.end());
  std::sort(sorted.begin(), sorted.end());
  double theta_min = sorted.front();
  double widest = sorted.front() + 2.0 * M_PI - sorted.back();
  double second = 0.0;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const double gap = sorted[i] - sorted[i - 1];
    if (gap > widest) {
      second = widest;
      widest = gap;
      theta_min = sorted[i];
    } else {
      second = std::max(second, gap);
    }
  }
  constexpr double kClear = 3.0 * 2.0 * M_PI / 1024.0;
  if (widest < M_PI && widest - second < kClear) return {};
  const double arc = 2.0 * M_PI - widest;

  ReferenceDescriptor result;
  const auto cells = [&](double extent) {
    return static_cast<std::size_t>(std::max(1.0, std::ceil(extent)));
  };
  if (points.size() > 1 &&
      (off_integer((r_max - r_min) / s_r) < kMargin || off_integer(arc / s_theta) < kMargin)) {
    return {};
  }
  result.radial_cells = cells((r_max - r_min) / s_r);
  result.azimuth_cells = cells(arc / s_theta);
  const std::size_t count = result.radial_cells * result.azimuth_cells;
  const std::size_t scans = cluster.scan_count();
  result.heights.assign(2 * scans, std::vector<double>(count, 0.0));
  for (std::size_t k = 0; k < scans; ++k) {
    const PolarBuffer observed = gathered(cluster.window, cluster.scan(k));
    const PolarView scan = observed.view();
    for (std::size_t p = 0; p < scan.size(); ++p) {
      double offset = scan.azimuth[p] - theta_min;
      if (offset < 0.0) offset += 2.0 * M_PI;
      const double i = (scan.range[p] - r_min) / s_r;
      const double j = offset / s_theta;
      if ((i > 0.0 && off_integer(i) < kMargin) || (j > 0.0 && off_integer(j) < kMargin)) return {};
      const std::size_t cell =
          static_cast<std::size_t>(i) * result.azimuth_cells + static_cast<std::size_t>(j);
      const auto raise = [&](std::size_t set) {
        double& height = result.heights[set][cell];
        height = std::max(height, scan.z[p] - z_min);
      };
      raise(k);
      for (std::size_t later = k; later < scans; ++later) raise(scans + later);
    }
  }
  double dot = 0.0, aa = 0.0, bb = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double a = result.heights[0][i];
    const double b = result.heights[scans - 1][i];
    dot += a * b;
    aa += a * a;
    bb += b * b;
  }
  result.similarity = dot / std::sqrt(aa * bb);
  return result;
}

}  // namespace dynains::test
