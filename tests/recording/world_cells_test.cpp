#include "dynains/recording/world_cells.hpp"

#include <cstddef>
#include <random>
#include <vector>

#include "support/catch.hpp"

using namespace dynains;

TEST_CASE("points are located together as they are alone") {
  std::mt19937 random(3);
  const auto number = [&](double most) {
    return std::uniform_real_distribution<>(-most, most)(random);
  };
  for (const double far : {0.0, 100.0, 2e6}) {
    CAPTURE(far);
    Pose T_world_sensor = Pose::Identity();
    T_world_sensor.linear() =
        Eigen::Quaterniond(1.0, number(1.0), number(1.0), number(1.0)).normalized().matrix();
    T_world_sensor.translation() = Eigen::Vector3d(far, -far, 30.0);
    PointBuffer points;
    for (int i = 0; i < 1000; ++i) {
      // Some points are followed by others in their cells.
      if (i % 10 == 9) points.push_back(points.x.back(), points.y.back(), points.z.back());
      points.push_back(static_cast<float>(number(80.0)), static_cast<float>(number(80.0)),
                       static_cast<float>(number(5.0)));
    }
    const auto is_taken = [](std::size_t i) { return i % 3 != 1; };
    std::vector<std::size_t> located_points;
    std::size_t different = 0;
    for_each_located(points, T_world_sensor, is_taken, [&](const LocatedPoints& located) {
      REQUIRE(located.size() <= LocatedPoints::kMost);
      std::size_t next = 0;
      for (const LocatedPoints::Run& run : located.runs()) {
        REQUIRE(run.begin == next);
        REQUIRE(run.end > run.begin);
        next = run.end;
        for (std::size_t k = run.begin; k < run.end; ++k) {
          const std::size_t i = located.point(k);
          located_points.push_back(i);
          const Eigen::Vector3d at = world_point(points, i, T_world_sensor);
          const WorldCell cell = cell_at(at);
          bool is_same = located.at(k) == at && run.cell == cell;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const double part =
                at[static_cast<int>(axis)] / kWorldCell - static_cast<double>(cell[axis]);
            is_same = is_same && located.within(axis, k) == static_cast<int>(256.0 * part);
          }
          different += is_same ? 0 : 1;
        }
      }
      REQUIRE(next == located.size());
    });
    CHECK(different == 0);
    std::vector<std::size_t> expected;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (is_taken(i)) expected.push_back(i);
    }
    CHECK(located_points == expected);
  }
}

TEST_CASE("cells below zero are in tiles below zero") {
  const WorldCell cell = cell_at({-0.1, -25.7, 0.5});
  CHECK(cell == WorldCell{-1, -65, 1});
  CHECK(tile_of(cell) == GroundTile{-1, -2});
  CHECK(key_of(cell) == voxel_key(63, 63, 1));
}
