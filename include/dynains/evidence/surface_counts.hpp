// Numbers of free and hit samples of one scan, by its references.
#pragma once

#include <cstdint>

namespace dynains::detail {

/// Samples of one scan on the ground and on the instances above it.
struct SurfaceCounts {
  std::uint64_t ground_hit = 0;         ///< hits of ground samples, over all references
  std::uint64_t ground_free = 0;        ///< beams through ground samples, over all references
  std::uint64_t instances_decided = 0;  ///< samples in free or occupied supervoxels
  std::uint64_t instances_free = 0;     ///< samples in free supervoxels

  SurfaceCounts& operator+=(const SurfaceCounts& other) {
    ground_hit += other.ground_hit;
    ground_free += other.ground_free;
    instances_decided += other.instances_decided;
    instances_free += other.instances_free;
    return *this;
  }
};

}  // namespace dynains::detail
