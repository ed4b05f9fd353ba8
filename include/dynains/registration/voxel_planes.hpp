// Planes of the static world in voxels around the sensor, from the moments of their points
// (Magnusson, The three-dimensional normal-distributions transform, Orebro 2009).
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/pose.hpp"
#include "dynains/sensor/plane_fit.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::detail {

/// Movement of a point, along the axes of the map, by one unit (rad) of each error: of all
/// elevations, and of the mounting about the axes x and y of the sensor.
inline constexpr std::size_t kSensorErrors = 3;
using SensorErrors = std::array<std::array<float, 3>, kSensorErrors>;

/// SensorErrors of the point (x, y, z) (m, sensor frame).
inline SensorErrors sensor_errors(const Pose& T_map_sensor, double x, double y, double z) {
  const double distance = std::sqrt(x * x + y * y);
  const double along = distance > 0.0 ? -z / distance : 0.0;
  SensorErrors errors;
  for (int axis = 0; axis < 3; ++axis) {
    const double R[3] = {T_map_sensor(axis, 0), T_map_sensor(axis, 1), T_map_sensor(axis, 2)};
    const double moved[kSensorErrors] = {R[0] * (along * x) + R[1] * (along * y) + R[2] * distance,
                                         R[2] * y - R[1] * z, R[0] * z - R[2] * x};
    for (std::size_t k = 0; k < kSensorErrors; ++k) {
      errors[k][static_cast<std::size_t>(axis)] = static_cast<float>(moved[k]);
    }
  }
  return errors;
}

/// Map of planes: each voxel has the plane of its points, if these lie on a plane. The number of
/// voxels is limited; a full map forgets the voxels that have received no point for the longest
/// time. All coordinates: m, in one frame.
class VoxelPlanes {
 public:
  /// Plane of a voxel: dot(normal, p - mean) is the signed distance of a point p.
  struct Plane {
    double normal[3];  ///< unit vector
    double mean[3];    ///< m
    bool is_fitted = false;
    bool is_flat = false;
    std::uint32_t matches = 0;  ///< number of matched points, for alignments
    /// Movement of the plane along its normal by each error of the sensor, m.
    std::array<double, kSensorErrors> moved = {};

    double distance(const double (&p)[3]) const {
      return normal[0] * (p[0] - mean[0]) + normal[1] * (p[1] - mean[1]) +
             normal[2] * (p[2] - mean[2]);
    }
  };

  /// Some points, m. A block is looked up at once, so that its memory accesses overlap.
  struct Block {
    static constexpr std::size_t kMaxCount = 32;
    double points[kMaxCount][3];
    SensorErrors errors[kMaxCount];  // of points to insert
    std::size_t count = 0;

    bool is_full() const { return count == kMaxCount; }
    /// Adds the point (x, y, z) (m), transformed by `T`, to look it up. The block must not be full.
    void push_position(const Pose& T, double x, double y, double z) {
      double(&point)[3] = points[count++];
      for (int k = 0; k < 3; ++k) point[k] = T(k, 0) * x + T(k, 1) * y + T(k, 2) * z + T(k, 3);
    }
    /// Adds this point to insert it.
    void push_back(const Pose& T, double x, double y, double z) {
      errors[count] = sensor_errors(T, x, y, z);
      push_position(T, x, y, z);
    }
  };

  /// Maximum number of voxels.
  static constexpr std::size_t kMaxVoxels = 24576;

  /// `edge`: of the voxels, m. Allocates the memory of a full map.
  explicit VoxelPlanes(double edge = 1.0) : edge_(edge), per_metre_(1.0 / edge) {
    keys_.reserve(kMaxVoxels);
    moments_.reserve(kMaxVoxels);
    planes_.reserve(kMaxVoxels);
  }

  double edge() const { return edge_; }

  void clear() {
    table_.clear();
    keys_.clear();
    moments_.clear();
    planes_.clear();
    scans_ = 0;
  }

  /// Begins the insertion of the points of the next scan. `T_map_sensor`: its pose.
  void begin_scan(const Pose& T_map_sensor) {
    for (int axis = 0; axis < 3; ++axis) {
      sensor_[static_cast<std::size_t>(axis)] = T_map_sensor(axis, 3);
    }
    ++scans_;
    if (size() > kMaxVoxels / 4 * 3) forget_oldest();
  }

  /// Adds points of the current scan, and empties the block.
  void add(Block& block) {
    VoxelKey keys[Block::kMaxCount];
    std::uint32_t numbers[Block::kMaxCount];
    find_keys(block, keys);
    for (std::size_t i = 0; i < block.count; ++i) {
      numbers[i] = i > 0 && keys[i] == keys[i - 1] ? numbers[i - 1] : number_for(keys[i]);
    }
    for (std::size_t i = 0; i < block.count;) {
      std::size_t end = i + 1;
      while (end < block.count && numbers[end] == numbers[i]) ++end;
      if (numbers[i] != kNoIndex) add(block, i, end, keys[i], numbers[i]);
      i = end;
    }
    block.count = 0;
  }

  /// Calls `visit(i, plane)` for each point of a block in a voxel with a plane.
  template <class Visit>
  void find(const Block& block, Visit&& visit) {
    VoxelKey keys[Block::kMaxCount];
    std::uint32_t numbers[Block::kMaxCount];
    find_keys(block, keys);
    for (std::size_t i = 0; i < block.count; ++i) {
      numbers[i] = table_.find(keys[i]);
      if (numbers[i] != kNoIndex) __builtin_prefetch(&planes_[numbers[i]]);
    }
    for (std::size_t i = 0; i < block.count; ++i) {
      if (numbers[i] == kNoIndex) continue;
      Plane& plane = planes_[numbers[i]];
      if (!plane.is_fitted) plane = fit(keys[i], moments_[numbers[i]]);
      if (plane.is_flat) visit(i, plane);
    }
  }

  std::size_t size() const { return keys_.size(); }

 private:
  // Fewer points lie on a plane by chance, for example in foliage.
  static constexpr double kMinPoints = 12.0;
  static constexpr double kMaxThickness = 0.06;  // standard deviation along the normal / edge

  // The points of a voxel, relative to its centre.
  struct Moments {
    PlaneMoments sums;
    SensorErrors errors = {};  // sums
    std::uint32_t last_scan = 0;
  };

  double centre(VoxelKey key, int axis) const {
    return (static_cast<double>(voxel_index(key, axis)) + 0.5) * edge_;
  }

  // Computes the keys of the voxels of a block, and prefetches their entries in the table.
  void find_keys(const Block& block, VoxelKey* keys) const {
    for (std::size_t i = 0; i < block.count; ++i) {
      std::int64_t index[3];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        index[axis] = floor_to<std::int64_t>(block.points[i][axis] * per_metre_);
      }
      keys[i] = voxel_key(index[0], index[1], index[2]);
      table_.prefetch(keys[i]);
    }
  }

  // Number of a voxel, which may be new; kNoIndex if the map is full. Prefetches its moments.
  std::uint32_t number_for(VoxelKey key) {
    if (size() == kMaxVoxels && table_.find(key) == kNoIndex) return kNoIndex;
    const std::uint32_t number = table_.insert(key);
    if (number == size()) {
      keys_.push_back(key);
      moments_.emplace_back();
      planes_.emplace_back();
    }
    __builtin_prefetch(&moments_[number]);
    return number;
  }

  // Adds the points [begin, end) of a block to a voxel.
  void add(const Block& block, std::size_t begin, std::size_t end, VoxelKey key,
           std::uint32_t number) {
    const double x = centre(key, 0), y = centre(key, 1), z = centre(key, 2);
    Moments& moments = moments_[number];
    for (std::size_t i = begin; i < end; ++i) {
      const double(&p)[3] = block.points[i];
      moments.sums.add(p[0] - x, p[1] - y, p[2] - z, 1.0);
      for (std::size_t k = 0; k < kSensorErrors; ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          moments.errors[k][axis] += block.errors[i][k][axis];
        }
      }
    }
    moments.last_scan = scans_;
    planes_[number].is_fitted = false;
  }

  Plane fit(VoxelKey key, const Moments& moments) const {
    Plane plane = {};
    plane.is_fitted = true;
    if (moments.sums.count < kMinPoints) return plane;
    const detail::Plane fitted = fit_plane(moments.sums);
    // Without the bias: the fit of three parameters takes up a part of the deviations.
    const double thickness_squared =
        fitted.flatness * fitted.spread * moments.sums.count / (moments.sums.count - 3.0);
    plane = {{fitted.normal_x, fitted.normal_y, fitted.normal_z},
             {centre(key, 0) + fitted.mean_x, centre(key, 1) + fitted.mean_y,
              centre(key, 2) + fitted.mean_z},
             true,
             false,
             0,
             {}};
    for (std::size_t k = 0; k < kSensorErrors; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        plane.moved[k] +=
            plane.normal[axis] * static_cast<double>(moments.errors[k][axis]) / moments.sums.count;
      }
    }
    double beam[3];
    for (std::size_t k = 0; k < 3; ++k) beam[k] = plane.mean[k] - sensor_[k];
    plane.is_flat = thickness_squared <= kMaxThickness * kMaxThickness * edge_ * edge_ &&
                    !is_trace_of_beam(beam, plane.normal, moments.sums);
    return plane;
  }

  // Keeps the voxels that have received a point in the last scans, at most half of the maximum.
  void forget_oldest() {
    std::uint32_t age = kMaxAge;
    while (count_since(age) > kMaxVoxels / 2) age /= 2;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size(); ++i) {
      if (scans_ - moments_[i].last_scan > age) continue;
      keys_[kept] = keys_[i];
      moments_[kept] = moments_[i];
      planes_[kept] = planes_[i];
      ++kept;
    }
    keys_.resize(kept);
    moments_.resize(kept);
    planes_.resize(kept);
    table_.clear();
    for (const VoxelKey key : keys_) table_.insert(key);
  }
  std::size_t count_since(std::uint32_t age) const {
    return static_cast<std::size_t>(
        std::count_if(moments_.begin(), moments_.end(),
                      [&](const Moments& moments) { return scans_ - moments.last_scan <= age; }));
  }

  static constexpr std::uint32_t kMaxAge = 64;  // scans

  double edge_, per_metre_;
  VoxelHashTable<> table_{kMaxVoxels};  // numbers of the voxels
  std::vector<VoxelKey> keys_;          // by voxel
  std::vector<Moments> moments_;        // by voxel
  std::vector<Plane> planes_;           // by voxel
  std::uint32_t scans_ = 0;
  std::array<double, 3> sensor_ = {};  // position at the newest scan, m
};

}  // namespace dynains::detail
