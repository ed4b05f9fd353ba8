// Grids of cells in arrays, row by row.
#pragma once

#include <cstddef>

namespace dynains::simulation {

/// Place of a cell in a grid of rows of `width` cells; neither `row` nor `column` is negative.
constexpr std::size_t grid_index(int row, int column, int width) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(column);
}

}  // namespace dynains::simulation
