// Curved-voxel clustering as in the paper: a map of voxels, breadth-first search over the 26
// neighbours, in double with libm.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <queue>
#include <vector>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/clusters/curved_voxel_clusterer.hpp"
#include "polar_test_points.hpp"

namespace dynains::test {

/// Coordinates of a point in units of voxels: range, azimuth, elevation.
inline std::array<double, 3> voxel_coordinates(const CurvedVoxelClusterer::Config& config,
                                               double range, double azimuth, double z) {
  const double azimuths = std::round(360.0 / config.voxel_azimuth);
  return {std::hypot(range, z) / config.voxel_range, (azimuth + M_PI) / (2.0 * M_PI) * azimuths,
          (std::atan2(z, range) + 0.5 * M_PI) / (config.voxel_elevation * kRadiansPerDegree)};
}

inline std::vector<std::uint32_t> reference_clusters(const CurvedVoxelClusterer::Config& config,
                                                     PolarView points) {
  const auto azimuths = static_cast<int>(std::round(360.0 / config.voxel_azimuth));
  using Voxel = std::array<int, 3>;
  std::map<Voxel, std::uint32_t> cluster_of_voxel;
  std::vector<Voxel> voxels(points.size());
  std::vector<bool> is_near(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto at = voxel_coordinates(config, points.range[i], points.azimuth[i], points.z[i]);
    is_near[i] = std::hypot(points.range[i], points.z[i]) <= config.cluster_range;
    if (!is_near[i]) continue;
    voxels[i] = {static_cast<int>(at[0]), static_cast<int>(at[1]) % azimuths,
                 static_cast<int>(at[2])};
    cluster_of_voxel[voxels[i]] = kNoCluster;
  }
  std::vector<std::uint32_t> result(points.size(), kNoCluster);
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_near[i]) continue;
    if (cluster_of_voxel[voxels[i]] == kNoCluster) {
      std::queue<Voxel> open;
      open.push(voxels[i]);
      cluster_of_voxel[voxels[i]] = count;
      while (!open.empty()) {
        const Voxel at = open.front();
        open.pop();
        for (int r = -1; r <= 1; ++r) {
          for (int a = -1; a <= 1; ++a) {
            for (int e = -1; e <= 1; ++e) {
              const auto next =
                  cluster_of_voxel.find({at[0] + r, (at[1] + a + azimuths) % azimuths, at[2] + e});
              if (next == cluster_of_voxel.end() || next->second != kNoCluster) continue;
              next->second = count;
              open.push(next->first);
            }
          }
        }
      }
      ++count;
    }
    result[i] = cluster_of_voxel[voxels[i]];
  }
  return result;
}

}  // namespace dynains::test
