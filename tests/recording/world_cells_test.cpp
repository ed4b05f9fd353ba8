#include "dynains/recording/world_cells.hpp"

#include "support/catch.hpp"

using namespace dynains;

TEST_CASE("cells below zero are in tiles below zero") {
  const VoxelKey cell = cell_at({-0.1, -25.7, 0.5});
  CHECK(cell == voxel_key(-1, -65, 1));
  CHECK(tile_of(cell) == TileIndex{-1, -2});
  CHECK((corner_of(cell) - Eigen::Vector3d(-0.4, -26.0, 0.4)).norm() < 1e-9);
}
