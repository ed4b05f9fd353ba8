// Samples of a cell, which stand for all of its points in tests of free space.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/recording/world_cells.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains {

/// The first point of each octant of a cube, in 1/256 of its edge.
struct CellSamples {
  std::array<std::array<std::uint8_t, 3>, 8> samples;
  std::uint8_t count = 0;
  std::uint32_t number_of = 0;  ///< 4 bits by octant: 1 + number of its sample, or 0

  /// Number of the sample in the octant of a point, which is this point if there was none.
  /// `within`: place of the point in the cube, [0, 1] along each axis.
  std::size_t add(const Eigen::Array3d& within) {
    int bits = 0;
    for (int axis = 0; axis < 3; ++axis) bits += within[axis] >= 0.5 ? 4 << axis : 0;
    if (const std::uint32_t known = number_of >> bits & 15U; known > 0) return known - 1;
    number_of |= (1U + count) << bits;
    for (int axis = 0; axis < 3; ++axis) {
      const double step = std::min(255.0, std::max(0.0, 256.0 * within[axis]));
      samples[count][static_cast<std::size_t>(axis)] = static_cast<std::uint8_t>(step);
    }
    return count++;
  }
};

/// Cells whose samples a reference tests.
struct TestedCells {
  std::vector<std::uint32_t> cells;  ///< their numbers
  std::vector<std::uint32_t> begin;  ///< by cell: first sample, and the end
  PointBuffer samples;               ///< m, relative to the sensor; padded for packs

  void clear() {
    cells.clear();
    begin.assign(1, 0);
  }
  /// Adds a cell, if it is in range. `corner`: the lowest one, m, relative to the sensor. `edge`:
  /// m.
  void add(std::uint32_t number, const CellSamples& cell, const Eigen::Vector3d& corner,
           double edge) {
    if (corner.head<2>().squaredNorm() > kLookRange * kLookRange) return;
    std::uint32_t count = begin.back();
    samples.grow(count + cell.samples.size() + detail::kPackWidth);
    for (std::size_t i = 0; i < cell.count; ++i, ++count) {
      const Eigen::Map<const Eigen::Array<std::uint8_t, 3, 1>> steps(cell.samples[i].data());
      const Eigen::Array3d within = edge / 256.0 * (steps.cast<double>() + 0.5);
      samples.x[count] = static_cast<float>(corner.x() + within.x());
      samples.y[count] = static_cast<float>(corner.y() + within.y());
      samples.z[count] = static_cast<float>(corner.z() + within.z());
    }
    cells.push_back(number);
    begin.push_back(count);
  }
};

}  // namespace dynains
