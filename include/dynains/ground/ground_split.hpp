// A scan whose ground points come first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/simd/pack.hpp"

namespace dynains {

/// One scan, reordered: ground points first, then all other points. Later stages use views of it
/// and copy no points.
struct GroundSplit {
  PointBuffer points;  ///< m, sensor frame; padded for packs beyond `count`
  /// Index of each point in the input of the remover; empty after the push of the scan.
  std::vector<std::uint32_t> input;
  std::size_t ground_count = 0;  ///< number of ground points
  std::size_t count = 0;         ///< number of all points; those behind them are not judged

  PointsView ground() const { return PointsView(points).subview(0, ground_count); }
  PointsView non_ground() const {
    return PointsView(points).subview(ground_count, count - ground_count);
  }
  void resize(std::size_t size) {
    count = size;
    const std::size_t padded = size + detail::kPackWidth;
    points.grow(padded);
    detail::grow(input, padded);
  }
};

}  // namespace dynains
