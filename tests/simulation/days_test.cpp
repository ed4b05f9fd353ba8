// One place on several days.

#include "dynains/errors.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"

namespace dynains::simulation {
namespace {

Config config_of(int day) {
  Config config = test::exact_drive_of(Scene::kUrban, Sensor::kVlp16, 60, 2);
  config.day = day;
  return config;
}

/// Ranges of the buildings in the first scan by direction, in steps of 1e-4.
std::map<std::array<long, 3>, double> building_ranges(Simulator& simulator) {
  const SimulatedScan scan = simulator.scan(0);
  std::map<std::array<long, 3>, double> ranges;
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    if (scan.labels[i] != 50) continue;
    const Eigen::Vector3d p = test::point_of(scan, i);
    const auto step = [&](double value) { return std::lround(1e4 * value / p.norm()); };
    ranges[{step(p.x()), step(p.y()), step(p.z())}] = p.norm();
  }
  return ranges;
}

/// Instances of changes, parked vehicles and movers of the whole sequence, with a position.
std::map<std::uint32_t, std::pair<double, double>> objects(Simulator& simulator) {
  std::map<std::uint32_t, std::pair<double, double>> result;
  for (std::size_t i = 0; i < simulator.size(); i += 10) {
    for (const ObjectState& object : simulator.scan(i).objects) {
      result.emplace(object.instance,
                     std::pair(object.T_world_object(0, 3), object.T_world_object(1, 3)));
    }
  }
  return result;
}

}  // namespace

TEST_CASE("days: the static world is that of all days, objects are of one day") {
  Simulator none(config_of(0)), first(config_of(1)), second(config_of(2));
  const auto walls = building_ranges(none);
  for (Simulator* const day : {&first, &second}) {
    std::size_t common = 0, equal = 0;
    for (const auto& [direction, range] : building_ranges(*day)) {
      const auto found = walls.find(direction);
      if (found == walls.end()) continue;
      ++common;
      equal += std::abs(found->second - range) < 1e-3 ? 1U : 0U;
    }
    // Some windows let a beam pass at random, by the seed of the scan.
    CHECK(common > 300);
    CHECK(equal > common * 9 / 10);
  }
  CHECK(first.scan(0).T_world_sensor.isApprox(none.scan(0).T_world_sensor, 1e-12));
  CHECK(first.scan(0).time == 0.0);
  CHECK(second.scan(0).time == 86400.0);

  std::set<std::pair<double, double>> places;
  for (const auto& object : objects(first)) places.insert(object.second);
  std::size_t same = 0, others = 0;
  for (const auto& [instance, place] : objects(second)) {
    if (instance >= kFirstChange) continue;
    ++others;
    same += places.count(place);
  }
  CHECK(others > 10);
  CHECK(same == 0);
}

TEST_CASE("days: changes keep their instance and their place, and come and go by day") {
  std::vector<std::map<std::uint32_t, std::pair<double, double>>> changes;
  for (int day = 1; day <= 5; ++day) {
    Simulator simulator(config_of(day));
    changes.emplace_back();
    for (const auto& [instance, place] : objects(simulator)) {
      if (instance >= kFirstChange) changes.back().emplace(instance, place);
    }
  }
  std::map<std::uint32_t, std::pair<double, double>> place_of;
  std::set<std::uint32_t> come, gone;
  for (std::size_t day = 0; day < changes.size(); ++day) {
    for (const auto& [instance, place] : changes[day]) {
      CHECK(place_of.emplace(instance, place).first->second == place);
      if (day > 0 && changes[day - 1].count(instance) == 0) come.insert(instance);
    }
    if (day == 0) continue;
    for (const auto& change : changes[day - 1]) {
      if (changes[day].count(change.first) == 0) gone.insert(change.first);
    }
  }
  CHECK(come.size() >= 2);
  CHECK(gone.size() >= 2);
  CHECK(changes[3] == changes[4]);
}

TEST_CASE("days: other scenes have none") {
  Config config = config_of(1);
  config.scene = Scene::kForest;
  CHECK_THROWS_AS(Simulator(config), ConfigError);
  config.day = 0;
  CHECK_NOTHROW(Simulator(config));
}

}  // namespace dynains::simulation
