#include "grid/grid_maker.hpp"

#include "dynains/errors.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::grid;

namespace {

/// A place of 12 x 8 m whose ground has this height (m), with more points on top.
struct Place {
  std::function<double(double x, double y)> ground = [](double, double) { return 0.0; };
  std::vector<Eigen::Vector3d> objects, moving;
  int scans = 3, object_scans = 3;  // with ground; with objects, the first of these

  OccupancyGrid grid(const Config& config = {}) const {
    Floors floors("place");
    visit_ground([&](const Eigen::Vector3d& point) { floors.add(point, true); });
    for (const Eigen::Vector3d& point : objects) floors.add(point, false);
    floors.finish(config.min_height, config.resolution);
    GridMaker maker(config, floors);
    for (int scan = 0; scan < scans; ++scan) {
      maker.begin_scan();
      visit_ground([&](const Eigen::Vector3d& point) { maker.add(point, false); });
      for (const Eigen::Vector3d& point : objects) {
        if (scan < object_scans) maker.add(point, false);
      }
      for (const Eigen::Vector3d& point : moving) maker.add(point, true);
    }
    return maker.grid();
  }

  /// Points each `step` up from the ground at x, y, from `low` to `high` (m).
  void raise(double x, double y, double low, double high) {
    for (double z = low; z <= high; z += 0.1) objects.emplace_back(x, y, ground(x, y) + z);
  }

 private:
  template <class Visit>
  void visit_ground(Visit&& visit) const {
    for (int i = 0; i < 120; ++i) {
      for (int k = 0; k < 80; ++k) {
        const double x = 0.1 * i + 0.02, y = 0.1 * k + 0.02;
        visit(Eigen::Vector3d(x, y, ground(x, y)));
      }
    }
  }
};

CellState state_at(const OccupancyGrid& grid, double x, double y) {
  const Columns& columns = grid.columns;
  const std::int64_t column = columns.along(0, x), row = columns.along(1, y);
  return columns.contains(column, row) ? grid.cells[columns.index(column, row)]
                                       : CellState::kUnknown;
}

std::size_t occupied(const Place& place) { return place.grid().count(CellState::kOccupied); }

}  // namespace

TEST_CASE("a wall is occupied without holes, the ground free, and all else unknown") {
  Place place;
  for (double y = 1.0; y < 7.0; y += 0.17) place.raise(6.0 + 0.1 * y, y, 0.0, 2.5);
  const OccupancyGrid grid = place.grid();
  for (double y = 1.05; y < 6.9; y += 0.01) {
    INFO(y);
    // The cell of the wall, or one beside it, as the line between two points runs.
    const Columns& columns = grid.columns;
    const std::int64_t x = columns.along(0, 6.0 + 0.1 * y), row = columns.along(1, y);
    bool is_hit = false;
    for (std::int64_t column = x - 1; column <= x + 1; ++column) {
      is_hit = is_hit || grid.cells[columns.index(column, row)] == CellState::kOccupied;
    }
    CHECK(is_hit);
  }
  CHECK(state_at(grid, 3.0, 4.0) == CellState::kFree);
  CHECK(state_at(grid, 9.0, 4.0) == CellState::kFree);
  CHECK(state_at(grid, 13.0, 4.0) == CellState::kUnknown);
}

TEST_CASE("the ground in the corner of two walls stays free, and gaps of walls do not") {
  Place place;
  for (int i = 0; i < 12; ++i) {
    place.raise(4.02 + 0.05 * i, 4.02, 0.3, 1.5);
    if (i != 8) place.raise(4.02, 4.02 + 0.05 * i, 0.3, 1.5);
  }
  const OccupancyGrid grid = place.grid();
  CHECK(state_at(grid, 4.12, 4.12) == CellState::kFree);
  CHECK(state_at(grid, 4.02, 4.42) == CellState::kOccupied);
}

TEST_CASE("a gap is closed unless lines by a third obstacle close it") {
  Place place;
  place.raise(4.02, 4.02, 0.3, 1.5);
  place.raise(4.22, 4.22, 0.3, 1.5);
  SECTION("four cells are joined across, by the line") {}
  SECTION("an obstacle that is nearer to both, but has no line to one of them") {
    place.raise(3.97, 4.22, 0.3, 1.5);
  }
  CHECK(state_at(place.grid(), 4.12, 4.12) == CellState::kOccupied);
}

TEST_CASE("ramps, kerbs, storeys and crowns are no obstacles") {
  Place place;
  SECTION("a ramp of 20 %") {
    place.ground = [](double x, double) { return 0.2 * x; };
  }
  SECTION("a kerb") {
    place.ground = [](double x, double) { return x < 6.0 ? 0.0 : 0.15; };
  }
  SECTION("a platform of 1 m, but for its edge") {
    place.ground = [](double x, double) { return x < 6.0 ? 0.0 : 1.0; };
  }
  SECTION("a crown") {
    for (double x = 3.0; x < 5.0; x += 0.1) place.raise(x, 4.0, 2.0, 4.0);
  }
  CHECK(occupied(place) == 0);
}

TEST_CASE("an edge higher than a step is an obstacle, with a top too small to drive on") {
  Place place;
  place.ground = [](double x, double y) {
    return x > 5.0 && x < 6.0 && y > 3.0 && y < 4.0 ? 0.3 : 0.0;
  };
  const OccupancyGrid grid = place.grid();
  CHECK(state_at(grid, 5.12, 3.52) == CellState::kOccupied);
  CHECK(state_at(grid, 5.52, 3.52) == CellState::kOccupied);
  CHECK(state_at(grid, 4.52, 3.52) == CellState::kFree);
}

TEST_CASE("what moved, or was seen in fewer than three scans, is no obstacle") {
  Place place;
  SECTION("not noticed in three of eight scans: its place was seen in the others") {
    place.scans = 8;
    place.raise(4.32, 4.02, 0.3, 1.5);
  }
  SECTION("noticed") {
    for (int i = 0; i < 20; ++i) place.moving.emplace_back(4.02 + 0.05 * i, 4.02, 0.5);
  }
  SECTION("seen in two of four scans, and its ground in none") {
    place.scans = 4;
    place.object_scans = 2;
    place.raise(4.37, 4.07, 0.3, 1.5);
  }
  CHECK(occupied(place) == 0);
  CHECK(state_at(place.grid(), 4.32, 4.02) == CellState::kFree);
}

TEST_CASE("beams that cross low make cells free, high ones do not") {
  Floors floors("place");
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 40; ++k) {
      floors.add({0.1 * i, 0.1 * k, 0.0}, true);
      floors.add({0.1 * i + 12.0, 0.1 * k, 0.0}, true);
    }
  }
  floors.finish(0.1, 0.05);
  const std::vector<Eigen::Vector3d> ends = {{14.0, 2.0, 0.0}};
  GridMaker low({}, floors), high({}, floors);
  low.add_beams({2.0, 2.0, 0.8}, ends);
  high.add_beams({2.0, 2.0, 1.7}, ends);
  CHECK(state_at(low.grid(), 8.0, 2.01) == CellState::kFree);
  CHECK(state_at(low.grid(), 8.0, 4.0) == CellState::kUnknown);
  CHECK(state_at(high.grid(), 6.0, 2.01) == CellState::kUnknown);
  CHECK(state_at(high.grid(), 10.0, 2.01) == CellState::kFree);
}

TEST_CASE("a surface that was only seen from below is no floor") {
  Floors floors("HALL"), ceiling("HALL");
  for (int i = 0; i < 160; ++i) {
    for (int k = 0; k < 40; ++k) {
      const double x = 0.1 * i, y = 0.1 * k;
      if (i < 80) floors.add({x, y, 0.0}, true);
      floors.add({x, y, 2.0}, true, true);
      ceiling.add({x, y, 2.0}, true, true);
    }
  }
  floors.finish(0.1, 0.05);
  CHECK(floors.is_seen({4.0, 2.0}));
  CHECK_FALSE(floors.is_seen({12.0, 2.0}));
  CHECK(floors.height_of({4.0, 2.0, 2.05}, 0.1, 1.8)->over_floor == Approx(2.05));
  CHECK_THROWS_WITH(ceiling.finish(0.1, 0.05), StartsWith("HALL: no ground"));
}

TEST_CASE("a grid without ground, or of wrong heights, is refused by one line") {
  Floors floors("PLACE");
  floors.add({1.0, 2.0, 3.0}, false);
  CHECK_THROWS_WITH(floors.finish(0.1, 0.05), Catch::Matchers::StartsWith("PLACE: no ground"));
  Config config;
  config.max_height = 0.05;
  CHECK_THROWS_AS(config.validate(), ConfigError);
}
