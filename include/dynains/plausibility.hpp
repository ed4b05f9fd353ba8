// Plausibility of scans and poses by running window: what no correct recording gives.
#pragma once

#include <algorithm>
#include <array>
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

namespace dynains {

/// Why no correct recording gives the scans of a running window.
enum class Suspicion : std::uint8_t {
  kNone,
  kUnits,  ///< nearly no point can be judged: units, frame or ranges of the points
  kPoses,  ///< scans do not fit to each other under the poses
  kRays,   ///< scans fit, but beams pass through static objects: origin of rays, times of points
};

constexpr std::array<const char*, 4> value_names(Suspicion) {
  return {"none", "units", "poses", "rays"};
}

/// Shares over the last scans, [0, 1].
struct Plausibility {
  float not_judged = 0.0F;     ///< points that are invalid, too near or too far
  float ground_free = 0.0F;    ///< beams through the ground, of those that reach or pass it, in all
                               ///< scans but the worst
  float instance_free = 0.0F;  ///< samples above the ground seen free, of those seen free or hit
  float misfits = 0.0F;        ///< scans that begin an epoch because poses or surfaces do not fit
  float residual = 0.0F;       ///< m, mean translation of PoseResidual, each at most 0.15 m
  Suspicion suspicion = Suspicion::kNone;
  std::uint64_t since = 0;  ///< number of the push at which the suspicious window began

  /// Raises each share to that of another window.
  void raise_shares(const Plausibility& other) {
    not_judged = std::max(not_judged, other.not_judged);
    ground_free = std::max(ground_free, other.ground_free);
    instance_free = std::max(instance_free, other.instance_free);
    misfits = std::max(misfits, other.misfits);
    residual = std::max(residual, other.residual);
  }
};

}  // namespace dynains
