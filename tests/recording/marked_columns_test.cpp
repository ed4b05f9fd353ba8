#include "dynains/recording/marked_columns.hpp"

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "support/catch.hpp"

using namespace dynains;

namespace {

/// Whether a point `x` m from a sensor at `origin` (m, world frame) may be in a marked column.
bool is_near(MarkedColumns& columns, const Eigen::Vector3d& origin, double x) {
  PointBuffer points;
  points.push_back(static_cast<float>(x), 0.0F, 1.0F);
  std::vector<std::uint8_t> near;
  columns.find(points, Pose(Eigen::Translation3d(origin)), near);
  REQUIRE(near.size() == 1);
  return near[0] != 0;
}

}  // namespace

TEST_CASE("points in a marked column and in those that touch it are near") {
  for (const double x : {0.2, 25.8, -7e5 - 0.2}) {
    CAPTURE(x);
    const Eigen::Vector3d sensor(x, 0.2, 3.0);
    MarkedColumns columns;
    CHECK_FALSE(is_near(columns, sensor, 10.0));
    columns.mark(cell_at(sensor + Eigen::Vector3d(10.0, 0.0, -2.0)));
    for (const double metres : {9.6, 10.0, 10.4}) CHECK(is_near(columns, sensor, metres));
    for (const double metres : {8.7, 11.3, -10.0}) CHECK_FALSE(is_near(columns, sensor, metres));
  }
}

TEST_CASE("points that are too far to know are near") {
  MarkedColumns columns;
  CHECK_FALSE(is_near(columns, Eigen::Vector3d::Zero(), 170.0));
  CHECK_FALSE(is_near(columns, Eigen::Vector3d::Zero(), -170.0));
  CHECK(is_near(columns, Eigen::Vector3d::Zero(), 210.0));
  CHECK(is_near(columns, Eigen::Vector3d::Zero(), -210.0));
}

TEST_CASE("no point beside a marked column is missed, for any pose") {
  std::mt19937 random(5);
  const auto number = [&](double most) {
    return std::uniform_real_distribution<>(-most, most)(random);
  };
  std::size_t missed = 0, touching = 0, found = 0, points_in_all = 0;
  for (int round = 0; round < 20; ++round) {
    Pose T_world_sensor = Pose::Identity();
    T_world_sensor.linear() =
        Eigen::Quaterniond(1.0, number(0.1), number(0.1), number(2.0)).normalized().matrix();
    T_world_sensor.translation() = Eigen::Vector3d(number(1e6), number(1e6), number(100.0));
    PointBuffer points;
    MarkedColumns columns;
    std::vector<WorldCell> marked;
    for (std::size_t i = 0; i < 1000; ++i) {
      points.push_back(static_cast<float>(number(60.0)), static_cast<float>(number(60.0)),
                       static_cast<float>(number(3.0)));
      if (i % 50 == 0)
        columns.mark(marked.emplace_back(cell_at(world_point(points, i, T_world_sensor))));
    }
    std::vector<std::uint8_t> near;
    columns.find(points, T_world_sensor, near);
    for (std::size_t i = 0; i < 1000; ++i) {
      const WorldCell cell = cell_at(world_point(points, i, T_world_sensor));
      bool touches = false;
      for (const WorldCell& other : marked) {
        touches =
            touches || (std::abs(other[0] - cell[0]) <= 1 && std::abs(other[1] - cell[1]) <= 1);
      }
      missed += touches && near[i] == 0 ? 1 : 0;
      touching += touches ? 1 : 0;
      found += near[i];
    }
    points_in_all += 1000;
  }
  CHECK(touching >= 400);
  CHECK(missed == 0);
  CHECK(10 * found < points_in_all);
}
