// Grids of cells in arrays, row by row.
#pragma once

#include <cstddef>
#include <cstdint>

namespace dynains::simulation {

/// Place of a cell in a grid of rows of `width` cells; neither `row` nor `column` is negative.
constexpr std::size_t grid_index(int row, int column, int width) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(column);
}

/// Key of a cell of an unbounded grid.
constexpr std::uint64_t cell_key(int x, int y) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32 |
         static_cast<std::uint32_t>(y);
}

}  // namespace dynains::simulation
