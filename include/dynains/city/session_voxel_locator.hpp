// Voxels of the points of one scan in the grid of a map of many sessions.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "dynains/city/session_grid.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains {

/// Computes the voxels of points in packs of floats. Near the faces of voxels and tiles, where
/// floats may round to another voxel than session_voxel(), it tells kUnsure.
class SessionVoxelLocator {
 public:
  static constexpr std::size_t kMost = 256;  ///< points per call of locate()
  static constexpr std::int32_t kUnsure = -1;
  static constexpr std::int32_t kOutOfRange = -2;

  /// By point.
  struct Voxels {
    std::array<std::int32_t, kMost> tile;     ///< number of the tile, or kUnsure, or kOutOfRange
    std::array<std::int32_t, kMost> x, y, z;  ///< indices of the voxel, as session_voxel_index()
    /// A bit for each point, which is set unless it surely lies in the voxel of the point before.
    std::array<std::uint64_t, kMost / 64> changes;

    std::array<std::int64_t, 3> index(std::size_t i) const { return {x[i], y[i], z[i]}; }
  };

  /// `range` (m): farther points are out of range.
  SessionVoxelLocator(const SessionGrid& grid, double range) : grid_(grid), range_(range) {}

  /// Begins a scan.
  void begin_scan(const Pose& T_world_sensor) {
    const Eigen::Vector3d sensor = T_world_sensor.translation();
    first_ = tile_at(sensor.head<2>() - Eigen::Vector2d::Constant(range_));
    const TileIndex last = tile_at(sensor.head<2>() + Eigen::Vector2d::Constant(range_));
    columns_ = last[0] - first_[0] + 1;
    rows_ = last[1] - first_[1] + 1;
    lowest_ = static_cast<std::int32_t>(std::floor((sensor.z() - range_) / grid_.map_voxel));
    Eigen::Vector3d origin = tile_corner(grid_, first_);
    origin.z() = grid_.map_voxel * lowest_;
    T_origin_sensor_ = T_world_sensor;
    T_origin_sensor_.translation() -= origin;
    // A bound of the sum of all rounding errors of floats, m.
    const double reach = std::max({grid_.tile * columns_, grid_.tile * rows_,
                                   std::abs(sensor.z()) + 2.0 * range_ + grid_.map_voxel});
    constexpr double kRounding = 1.0 / (1 << 19);
    margin_ = static_cast<float>(kRounding * reach / grid_.map_voxel);
  }

  /// Number of tiles around the sensor of the scan.
  std::size_t tile_count() const {
    return static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  }
  /// Indices of tile `number` < tile_count().
  TileIndex tile(std::size_t number) const {
    const auto n = static_cast<std::int32_t>(number);
    return {first_[0] + n % columns_, first_[1] + n / columns_};
  }

  /// Locates at most kMost points, m, sensor frame.
  void locate(PointsView points, Voxels& voxels) const {
    using namespace detail;
    std::array<std::uint64_t, kMost / 64> sure = {};
    const PackTransform transform(T_origin_sensor_);
    const auto constant = [](double value) { return PackConstant(static_cast<float>(value)); };
    const PackConstant tile = constant(grid_.tile), per_tile = constant(1.0 / grid_.tile);
    const PackConstant per_voxel = constant(1.0 / grid_.map_voxel), margin(margin_);
    const PackConstant above = constant(1.0 - static_cast<double>(margin_));
    const PackConstant end = constant(grid_.tile / grid_.map_voxel - static_cast<double>(margin_));
    constexpr double kRounding = 1e-5;  // of squares in floats, relative
    const PackConstant near = constant(range_ * range_ * (1.0 - kRounding));
    const PackConstant far = constant(range_ * range_ * (1.0 + kRounding));
    with_packs([&](auto packs) {
      using Packs = decltype(packs);
      using Float = typename Packs::Float;
      using Int = typename Packs::Int;
      for_slices<Packs>(points.size(), [&](auto place) {
        const Float x = place.load(points.x.data());
        const Float y = place.load(points.y.data());
        const Float z = place.load(points.z.data());
        const Float square = (x * x + y * y) + z * z;
        auto is_sure = square < near;
        // The index of the voxel along an axis, from a coordinate in voxels.
        const auto index = [&](const Float& voxels_from_corner) {
          const Int whole = truncate(voxels_from_corner);
          const Float rest = voxels_from_corner - to_float(whole);
          is_sure = is_sure & (margin < rest) & (rest < above);
          return whole;
        };
        const auto index_in_tile = [&](const Float& from_origin, Int& number, std::int32_t* to) {
          number = truncate(from_origin * per_tile);
          const Float from_corner = (from_origin - to_float(number) * tile) * per_voxel;
          is_sure = is_sure & (from_corner < end);
          index(from_corner).store(to + place.begin);
        };
        Int column, row;
        index_in_tile(transform(0, x, y, z), column, voxels.x.data());
        index_in_tile(transform(1, x, y, z), row, voxels.y.data());
        (index(transform(2, x, y, z) * per_voxel) + Int(lowest_)).store(&voxels.z[place.begin]);
        const Int number = column + multiply(row, columns_);
        const Int unsure = select(square < far, Int(kUnsure), Int(kOutOfRange));
        select(is_sure, number, unsure).store(&voxels.tile[place.begin]);
        sure[place.begin / 64] |= std::uint64_t{is_sure.bits()} << place.begin % 64;
      });
      for (std::size_t word = 0; 64 * word < points.size(); ++word) {
        // The first point of a call has no point before it.
        const std::size_t first = std::max<std::size_t>(64 * word, 1);
        const std::size_t count = std::min<std::size_t>(64 * (word + 1), points.size()) - first;
        const std::uint64_t changes = find_changes<Packs>(
            count, &voxels.tile[first], &voxels.x[first], &voxels.y[first], &voxels.z[first]);
        voxels.changes[word] = ~sure[word] | changes << first % 64 | (word == 0 ? 1U : 0U);
      }
    });
  }

 private:
  TileIndex tile_at(const Eigen::Vector2d& position) const {
    return tile_index(grid_, {position.x(), position.y(), 0.0});
  }

  SessionGrid grid_;
  double range_;  // m
  TileIndex first_ = {};
  std::int32_t columns_ = 0, rows_ = 0;  // of the tiles around the sensor
  std::int32_t lowest_ = 0;              // voxel along z
  float margin_ = 0.0F;                  // voxels
  // From the sensor to the corner of the first tile, at the height of the lowest voxel.
  Pose T_origin_sensor_ = Pose::Identity();
};

}  // namespace dynains
