// Several sensors in one cloud, in the frame of the body.

#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "simulation/write_sequence.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"

namespace dynains::simulation {
namespace {

Config corners(int scans) {
  Config config = test::exact_drive_of(Scene::kUrban, Sensor::kVlp16, scans, 3);
  config.rig = Rig::kCorners;
  return config;
}

}  // namespace

TEST_CASE("rig: points are in the frame of the body, and rings of one clock those of their mount") {
  Simulator simulator(corners(2));
  const std::vector<Pose> mounts = simulator.mounts();
  REQUIRE(mounts.size() == 2);
  const SimulatedScan scan = simulator.scan(1);
  REQUIRE(scan.sensors.size() == scan.labels.size());
  CHECK(std::abs(scan.T_world_sensor(2, 2)) > 0.99);
  std::set<long> rings[2];
  std::size_t count[2] = {0, 0}, near_ground = 0, level = 0;
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    const Eigen::Vector3d p = test::point_of(scan, i);
    const std::size_t k = scan.sensors[i];
    REQUIRE(k < 2);
    ++count[k];
    const Eigen::Vector3d q = mounts[k].inverse() * p;
    rings[k].insert(std::lround(10 * std::asin(q.z() / q.norm()) * 57.29578));
    if (test::class_of(scan.labels[i]) != 40 || p.norm() > 8) continue;
    ++near_ground;
    level += std::abs(p.z()) < 0.15;  // the body stands on the street
  }
  CHECK(std::min(count[0], count[1]) > 15000);
  CHECK(near_ground > 500);
  CHECK(20 * level > 19 * near_ground);
  CHECK(rings[0].size() <= 32);  // 16 rings, each with an error of its own
  CHECK(rings[1].size() > 64);   // moved to the stamp from 45 ms later, at 8 m/s
}

TEST_CASE("rig: a folder has the sensor of each point and the poses of the sensors") {
  const test::TemporaryFolder folder;
  Simulator simulator(corners(2));
  REQUIRE(write_sequence(simulator, folder.path()));
  const SimulatedScan scan = simulator.scan(1);
  const std::string ids = test::read_text(folder / "sensor/000001.id");
  CHECK(ids == std::string(scan.sensors.begin(), scan.sensors.end()));
  std::istringstream rows(test::read_text(folder / "sensors.txt"));
  for (const Pose& mount : simulator.mounts()) {
    for (int i = 0; i < 12; ++i) {
      double value = 0;
      REQUIRE(rows >> value);
      CHECK(value == Approx(mount(i / 4, i % 4)).margin(1e-6));
    }
  }
  CHECK_FALSE(std::filesystem::exists(folder / "sensor/000002.id"));
}

TEST_CASE("rig: a rolling shutter is refused") {
  Config config = corners(1);
  config.rolling_shutter = true;
  CHECK_THROWS_AS(Simulator(config), ConfigError);
}

}  // namespace dynains::simulation
