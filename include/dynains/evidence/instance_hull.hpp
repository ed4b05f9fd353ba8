// Area below an instance.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/points.hpp"

namespace dynains::detail {

/// Horizontal hull of points on a grid. A cell belongs to the hull if it lies between the first and
/// the last occupied cell of its row, and of its column.
class InstanceHull {
 public:
  /// `cell`: edge of the cells, m.
  explicit InstanceHull(double cell) : cell_(static_cast<float>(cell)) {}

  /// Calls `visit(x, y)` with the centre (m) of each cell of the hull of `points` (m). Ignores
  /// instances of more than 100 cells along an axis, which are not single objects.
  template <class Visitor>
  void visit(PointsView points, Visitor&& visit) {
    if (points.empty()) return;
    const auto x_range = std::minmax_element(points.x.begin(), points.x.end());
    const auto y_range = std::minmax_element(points.y.begin(), points.y.end());
    const std::int32_t first_column = cell_of(*x_range.first);
    const std::int32_t first_row = cell_of(*y_range.first);
    const std::int32_t columns = cell_of(*x_range.second) - first_column + 1;
    const std::int32_t rows = cell_of(*y_range.second) - first_row + 1;
    if (columns > kMostCells || rows > kMostCells) return;
    in_row_.assign(static_cast<std::size_t>(rows), Extent());
    in_column_.assign(static_cast<std::size_t>(columns), Extent());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::int32_t column = cell_of(points.x[i]) - first_column;
      const std::int32_t row = cell_of(points.y[i]) - first_row;
      in_row_[static_cast<std::size_t>(row)].extend(column);
      in_column_[static_cast<std::size_t>(column)].extend(row);
    }
    for (std::int32_t row = 0; row < rows; ++row) {
      const Extent& extent = in_row_[static_cast<std::size_t>(row)];
      for (std::int32_t column = extent.first; column <= extent.last; ++column) {
        const Extent& across = in_column_[static_cast<std::size_t>(column)];
        if (row < across.first || row > across.last) continue;
        visit((static_cast<float>(first_column + column) + 0.5F) * cell_,
              (static_cast<float>(first_row + row) + 0.5F) * cell_);
      }
    }
  }

 private:
  static constexpr std::int32_t kMostCells = 100;

  struct Extent {
    std::int32_t first = std::numeric_limits<std::int32_t>::max();
    std::int32_t last = std::numeric_limits<std::int32_t>::min();
    void extend(std::int32_t cell) {
      first = std::min(first, cell);
      last = std::max(last, cell);
    }
  };

  std::int32_t cell_of(float coordinate) const {
    return static_cast<std::int32_t>(std::floor(coordinate / cell_));
  }

  float cell_;
  std::vector<Extent> in_row_;
  std::vector<Extent> in_column_;
};

}  // namespace dynains::detail
