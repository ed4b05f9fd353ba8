#include "support/catch.hpp"
#include "support/drive_of.hpp"

namespace dynains::simulation {
namespace {

using test::class_of;
using test::instance_of;
using test::point_of;

double elevation_of(const SimulatedScan& scan, std::size_t i) {
  const Eigen::Vector3d p = point_of(scan, i);
  return std::atan2(p.z(), p.head<2>().norm()) * 57.29578;
}

TEST_CASE("worlds differ in scene, sensor and carrier") {
  std::set<Scene> scenes;
  std::set<Sensor> sensors;
  std::set<Gait> gaits;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    const Config config = random_world(seed);
    CHECK_NOTHROW(config.validate());
    CHECK_FALSE(config.has_pose_errors());
    CHECK(config.static_instances);
    scenes.insert(config.scene);
    sensors.insert(config.sensor);
    gaits.insert(config.gait);
  }
  CHECK(scenes.size() == 15);  // all but the one in which nothing moves
  CHECK(sensors.size() == value_names(Sensor()).size());
  CHECK(gaits.size() == 3);
}

TEST_CASE("static things have lasting instance ids if asked, and are otherwise the same") {
  Config config = test::drive_of(Scene::kMixed, Sensor::kVlp16, 4, 5);
  config.clutter = 1;
  const SimulatedScan without = Simulator(config).scan(0);
  config.static_instances = true;
  Simulator simulator(config);
  const SimulatedScan with = simulator.scan(0);
  CHECK(with.xyzi == without.xyzi);
  std::map<std::uint32_t, std::set<std::uint32_t>> instances;  // of a class
  REQUIRE(with.labels.size() == without.labels.size());
  for (std::size_t i = 0; i < with.labels.size(); ++i) {
    CHECK_FALSE(class_of(with.labels[i]) != class_of(without.labels[i]));
    const std::uint32_t instance = instance_of(with.labels[i]);
    if (instance >= kFirstStatic) CHECK_FALSE(instance_of(without.labels[i]) != 0);
    instances[class_of(with.labels[i])].insert(instance);
  }
  CHECK(instances[50].size() + instances[51].size() + instances[70].size() > 10);
  CHECK(instances[40] == std::set<std::uint32_t>{0});  // the ground has none
  const SimulatedScan later = simulator.scan(3);
  std::size_t again = 0;
  for (const std::uint32_t label : later.labels) {
    again += instance_of(label) >= kFirstStatic &&
             instances[class_of(label)].count(instance_of(label)) > 0;
  }
  CHECK(again > later.labels.size() / 20);
}

TEST_CASE("a Mid-360 looks all around, from 7 degrees down to 52 degrees up") {
  Config config = test::drive_of(Scene::kHall, Sensor::kMid360, 1, 5);
  config.dropout = 0;
  const SimulatedScan scan = Simulator(config).scan(0);
  CHECK(scan.labels.size() > 17000);
  CHECK(scan.labels.size() <= 20000);
  std::size_t sectors[12] = {};
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    CHECK_FALSE(elevation_of(scan, i) < -7.1);
    CHECK_FALSE(elevation_of(scan, i) > 52.1);
    const double turn = (std::atan2(scan.xyzi[4 * i + 1], scan.xyzi[4 * i]) / 3.1416 + 1) / 2;
    ++sectors[std::min(11, static_cast<int>(12 * turn))];
  }
  CHECK(*std::min_element(std::begin(sectors), std::end(sectors)) > 1200);
}

TEST_CASE("lost packets take their share of the columns, whole columns each") {
  Config config = test::drive_of(Scene::kHall, Sensor::kVlp16, 1, 5);
  config.dropout = 0;
  const double all = static_cast<double>(Simulator(config).scan(0).labels.size());
  config.packet_loss = 0.3;
  const SimulatedScan scan = Simulator(config).scan(0);
  CHECK(static_cast<double>(scan.labels.size()) / all == Approx(0.7).margin(0.1));
}

TEST_CASE("each beam has its own constant range error") {
  Config config = test::exact_drive_of(Scene::kHall, Sensor::kVlp16, 2, 5);
  Simulator exact(config);
  config.beam_bias = 0.03;
  Simulator biased(config);
  std::map<int, std::set<int>> errors;  // 0.1 mm, by elevation
  for (std::size_t k = 0; k < 2; ++k) {
    const SimulatedScan a = exact.scan(k), b = biased.scan(k);
    REQUIRE(a.labels.size() == b.labels.size());
    for (std::size_t i = 0; i < a.labels.size(); ++i) {
      const double error = point_of(b, i).norm() - point_of(a, i).norm();
      errors[static_cast<int>(std::floor(elevation_of(a, i) / 2 + 8))].insert(
          static_cast<int>(std::lround(1e4 * error)));
    }
  }
  CHECK(errors.size() == 16);
  double squares = 0;
  for (const auto& beam : errors) {
    CHECK(*beam.second.rbegin() - *beam.second.begin() <= 1);
    squares += std::pow(1e-4 * *beam.second.begin(), 2);
  }
  CHECK(std::sqrt(squares / 16) == Approx(0.03).epsilon(0.5));
}

TEST_CASE("a wide beam mixes surfaces at edges only") {
  Config config = test::exact_drive_of(Scene::kStatic, Sensor::kOs1_64, 1, 5);
  const SimulatedScan thin = Simulator(config).scan(0);
  config.divergence = 0.35;  // as wide as a column
  const SimulatedScan wide = Simulator(config).scan(0);
  REQUIRE(thin.labels.size() == wide.labels.size());
  std::size_t mixed = 0, between = 0;
  for (std::size_t i = 0; i < thin.labels.size(); ++i) {
    const Eigen::Vector3d off = point_of(thin, i) - point_of(wide, i);
    mixed += off.head<2>().norm() + std::abs(off.z()) > 0.2;
    between += class_of(wide.labels[i]) == 1 && class_of(thin.labels[i]) != 1;
  }
  CHECK(mixed > thin.labels.size() / 200);
  CHECK(mixed < thin.labels.size() / 5);
  CHECK(between > 0);
  CHECK(between < mixed);
}

/// Mean horizontal place of each pole (class 80) and trunk (71) in the world.
std::map<std::uint32_t, Eigen::Vector2d> poles_of(const SimulatedScan& scan) {
  std::map<std::uint32_t, Eigen::Vector3d> sums;
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    if (class_of(scan.labels[i]) != 80 && class_of(scan.labels[i]) != 71) continue;
    const Eigen::Vector3d p = scan.T_world_sensor * point_of(scan, i);
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    sums.emplace(instance_of(scan.labels[i]), zero).first->second +=
        Eigen::Vector3d(p.x(), p.y(), 1);
  }
  std::map<std::uint32_t, Eigen::Vector2d> poles;
  for (const auto& [instance, sum] : sums) {
    if (sum.z() >= 10) poles[instance] = sum.head<2>() / sum.z();
  }
  return poles;
}

TEST_CASE("de-skewing takes the motion within a scan away as far as it is known") {
  Config config = test::drive_of(Scene::kStatic, Sensor::kOs1_64, 1, 5);
  config.ego_speed = 20;
  config.static_instances = true;
  const auto instant = poles_of(Simulator(config).scan(0));
  config.rolling_shutter = true;
  const auto error = [&](double share) {
    config.deskewed = share;
    const SimulatedScan scan = Simulator(config).scan(0);
    CHECK(scan.times.empty());
    double sum = 0, common = 0;
    for (const auto& [instance, place] : poles_of(scan)) {
      const auto found = instant.find(instance);
      if (found == instant.end()) continue;
      sum += (found->second - place).norm();
      ++common;
    }
    REQUIRE(common > 3);
    return sum / common;
  };
  CHECK(error(1) < 0.15);   // another side of the pole is seen
  CHECK(error(0.5) > 0.3);  // of up to 2 m
}

TEST_CASE("the drift of written poses grows with the way") {
  Config config = test::drive_of(Scene::kStatic, Sensor::kVlp16, 100, 5);
  config.ego_speed = 10;
  config.max_range = 5;  // only poses count
  config.pose_drift = 0.5;
  double early = 0, late = 0;
  for (config.seed = 1; config.seed <= 6; ++config.seed) {
    Simulator simulator(config);
    const auto error = [&simulator](std::size_t i) {
      const SimulatedScan scan = simulator.scan(i);
      return (scan.T_world_sensor.translation() - scan.T_world_sensor_noisy.translation()).norm();
    };
    CHECK(error(0) == 0.0);
    early += error(10);
    late += error(99);
  }
  CHECK(late > 1.5 * early);
  CHECK(late / 6 == Approx(0.5 * 1.6).epsilon(0.5));  // mean length of three errors
}

}  // namespace
}  // namespace dynains::simulation
