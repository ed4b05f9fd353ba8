// Planes of the static world in voxels around the sensor.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/sensor/plane_fit.hpp"
#include "dynains/stage/voxel_hash_table.hpp"

namespace dynains {

/// Map of planes: each voxel has the plane of its points, if these lie on a plane. The number of
/// voxels is limited; a full map forgets the voxels that have received no point for the longest
/// time. All coordinates: m, in one frame.
class VoxelPlanes {
 public:
  /// Plane of a voxel: dot(normal, p - mean) is the signed distance of a point p.
  struct Plane {
    double normal[3];  ///< unit vector
    double mean[3];    ///< m
    bool is_flat = false;
    std::uint32_t matches = 0;  ///< number of matched points, for alignments

    double distance(const double (&p)[3]) const {
      return normal[0] * (p[0] - mean[0]) + normal[1] * (p[1] - mean[1]) +
             normal[2] * (p[2] - mean[2]);
    }
  };

  /// Maximum number of voxels.
  static constexpr std::size_t kMostVoxels = 24576;
  static constexpr double kEdge = 1.0;  ///< edge of the voxels, m

  void clear() {
    table_.clear();
    voxels_.clear();
    scans_ = 0;
  }

  /// Allocates the memory of a full map.
  void reserve() {
    table_.reserve(kMostVoxels);
    voxels_.reserve(kMostVoxels);
    keys_.reserve(kMostVoxels);
  }

  /// Begins the insertion of the points of the next scan.
  void begin_scan() {
    ++scans_;
    if (voxels_.size() > kMostVoxels / 4 * 3) forget_oldest();
  }

  /// Adds a point of the current scan.
  void add(const double (&p)[3]) {
    std::int64_t index[3];
    const VoxelKey key = key_of(p, index);
    if (voxels_.size() == kMostVoxels && table_.find(key) == VoxelHashTable<>::kNone) return;
    const std::uint32_t number = table_.insert(key);
    if (number == voxels_.size()) {
      voxels_.emplace_back();
      keys_.push_back(key);
    }
    Voxel& voxel = voxels_[number];
    voxel.moments.add(p[0] - centre(index[0]), p[1] - centre(index[1]), p[2] - centre(index[2]),
                      1.0);
    voxel.last_scan = scans_;
    voxel.is_fitted = false;
  }

  /// Plane of the voxel of a point; null if there is none.
  Plane* find(const double (&p)[3]) {
    std::int64_t index[3];
    const std::uint32_t number = table_.find(key_of(p, index));
    if (number == VoxelHashTable<>::kNone) return nullptr;
    Voxel& voxel = voxels_[number];
    if (!voxel.is_fitted) fit(index, voxel);
    return voxel.plane.is_flat ? &voxel.plane : nullptr;
  }

  std::size_t size() const { return voxels_.size(); }

 private:
  static constexpr double kFewestPoints = 6.0;
  static constexpr double kMostThickness = 0.06;  // m, standard deviation along the normal
  static constexpr double kMostFlatness = 0.04;   // smallest eigenvalue to the sum
  static constexpr double kLeastBreadth = 0.04;   // product of the other two to their squared sum

  struct Voxel {
    detail::PlaneMoments moments;  // relative to the centre of the voxel
    Plane plane;
    std::uint32_t last_scan = 0;
    bool is_fitted = false;
  };

  static double centre(std::int64_t index) { return (static_cast<double>(index) + 0.5) * kEdge; }
  static VoxelKey key_of(const double (&p)[3], std::int64_t (&index)[3]) {
    for (std::size_t i = 0; i < 3; ++i)
      index[i] = static_cast<std::int64_t>(std::floor(p[i] / kEdge));
    return voxel_key(index[0], index[1], index[2]);
  }

  static void fit(const std::int64_t (&index)[3], Voxel& voxel) {
    voxel.is_fitted = true;
    voxel.plane.is_flat = false;
    if (voxel.moments.count < kFewestPoints) return;
    const detail::Plane fitted = detail::fit_plane(voxel.moments);
    const double thickness_squared = fitted.flatness * fitted.spread;
    voxel.plane = {{fitted.normal_x, fitted.normal_y, fitted.normal_z},
                   {centre(index[0]) + fitted.mean_x, centre(index[1]) + fitted.mean_y,
                    centre(index[2]) + fitted.mean_z},
                   fitted.flatness <= kMostFlatness && fitted.breadth >= kLeastBreadth &&
                       thickness_squared <= kMostThickness * kMostThickness,
                   0};
  }

  // Keeps the voxels that have received a point in the last scans, at most half of the maximum.
  void forget_oldest() {
    std::uint32_t age = kLongest;
    while (count_since(age) > kMostVoxels / 2) age /= 2;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < voxels_.size(); ++i) {
      if (scans_ - voxels_[i].last_scan > age) continue;
      voxels_[kept] = voxels_[i];
      keys_[kept] = keys_[i];
      ++kept;
    }
    voxels_.resize(kept);
    keys_.resize(kept);
    table_.clear();
    for (const VoxelKey key : keys_) table_.insert(key);
  }
  std::size_t count_since(std::uint32_t age) const {
    return static_cast<std::size_t>(
        std::count_if(voxels_.begin(), voxels_.end(),
                      [&](const Voxel& voxel) { return scans_ - voxel.last_scan <= age; }));
  }

  static constexpr std::uint32_t kLongest = 64;  // scans

  VoxelHashTable<> table_{4096};  // numbers of the voxels
  std::vector<Voxel> voxels_;
  std::vector<VoxelKey> keys_;  // by voxel
  std::uint32_t scans_ = 0;
};

}  // namespace dynains
