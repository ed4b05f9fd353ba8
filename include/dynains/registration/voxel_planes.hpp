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
template <class Number>
using SensorErrors = std::array<std::array<Number, 3>, kSensorErrors>;

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

    double distance(const std::array<double, 3>& p) const {
      return normal[0] * (p[0] - mean[0]) + normal[1] * (p[1] - mean[1]) +
             normal[2] * (p[2] - mean[2]);
    }
  };

  /// Some points, m, sensor frame. A block is looked up at once, so that its memory accesses
  /// overlap.
  struct Block {
    static constexpr std::size_t kMaxCount = 32;
    using Numbers = std::array<double, kMaxCount>;  // by point; any numbers behind the last one
    Numbers x = {}, y = {}, z = {};
    std::size_t count = 0;

    bool is_full() const { return count == kMaxCount; }
    /// Adds a point. The block must not be full.
    void push_back(double px, double py, double pz) {
      x[count] = px;
      y[count] = py;
      z[count++] = pz;
    }
  };
  /// The points of a block in the map.
  struct Placed {
    std::array<Block::Numbers, 3> along;  ///< by axis, then by point: m
    SensorErrors<std::array<float, Block::kMaxCount>> moved;
    VoxelKey keys[Block::kMaxCount];

    std::array<double, 3> point(std::size_t i) const {
      return {along[0][i], along[1][i], along[2][i]};
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
    T_map_sensor_ = T_map_sensor;
    ++scans_;
    if (size() > kMaxVoxels / 4 * 3) forget_oldest();
  }

  /// Adds points of the current scan, and empties the block.
  void add(Block& block) {
    Placed placed;
    place(T_map_sensor_, block, placed);
    const VoxelKey* const keys = placed.keys;
    std::uint32_t numbers[Block::kMaxCount];
    for (std::size_t i = 0; i < block.count; ++i) {
      numbers[i] = i > 0 && keys[i] == keys[i - 1] ? numbers[i - 1] : number_for(keys[i]);
    }
    for (std::size_t i = 0; i < block.count;) {
      std::size_t end = i + 1;
      while (end < block.count && numbers[end] == numbers[i]) ++end;
      if (numbers[i] != kNoIndex) add(placed, i, end, numbers[i]);
      i = end;
    }
    block.count = 0;
  }

  /// Calls `visit(i, plane, placed)` for each point of a block, placed by a pose of the sensor, in
  /// a voxel with a plane.
  template <class Visit>
  void find(const Pose& T_map_sensor, const Block& block, Visit&& visit) {
    Placed placed;
    place(T_map_sensor, block, placed);
    const VoxelKey* const keys = placed.keys;
    std::uint32_t numbers[Block::kMaxCount];
    for (std::size_t i = 0; i < block.count; ++i) {
      numbers[i] = table_.find(keys[i]);
      if (numbers[i] != kNoIndex) __builtin_prefetch(&planes_[numbers[i]]);
    }
    for (std::size_t i = 0; i < block.count; ++i) {
      if (numbers[i] == kNoIndex) continue;
      Plane& plane = planes_[numbers[i]];
      if (!plane.is_fitted) plane = fit(keys[i], moments_[numbers[i]]);
      if (plane.is_flat) visit(i, plane, placed);
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
    SensorErrors<float> errors = {};  // sums
    std::uint32_t last_scan = 0;
  };

  double centre(VoxelKey key, int axis) const {
    return (static_cast<double>(voxel_index(key, axis)) + 0.5) * edge_;
  }

  // Places the points of a block, and prefetches the entries of their voxels in the table. Loops
  // over all numbers are compiled to vector instructions.
  void place(const Pose& T, const Block& block, Placed& placed) const {
    const auto& [x, y, z, count] = block;
    Block::Numbers distance, back_x, back_y;
    for (std::size_t i = 0; i < Block::kMaxCount; ++i) {
      distance[i] = std::sqrt(x[i] * x[i] + y[i] * y[i]);
    }
    for (std::size_t i = 0; i < Block::kMaxCount; ++i) {
      const double along = -z[i] / std::max(distance[i], 1e-99);  // 0 above the sensor
      back_x[i] = along * x[i];
      back_y[i] = along * y[i];
    }
    std::int32_t index[3][Block::kMaxCount];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto row = static_cast<int>(axis);
      const double a = T(row, 0), b = T(row, 1), c = T(row, 2), t = T(row, 3);
      const double per_metre = per_metre_;
      for (std::size_t i = 0; i < Block::kMaxCount; ++i) {
        placed.along[axis][i] = a * x[i] + b * y[i] + c * z[i] + t;
        index[axis][i] = floor_to<std::int32_t>(placed.along[axis][i] * per_metre);
        placed.moved[0][axis][i] =
            static_cast<float>(a * back_x[i] + b * back_y[i] + c * distance[i]);
        placed.moved[1][axis][i] = static_cast<float>(c * y[i] - b * z[i]);
        placed.moved[2][axis][i] = static_cast<float>(a * z[i] - c * x[i]);
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      placed.keys[i] = voxel_key(index[0][i], index[1][i], index[2][i]);
      table_.prefetch(placed.keys[i]);
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

  // Adds the points [begin, end) of a block to their voxel.
  void add(const Placed& placed, std::size_t begin, std::size_t end, std::uint32_t number) {
    const VoxelKey key = placed.keys[begin];
    const double x = centre(key, 0), y = centre(key, 1), z = centre(key, 2);
    Moments moments = moments_[number];  // a copy that is not reloaded after stores
    for (std::size_t i = begin; i < end; ++i) {
      moments.sums.add(placed.along[0][i] - x, placed.along[1][i] - y, placed.along[2][i] - z, 1.0);
      for (std::size_t k = 0; k < kSensorErrors; ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          moments.errors[k][axis] += placed.moved[k][axis][i];
        }
      }
    }
    moments.last_scan = scans_;
    moments_[number] = moments;
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
    for (int k = 0; k < 3; ++k) beam[k] = plane.mean[k] - T_map_sensor_(k, 3);
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
  Pose T_map_sensor_ = Pose::Identity();  // of the newest scan
};

}  // namespace dynains::detail
