#include "dynains/evaluation/truth.hpp"
#include "grid/grid_maker.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/simulated_runs.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

/// The labels of one cell, of points in its reach.
struct Truth {
  int ground = 0, walls = 0, objects = 0, movers = 0;
};

bool is_wall(std::uint32_t semantic_class) { return semantic_class >= 50 && semantic_class <= 52; }

}  // namespace

TEST_CASE("a grid of a simulated street has its free cells and walls, and no trails") {
  const std::vector<simulation::SimulatedScan> scans =
      simulate(drive_of(simulation::Scene::kUrban, simulation::Sensor::kOs1_64, 40, 5));
  std::vector<std::vector<PointLabel>> labels(scans.size());
  DynaInsRemover remover;
  const auto keep = [&](const ScanVerdict& verdict) {
    labels.at(verdict.scan).assign(verdict.labels.begin(), verdict.labels.end());
  };
  push_all(
      remover, scans, [](const FrameResult&) {}, keep);

  const auto visit = [&](auto&& take) {
    for (std::size_t s = 0; s < scans.size(); ++s) {
      for (std::size_t i = 0; i < labels[s].size(); ++i) {
        const PointLabel label = labels[s][i];
        if (label != PointLabel::kGround && label != PointLabel::kStatic &&
            label != PointLabel::kDynamic)
          continue;
        take(s, scans[s].T_world_sensor * point_of(scans[s], i), label, scans[s].labels[i]);
      }
    }
  };
  const grid::Config config;
  grid::Floors floors("street");
  visit([&](std::size_t, const Eigen::Vector3d& point, PointLabel label, std::uint32_t) {
    if (label != PointLabel::kDynamic) floors.add(point, label == PointLabel::kGround);
  });
  floors.finish(config.min_height, config.resolution);
  grid::GridMaker maker(config, floors);
  std::map<std::pair<std::int64_t, std::int64_t>, std::pair<double, int>> heights;  // of 0.5 m
  const auto place_of = [](const Eigen::Vector3d& point) {
    return std::pair(std::lround(2.0 * point.x()), std::lround(2.0 * point.y()));
  };
  std::vector<std::vector<Eigen::Vector3d>> ends(scans.size());
  std::size_t latest = scans.size();
  visit([&](std::size_t s, const Eigen::Vector3d& point, PointLabel label, std::uint32_t truth) {
    if (s != std::exchange(latest, s)) maker.begin_scan();
    maker.add(point, label == PointLabel::kDynamic);
    ends[s].push_back(point);
    if (!evaluation::is_ground_class(evaluation::semantic_class(truth))) return;
    auto& [sum, count] = heights[place_of(point)];
    sum += point.z();
    ++count;
  });
  for (std::size_t s = 0; s < scans.size(); ++s) {
    maker.add_beams(scans[s].T_world_sensor.translation(), ends[s]);
  }
  const grid::OccupancyGrid made = maker.grid();

  // Heights by the true ground of the place itself.
  std::map<std::size_t, Truth> cells;
  visit([&](std::size_t, const Eigen::Vector3d& point, PointLabel, std::uint32_t label) {
    const std::int64_t x = made.columns.along(0, point.x()), y = made.columns.along(1, point.y());
    const auto ground = heights.find(place_of(point));
    if (!made.columns.contains(x, y) || ground == heights.end()) return;
    const std::uint16_t semantic = evaluation::semantic_class(label);
    const double height = point.z() - ground->second.first / ground->second.second;
    Truth& cell = cells[made.columns.index(x, y)];
    const bool is_in_reach = height > 0.2 && height < 1.7;
    if (semantic > 250) {
      cell.movers += is_in_reach ? 1 : 0;
    } else if (evaluation::is_ground_class(semantic)) {
      ++cell.ground;
    } else if (height > 0.05 && height < 1.85) {
      ++cell.objects;
      cell.walls += is_in_reach && is_wall(semantic) ? 1 : 0;
    }
  });
  int free = 0, free_found = 0, walls = 0, walls_found = 0, swept = 0, trails = 0;
  for (const auto& [index, cell] : cells) {
    const grid::CellState state = made.cells[index];
    if (cell.ground > 0 && cell.objects == 0) {
      ++free;
      free_found += state == grid::CellState::kFree ? 1 : 0;
    }
    if (cell.walls >= 3) {
      ++walls;
      walls_found += state == grid::CellState::kOccupied ? 1 : 0;
    }
    if (cell.movers > 0 && cell.objects == 0) {
      ++swept;
      trails += state == grid::CellState::kOccupied ? 1 : 0;
    }
  }
  CAPTURE(free, free_found, walls, walls_found, swept, trails);
  REQUIRE(free > 100000);
  REQUIRE(walls > 1000);
  REQUIRE(swept > 5000);
  CHECK(free_found >= 0.99 * free);
  CHECK(walls_found >= 0.98 * walls);
  CHECK(trails <= 0.01 * swept);
}
