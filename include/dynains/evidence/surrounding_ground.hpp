// Heights of ground points above the surrounding ground.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/sensor/plane_fit.hpp"

namespace dynains {

/// Ground planes by horizontal cells of 2 m in the sensor frame. Each plane is fitted to the ground
/// points of its cell and of the eight cells around it.
class SurroundingGround {
 public:
  /// Height above ground with too few points for a plane.
  static constexpr float kUnknown = std::numeric_limits<float>::infinity();

  /// `max_range`: m; points beyond are assigned to the outermost cells.
  explicit SurroundingGround(double max_range)
      : half_(std::ceil(static_cast<float>(max_range / kCell)) + 2.0F),
        width_(2 * static_cast<std::size_t>(half_)),
        number_of_(width_ * width_, 0) {
    cells_.reserve(number_of_.size() + 1);  // uses address space only
    used_.reserve(number_of_.size());
    forget();
  }

  /// Replaces the ground points (m). The planes exclude points that lie `rise` (m) or more above
  /// the plane of all points, since these may belong to an object, and points of cells without a
  /// plane.
  void assign(PointsView points, float rise) {
    forget();
    for (std::size_t i = 0; i < points.size(); ++i) add(points, i, 1.0);
    detail::ensure_capacity(rising_, points.size());
    rising_.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float over = height(points.x[i], points.y[i], points.z[i]);
      if (over >= rise) rising_.push_back(static_cast<std::uint32_t>(i));
    }
    for (const std::uint32_t i : rising_) add(points, i, -1.0);
    for (Cell& cell : cells_) cell.has_plane = false;
  }

  /// Height (m) of a point (m) above the plane of its cell, along z, or kUnknown.
  float height(float x, float y, float z) {
    const std::size_t index = index_of(x, y);
    Cell& cell = cell_at(index);
    if (!cell.has_plane) find_plane(index, cell);
    return z - (cell.slope_x * x + cell.slope_y * y + cell.offset);
  }

 private:
  static constexpr double kCell = 2.0;  // m
  // Fewer points, or points on a line, do not define a plane.
  static constexpr double kLeastPoints = 8.0;
  static constexpr double kLeastVariance = 0.4;  // m^2, along any horizontal direction

  struct Cell {
    detail::PlaneMoments moments;
    // Plane z = slope_x * x + slope_y * y + offset.
    float slope_x = 0.0F, slope_y = 0.0F, offset = -kUnknown;
    bool has_plane = false;
  };

  // Cell 0 is the empty cell of all unused places.
  void forget() {
    for (const std::size_t index : used_) number_of_[index] = 0;
    used_.clear();
    cells_.assign(1, Cell());
  }

  // Index of the cell of a point, never a cell at the border of the grid.
  std::size_t index_of(float x, float y) const {
    constexpr auto kPerMetre = static_cast<float>(1.0 / kCell);
    const float last = 2.0F * half_ - 2.0F;
    const auto line = [&](float coordinate) {
      const float place = coordinate * kPerMetre + half_;
      return static_cast<std::size_t>(
          static_cast<std::int32_t>(std::min(std::max(place, 1.0F), last)));
    };
    return line(y) * width_ + line(x);
  }

  Cell& cell_at(std::size_t index) {
    std::uint32_t& number = number_of_[index];
    if (number == 0) {
      number = static_cast<std::uint32_t>(cells_.size());
      used_.push_back(index);
      cells_.emplace_back();
    }
    return cells_[number];
  }

  void add(PointsView points, std::size_t i, double weight) {
    const float x = points.x[i], y = points.y[i], z = points.z[i];
    cell_at(index_of(x, y))
        .moments.add(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z),
                     weight);
  }

  // Fits the plane of a cell by least squares of z.
  void find_plane(std::size_t index, Cell& cell) const {
    cell.has_plane = true;
    cell.offset = -kUnknown;
    detail::PlaneMoments sum;
    for (const std::size_t row : {index - width_, index, index + width_}) {
      for (const std::size_t place : {row - 1, row, row + 1}) {
        sum += cells_[number_of_[place]].moments;
      }
    }
    if (sum.count < kLeastPoints) return;
    const double weight = 1.0 / sum.count;
    const double mean_x = sum.x * weight, mean_y = sum.y * weight, mean_z = sum.z * weight;
    const double xx = sum.xx * weight - mean_x * mean_x;
    const double xy = sum.xy * weight - mean_x * mean_y;
    const double yy = sum.yy * weight - mean_y * mean_y;
    const double xz = sum.xz * weight - mean_x * mean_z;
    const double yz = sum.yz * weight - mean_y * mean_z;
    const double half = 0.5 * (xx - yy);
    const double least_variance = 0.5 * (xx + yy) - std::sqrt(half * half + xy * xy);
    if (!(least_variance >= kLeastVariance)) return;
    const double inverse = 1.0 / (xx * yy - xy * xy);
    const double slope_x = (xz * yy - yz * xy) * inverse;
    const double slope_y = (yz * xx - xz * xy) * inverse;
    cell.slope_x = static_cast<float>(slope_x);
    cell.slope_y = static_cast<float>(slope_y);
    cell.offset = static_cast<float>(mean_z - slope_x * mean_x - slope_y * mean_y);
  }

  float half_;                            // cells from the sensor to the border
  std::size_t width_;                     // of the grid, in cells
  std::vector<std::uint32_t> number_of_;  // row-major: index in cells_
  std::vector<std::size_t> used_;         // indices of the non-zero entries of number_of_
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> rising_;  // excluded points
};

}  // namespace dynains
