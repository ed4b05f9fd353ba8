// A tile of points as OGC 3D Tiles 1.0 has it (Point Cloud, .pnts).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "dynains/io/point_file.hpp"
#include "tile_point.hpp"

namespace dynains::viewer {

/// The bytes of the file. `columns`: intensity (float), label (uint32), time (double) and session
/// (uint16) become properties of the batch table; others are ignored. `centre`: m, world frame;
/// positions are floats relative to it. Written as for machines with the lowest byte first.
std::string encode_point_tile(const std::vector<TilePoint>& points, const TileCube& cube,
                              const Eigen::Vector3d& centre, const PointColumns& columns);

}  // namespace dynains::viewer
