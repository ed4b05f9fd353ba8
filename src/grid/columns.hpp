// A regular grid of columns in the horizontal plane.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>

#include "dynains/points.hpp"

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

}  // namespace dynains::grid
