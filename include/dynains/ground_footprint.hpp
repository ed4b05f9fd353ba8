// Which ground points lie below or beside removed points.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/detail/lanes.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Horizontal grid around the sensor that remembers where points were removed and how low.
class GroundFootprint {
 public:
  /// `cell`: m; `max_range`: m, points beyond are not remembered.
  GroundFootprint(double cell, double max_range)
      : cells_per_metre_(static_cast<float>(1.0 / cell)),
        half_width_(static_cast<std::int32_t>(std::ceil(max_range / cell)) + 2),
        lowest_(row_length() * row_length(), kNothing) {}

  /// Remembers a removed point in its cell and the eight around it.
  void add(float x, float y, float z) {
    const std::int32_t column = index(x);
    const std::int32_t row = index(y);
    if (!inside(column, row)) return;
    const std::size_t centre = place(column, row);
    // Neighbouring points mostly share a cell.
    if (!touched_.empty() && touched_.back() == centre && last_lowest_ <= z) return;
    last_lowest_ = z;
    touched_.push_back(static_cast<std::uint32_t>(centre));
    for (std::int32_t dy = -1; dy <= 1; ++dy) {
      for (std::int32_t dx = -1; dx <= 1; ++dx) {
        float& lowest = lowest_[place(column + dx, row + dy)];
        lowest = std::min(lowest, z);
      }
    }
  }

  /// Height of the lowest point that was removed about here, or infinity.
  float lowest(float x, float y) const {
    const std::int32_t column = index(x);
    const std::int32_t row = index(y);
    return inside(column, row) ? lowest_[place(column, row)] : kNothing;
  }

  /// Numbers of all points that have a removed point about them, and of some at the border of the
  /// grid, into `found`; in order.
  void find(PointsView points, std::vector<std::uint32_t>& found) const {
    using namespace detail;
    if (found.size() < points.size() + kLanes) found.resize(points.size() + kLanes);
    const Float8 scale(cells_per_metre_);
    const Float8 centre(static_cast<float>(half_width_));
    const Float8 most(static_cast<float>(2 * half_width_ - 1));
    const Float8 zero(0.0F);
    const Float8 width(static_cast<float>(2 * half_width_));
    const auto clamped = [&](Float8 scaled) {
      return to_float(truncate(min(max(scaled, zero), most)));
    };
    std::size_t count = 0;
    for_lanes(points, [&](Float8 x, Float8 y, Float8, std::size_t first) {
      // Exact in floats: the grid has fewer than 2^24 cells.
      std::int32_t cell[kLanes];
      truncate(clamped(y * scale + centre) * width + clamped(x * scale + centre)).store(cell);
      const std::size_t lanes = std::min(kLanes, points.size() - first);
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        found[count] = static_cast<std::uint32_t>(first + lane);
        count += lowest_[static_cast<std::size_t>(cell[lane])] < kNothing ? 1 : 0;
      }
    });
    found.resize(count);
  }

  bool empty() const { return touched_.empty(); }

  /// Forgets all points; costs as much as adding them.
  void clear() {
    const std::size_t width = row_length();
    for (const std::uint32_t centre : touched_) {
      for (std::size_t row = centre - width; row <= centre + width; row += width) {
        std::fill_n(&lowest_[row - 1], 3, kNothing);
      }
    }
    touched_.clear();
  }

 private:
  static constexpr float kNothing = std::numeric_limits<float>::infinity();

  std::int32_t index(float coordinate) const {
    const float scaled = coordinate * cells_per_metre_ + static_cast<float>(half_width_);
    // Negative and huge values end up outside; truncation is floor for the rest.
    return scaled >= 0.0F && scaled < static_cast<float>(2 * half_width_)
               ? static_cast<std::int32_t>(scaled)
               : 0;
  }
  bool inside(std::int32_t column, std::int32_t row) const {
    return column > 0 && row > 0 && column + 1 < 2 * half_width_ && row + 1 < 2 * half_width_;
  }
  std::size_t row_length() const { return 2 * static_cast<std::size_t>(half_width_); }
  std::size_t place(std::int32_t column, std::int32_t row) const {
    return static_cast<std::size_t>(row) * row_length() + static_cast<std::size_t>(column);
  }

  float cells_per_metre_;
  std::int32_t half_width_;  // cells
  std::vector<float> lowest_;
  std::vector<std::uint32_t> touched_;
  float last_lowest_ = kNothing;
};

}  // namespace dynains
