// A regular grid of columns in the horizontal plane, and the search for the nearest of some.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::grid {

/// Columns with square cross sections, numbered row by row from the lowest corner on.
struct Columns {
  double edge = 1.0;                                 ///< m
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< m, lowest corner, world frame
  std::int64_t width = 0, height = 0;                ///< columns along x and y

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

/// Lets the columns around take the value of the nearest that has one, at most `reach` columns away
/// along the axes. `value`: by column, or kNoIndex. Calls `meet(a, b)` for the values of columns
/// side by side.
template <class Meet>
void spread(const Columns& columns, std::int64_t reach, std::vector<std::uint32_t>& value,
            Meet&& meet) {
  std::vector<std::size_t> border, next;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (value[i] != kNoIndex) border.push_back(i);
  }
  for (std::int64_t step = 0; step <= reach && !border.empty(); ++step, border.swap(next)) {
    next.clear();
    for (const std::size_t i : border) {
      const auto x = static_cast<std::int64_t>(i) % columns.width;
      const auto y = static_cast<std::int64_t>(i) / columns.width;
      for (const auto& [dx, dy] :
           std::array<std::array<int, 2>, 4>{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}}) {
        if (!columns.contains(x + dx, y + dy)) continue;
        const std::size_t other = columns.index(x + dx, y + dy);
        if (value[other] != kNoIndex) {
          if (value[other] != value[i]) meet(value[i], value[other]);
        } else if (step < reach) {
          value[other] = value[i];
          next.push_back(other);
        }
      }
    }
  }
}

}  // namespace dynains::grid
