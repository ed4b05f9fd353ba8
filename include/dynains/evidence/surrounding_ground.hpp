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

namespace dynains::detail {

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
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float x = points.x[i], y = points.y[i], z = points.z[i];
      add(x, y, z, 1.0, cell_at(index_of(x, y)).all);
    }
    for (const std::size_t index : used_) {
      Cell& cell = cells_[number_of_[index]];
      cell.plane = plane_around(index, &Cell::all);
      cell.kept = cell.all;
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float x = points.x[i], y = points.y[i], z = points.z[i];
      Cell& cell = cell_at(index_of(x, y));
      if (cell.plane.height(x, y, z) >= rise) add(x, y, z, -1.0, cell.kept);
    }
  }

  /// Height (m) of a point (m) above the plane of its cell, along z, or kUnknown.
  float height(float x, float y, float z) {
    const std::size_t index = index_of(x, y);
    Cell& cell = cell_at(index);
    if (!cell.has_final_plane) {
      cell.has_final_plane = true;
      cell.plane = plane_around(index, &Cell::kept);
    }
    return cell.plane.height(x, y, z);
  }

 private:
  static constexpr double kCell = 2.0;  // m
  // Fewer points, or points on a line, do not define a plane.
  static constexpr double kLeastPoints = 8.0;
  static constexpr double kLeastVariance = 0.4;  // m^2, along any horizontal direction

  // Plane z = slope_x * x + slope_y * y + offset.
  struct Plane {
    float slope_x = 0.0F, slope_y = 0.0F, offset = -kUnknown;

    float height(float x, float y, float z) const {
      return z - (slope_x * x + slope_y * y + offset);
    }
  };
  struct Cell {
    PlaneMoments all, kept;  // of all its points, and of those that do not rise
    Plane plane;             // through all points around; if it is final, through the kept ones
    bool has_final_plane = false;
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

  static void add(float x, float y, float z, double weight, PlaneMoments& moments) {
    moments.add(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z), weight);
  }

  // Plane through the points of a cell and of the cells around it.
  Plane plane_around(std::size_t index, PlaneMoments Cell::*moments) const {
    PlaneMoments sum;
    for (const std::size_t row : {index - width_, index, index + width_}) {
      for (const std::size_t place : {row - 1, row, row + 1}) {
        sum += cells_[number_of_[place]].*moments;
      }
    }
    return fit(sum);
  }

  // Least squares of z.
  static Plane fit(const PlaneMoments& sum) {
    Plane plane;
    if (sum.count < kLeastPoints) return plane;
    const double weight = 1.0 / sum.count;
    const double mean_x = sum.x * weight, mean_y = sum.y * weight, mean_z = sum.z * weight;
    const double xx = sum.xx * weight - mean_x * mean_x;
    const double xy = sum.xy * weight - mean_x * mean_y;
    const double yy = sum.yy * weight - mean_y * mean_y;
    const double xz = sum.xz * weight - mean_x * mean_z;
    const double yz = sum.yz * weight - mean_y * mean_z;
    const double half = 0.5 * (xx - yy);
    const double least_variance = 0.5 * (xx + yy) - std::sqrt(half * half + xy * xy);
    if (!(least_variance >= kLeastVariance)) return plane;
    const double inverse = 1.0 / (xx * yy - xy * xy);
    const double slope_x = (xz * yy - yz * xy) * inverse;
    const double slope_y = (yz * xx - xz * xy) * inverse;
    plane.slope_x = static_cast<float>(slope_x);
    plane.slope_y = static_cast<float>(slope_y);
    plane.offset = static_cast<float>(mean_z - slope_x * mean_x - slope_y * mean_y);
    return plane;
  }

  float half_;                            // cells from the sensor to the border
  std::size_t width_;                     // of the grid, in cells
  std::vector<std::uint32_t> number_of_;  // row-major: index in cells_
  std::vector<std::size_t> used_;         // indices of the non-zero entries of number_of_
  std::vector<Cell> cells_;
};

}  // namespace dynains::detail
