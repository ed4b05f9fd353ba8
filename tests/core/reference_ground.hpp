// A slow implementation of Patchwork: double precision, libm, sorting and Eigen's eigenvalue
// solver. Two rules are additions to Patchwork: planes are fitted to some points of a patch, and
// patches far above their neighbours are not ground.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <vector>

#include "dynains/ground/ground_segmenter.hpp"

namespace dynains::test {

/// Points to which the plane of a patch is fitted: all, or runs of eight.
inline std::vector<std::size_t> reference_fit_points(const std::vector<std::size_t>& points,
                                                     std::size_t most) {
  if (points.size() <= most) return points;
  std::vector<std::size_t> result;
  const std::size_t runs = most / 8;
  for (std::size_t run = 0; run < runs; ++run) {
    const std::size_t begin = run * points.size() / runs;
    for (std::size_t i = begin; i < begin + 8; ++i) result.push_back(points[i]);
  }
  return result;
}

/// True for every point of the scan that is ground.
inline std::vector<bool> reference_ground(const GroundSegmenter::Config& config, PointsView scan) {
  const double inner = config.ground_min_range;
  const double outer = config.ground_max_range;
  const double edges[5] = {inner, (7 * inner + outer) / 8, (3 * inner + outer) / 4,
                           (inner + outer) / 2, outer};
  struct Patch {
    bool is_innermost_zone = false;
    std::size_t ring = 0;  // counted from the inside over all zones
    std::vector<std::size_t> points;
    bool is_ground = false;
    double height = 0.0;  // of its ground
    std::vector<std::size_t> members;
  };
  std::map<std::vector<int>, Patch> patches;  // by zone, ring in it and sector
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double range = std::hypot(scan.x[i], scan.y[i]);
    if (range < inner || range > outer) continue;
    const bool is_noise =
        config.noise_depth > 0.0 &&
        static_cast<double>(scan.z[i]) < -config.noise_depth * config.sensor_height;
    if (is_noise) continue;
    int zone = 3;
    while (range < edges[zone]) --zone;
    const auto z = static_cast<std::size_t>(zone);
    const int rings = detail::ConcentricZones::kRings[z];
    const int sectors = detail::ConcentricZones::kSectors[z];
    const double depth = (edges[zone + 1] - edges[zone]) / rings;
    const double width = 2.0 * M_PI / sectors;
    const int ring = std::min(static_cast<int>((range - edges[zone]) / depth), rings - 1);
    const double azimuth = std::atan2(scan.y[i], scan.x[i]) + M_PI;
    const int sector = std::min(static_cast<int>(azimuth / width), sectors - 1);
    std::size_t ring_number = static_cast<std::size_t>(ring);
    for (std::size_t k = 0; k < z; ++k) {
      ring_number += static_cast<std::size_t>(detail::ConcentricZones::kRings[k]);
    }
    Patch& patch = patches[{zone, ring, sector}];
    patch.is_innermost_zone = zone == 0;
    patch.ring = ring_number;
    patch.points.push_back(i);
  }

  const double h = config.sensor_height;
  for (auto& [key, patch] : patches) {
    if (patch.points.size() < static_cast<std::size_t>(config.ground_min_points)) continue;
    const std::vector<std::size_t> fitted =
        reference_fit_points(patch.points, static_cast<std::size_t>(config.ground_fit_points));
    const auto point = [&](std::size_t i) {
      return Eigen::Vector3d(scan.x[i], scan.y[i], scan.z[i]);
    };
    std::vector<double> heights;
    for (const std::size_t i : fitted) {
      const bool is_noise = patch.is_innermost_zone && scan.z[i] < -(1.0 + config.ground_below) * h;
      if (!is_noise) heights.push_back(scan.z[i]);
    }
    std::sort(heights.begin(), heights.end());
    heights.resize(std::min(heights.size(), static_cast<std::size_t>(config.ground_lowest_points)));
    double seed_height = -(1.0 + config.ground_below) * h;
    if (!heights.empty()) {
      seed_height = 0.0;
      for (const double z : heights) seed_height += z / static_cast<double>(heights.size());
    }

    std::vector<std::size_t> members;
    for (const std::size_t i : fitted) {
      if (scan.z[i] < seed_height + config.ground_seed_margin) members.push_back(i);
    }
    bool is_ground = true;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Vector3d eigenvalues = Eigen::Vector3d::Zero();
    const auto members_of = [&](const std::vector<std::size_t>& points) {
      std::vector<std::size_t> result;
      for (const std::size_t i : points) {
        if (normal.dot(point(i) - mean) < config.ground_distance) result.push_back(i);
      }
      return result;
    };
    for (int iteration = 0; iteration < config.ground_iterations; ++iteration) {
      if (members.size() < 3) {
        is_ground = false;
        break;
      }
      const auto count = static_cast<double>(members.size());
      mean.setZero();
      for (const std::size_t i : members) mean += point(i) / count;
      Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
      for (const std::size_t i : members) {
        covariance += (point(i) - mean) * (point(i) - mean).transpose() / count;
      }
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
      eigenvalues = solver.eigenvalues();
      normal = solver.eigenvectors().col(0);
      if (normal.z() < 0.0) normal = -normal;
      members = members_of(fitted);
    }
    if (!is_ground || normal.z() < config.ground_uprightness) continue;
    if (patch.ring < GroundConfig::kCheckedRings) {
      const double flatness = eigenvalues[0] / eigenvalues.sum();
      if (mean.z() + h > config.ground_elevation[patch.ring] &&
          flatness >= config.ground_flatness[patch.ring]) {
        continue;
      }
    }
    patch.is_ground = true;
    patch.height = mean.z();
    patch.members = members_of(patch.points);
  }

  // Heights of the neighbouring patches in the ring, and of three in each adjacent ring: the one at
  // the middle of the sector and its neighbours.
  const auto rings = [](int z) {
    return detail::ConcentricZones::kRings[static_cast<std::size_t>(z)];
  };
  const auto sectors = [](int z) {
    return detail::ConcentricZones::kSectors[static_cast<std::size_t>(z)];
  };
  const auto heights_around = [&](const std::vector<int>& key) {
    const int zone = key[0], ring = key[1], sector = key[2];
    std::vector<double> heights;
    const auto add = [&](int z, int r, int s) {
      const auto found = patches.find({z, r, (s + sectors(z)) % sectors(z)});
      if (found == patches.end() || !found->second.is_ground) return;
      heights.push_back(found->second.height);
    };
    const auto add_beside = [&](int z, int r) {
      const int s = static_cast<int>((sector + 0.5) / sectors(zone) * sectors(z));
      for (const int step : {-1, 0, 1}) add(z, r, s + step);
    };
    add(zone, ring, sector - 1);
    add(zone, ring, sector + 1);
    if (ring > 0) {
      add_beside(zone, ring - 1);
    } else if (zone > 0) {
      add_beside(zone - 1, rings(zone - 1) - 1);
    }
    if (ring + 1 < rings(zone)) {
      add_beside(zone, ring + 1);
    } else if (zone < 3) {
      add_beside(zone + 1, 0);
    }
    return heights;
  };
  std::vector<bool> result(scan.size(), false);
  for (const auto& [key, patch] : patches) {
    if (!patch.is_ground) continue;
    std::vector<double> heights = heights_around(key);
    std::sort(heights.begin(), heights.end());
    const bool hangs = config.ground_step > 0.0 && key[0] < 3 && heights.size() >= 4 &&
                       heights[heights.size() / 2] < patch.height - config.ground_step;
    if (hangs) continue;
    for (const std::size_t i : patch.members) result[i] = true;
  }
  return result;
}

}  // namespace dynains::test
