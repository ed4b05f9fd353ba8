// Heights of the ground at several levels, by column of a regular grid in the horizontal plane.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::grid {

/// Columns with square cross sections, numbered row by row from the lowest corner on.
struct Columns {
  Columns() = default;
  /// Those that hold the points between two corners (m).
  Columns(double column_edge, const Eigen::Vector2d& lowest, const Eigen::Vector2d& highest)
      : edge(column_edge),
        origin((lowest.array() / edge).floor() * edge),
        width(along(0, highest.x()) + 1),
        height(along(1, highest.y()) + 1) {}

  double edge = 1.0;                                 ///< m
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< m, lowest corner, world frame
  std::int64_t width = 0, height = 0;                ///< columns along x and y

  /// The highest corner, m.
  Eigen::Vector2d end() const {
    return origin + edge * Eigen::Vector2d(static_cast<double>(width), static_cast<double>(height));
  }
  std::size_t size() const { return static_cast<std::size_t>(width * height); }
  std::size_t index(std::int64_t x, std::int64_t y) const {
    return static_cast<std::size_t>(y * width + x);
  }
  bool contains(std::int64_t x, std::int64_t y) const {
    return x >= 0 && y >= 0 && x < width && y < height;
  }
  std::int64_t along(int axis, double position) const {
    return detail::floor_to<std::int64_t>((position - origin[axis]) / edge);
  }
};

/// The ground below a place. Ramps, kerbs and storeys have floors of their own: a point belongs to
/// the highest floor that is not above it.
///
/// Positions are relative to a place near them, m, z up.
class Floors {
 public:
  /// `place`: where the points come from, for messages.
  explicit Floors(std::string place) : place_(std::move(place)) {}

  /// Adds a static point. `is_below`: the sensor that saw it. No surface that was only seen from
  /// below is a floor: ceilings are labelled as ground where no ground is in view.
  void add(const Eigen::Vector3d& point, bool is_ground, bool is_below = false);
  /// Adds the points of a map whose ground is not known: the lowest points of each column, up to
  /// `step` (m) above the second one.
  void add_map(const std::vector<Eigen::Vector3d>& points, double step);
  /// After the last point. The lower end of what a column holds without a gap is floor if most of
  /// it is ground, and if it belongs to a surface that is large enough, across steps of up to
  /// `step` (m). Throws IoError if there is none, or the area is too large for a grid with
  /// `resolution` (m).
  void finish(double step, double resolution);
  /// After finish(): whether no floor is larger than the roof of a car.
  bool is_small() const { return is_small_; }

  /// Heights of a point, m.
  struct Height {
    double over_floor;   ///< the highest floor around it that is at most `step` above the point
    double over_lowest;  ///< the lowest floor around it, but for those more than `storey` below
  };
  /// Empty if no floor was seen within kReach. `step`, `storey`: m.
  std::optional<Height> height_of(const Eigen::Vector3d& point, double step, double storey) const;
  /// Whether ground was seen in the column around a position, or on two opposite sides of it.
  bool is_seen(const Eigen::Vector2d& position) const;
  /// Columns that have floors within kReach.
  const Columns& columns() const { return columns_; }

 private:
  static constexpr double kEdge = 0.25;   // m, of a column; ground differs little within it
  static constexpr double kReach = 10.0;  // m, from a place without ground to the nearest ground

  static constexpr double kBin = 0.05;  // m, of heights in a column

  struct Bin {
    std::uint32_t ground = 0, others = 0;  // points
    double sum = 0.0;                      // m, heights of the ground
    bool is_seen_from_above = false;       // some of the ground
  };
  struct Floor {
    std::int64_t x, y;  // indices of its column: a multiple of kEdge
    double height;      // m
    bool is_seen_from_above;
  };

  std::size_t column_of(const Floor& floor) const {
    return columns_.index(columns_.along(0, (static_cast<double>(floor.x) + 0.5) * kEdge),
                          columns_.along(1, (static_cast<double>(floor.y) + 0.5) * kEdge));
  }
  std::vector<Floor> lowest_of_spans() const;
  std::vector<Floor> large_surfaces(const std::vector<Floor>& floors, double step);
  bool has_floor(std::int64_t x, std::int64_t y) const {
    return columns_.contains(x, y) && is_seen_[columns_.index(x, y)];
  }

  std::string place_;
  bool is_small_ = false;
  VoxelHashTable<> numbers_;
  std::vector<VoxelKey> keys_;  // of the bins
  std::vector<Bin> bins_;
  Columns columns_;
  std::vector<bool> is_seen_;          // by column
  std::vector<std::uint32_t> source_;  // by column: where its floors begin, or kNoIndex
  std::vector<float> heights_;         // m, ascending from each source on, then an infinity
};

}  // namespace dynains::grid
