// Distance between the points of a map.
#pragma once

#include <cstddef>

namespace dynains::run {

/// The edge of voxels that hold about one of `points` points of surfaces, m, from `least` on and
/// about `most` at the most. `count(edge)`: number of voxels of this edge that hold points.
template <class Count>
double edge_by_spacing(std::size_t points, double least, double most, Count&& count) {
  double edge = least;
  // Voxels 1.42 times as wide hold twice as many points of a surface.
  while (edge < most && points < 2 * count(1.42 * edge)) edge *= 1.2;
  return edge;
}

}  // namespace dynains::run
