// The files of an occupancy grid, as the map server of nav2 reads them.
#pragma once

#include <Eigen/Core>
#include <filesystem>

#include "grid/grid_maker.hpp"

namespace dynains::grid {

/// Writes an image (PGM) and its description (YAML), mode `trinary`, each whole or not at all.
/// `origin`: m, world frame, of the positions of the grid. `image_name`: of the image in the
/// description. Throws IoError.
void write_grid(const std::filesystem::path& image, const std::filesystem::path& description,
                const OccupancyGrid& grid, const Eigen::Vector2d& origin);

}  // namespace dynains::grid
