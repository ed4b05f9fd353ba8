// A scan in the order of ground and the rest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/simd/capacity.hpp"
#include "dynains/simd/lanes.hpp"

namespace dynains {

/// One scan, reordered: ground points first, all others behind. What follows works on ranges of
/// it, never on copies.
struct GroundSplit {
  PointBuffer points;                ///< may be longer than size(): padded for wide loads
  std::vector<std::uint32_t> input;  ///< number of each point in the input of the remover
  std::size_t ground_count = 0;
  std::size_t count = 0;

  PointsView ground() const { return PointsView(points).subview(0, ground_count); }
  PointsView non_ground() const {
    return PointsView(points).subview(ground_count, count - ground_count);
  }
  void resize(std::size_t size) {
    count = size;
    const std::size_t padded = size + detail::kMaxPackWidth;
    points.grow(padded);
    detail::grow(input, padded);
  }
};

}  // namespace dynains
