// Rooms, corridors and tunnels.

#include "support/catch.hpp"
#include "support/drive_of.hpp"

namespace dynains::simulation {
namespace {

struct Seen {
  std::size_t beams = 0, moving = 0;
  double farthest = 0;  ///< m, across the way
  double way = 0;       ///< m
};

Seen look(Scene scene, std::uint64_t seed, int scans) {
  Simulator simulator(test::exact_drive_of(scene, Sensor::kVlp16, scans, seed));
  Seen seen;
  Eigen::Vector3d last = simulator.scan(0).T_world_sensor.translation();
  for (std::size_t i = 0; i < simulator.size(); i += 5) {
    const SimulatedScan scan = simulator.scan(i);
    seen.way += (scan.T_world_sensor.translation() - last).norm();
    last = scan.T_world_sensor.translation();
    if (i == 0) seen.beams = scan.labels.size();
    for (std::size_t k = 0; k < scan.labels.size(); ++k) {
      seen.moving += test::class_of(scan.labels[k]) > 250;
      const Eigen::Vector3d p = test::point_of(scan, k);
      if (i == 0 && std::abs(p.x()) < 2) seen.farthest = std::max(seen.farthest, std::abs(p.y()));
    }
  }
  return seen;
}

}  // namespace

TEST_CASE("rooms of 2 to 15 m, corridors and tunnels are closed, and the sensor moves in them") {
  double least = 1e9, most = 0;
  for (std::uint64_t seed = 5; seed <= 10; ++seed) {
    const Seen room = look(Scene::kRoom, seed, 30);
    CHECK(room.beams > 20000);  // of 28800; the others are nearer than half a metre
    CHECK(room.farthest < 12);
    CHECK(room.way > 0.2);
    least = std::min(least, room.farthest);
    most = std::max(most, room.farthest);
  }
  CHECK(least < 3);
  CHECK(most > 4);
  const Seen corridor = look(Scene::kCorridor, 7, 60);
  CHECK(corridor.farthest < 1.7);
  CHECK(corridor.way > 3);
  CHECK(corridor.moving > 50);
  const Seen tunnel = look(Scene::kTunnel, 3, 60);
  CHECK(tunnel.farthest < 8);
  CHECK(tunnel.way > 40);
  CHECK(tunnel.moving > 1000);
}

}  // namespace dynains::simulation
