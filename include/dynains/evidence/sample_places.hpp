// Cells of a fixed grid in which the samples of a scan lie.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/instance_samples.hpp"
#include "dynains/simd/pack_transform.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains::detail {

/// Cell of each sample, in a grid of `cell` m whose corner is the frame `origin`.
inline void find_places(const InstanceSamples& samples, double cell,
                        const Eigen::Isometry3d& T_origin_sensor, std::vector<VoxelKey>& places) {
  const PackTransform to_cells(
      (Eigen::Scaling(1.0 / cell) * T_origin_sensor.matrix().topRows<3>()).cast<float>());
  places.resize(samples.size());
  VoxelKey* const place = places.data();
  for_packs(samples.size(), [&](auto at) {
    using Float = typename decltype(at)::Float;
    const Float x = at.load(samples.points.x.data());
    const Float y = at.load(samples.points.y.data());
    const Float z = at.load(samples.points.z.data());
    std::int32_t index[3][decltype(at)::kCount];
    for (std::size_t axis = 0; axis < 3; ++axis) floor(to_cells(axis, x, y, z)).store(index[axis]);
    for (std::size_t lane = 0; lane < at.size(); ++lane) {
      place[at.begin + lane] = voxel_key(index[0][lane], index[1][lane], index[2][lane]);
    }
  });
}

}  // namespace dynains::detail
