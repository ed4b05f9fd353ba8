// The place where rays begin, in clouds that were moved into a body frame.
#include "dynains/poses/sensor_origin.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "dynains/io/kitti.hpp"
#include "dynains/simulation/random_world.hpp"
#include "dynains/simulation/simulator.hpp"
#include "dynains/simulation/write_sequence.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"

namespace dynains::test {
namespace {

using simulation::Scene;
using simulation::Sensor;
namespace fs = std::filesystem;

/// Scans with the sensor at `origin` (m) in their frame.
std::vector<PointBuffer> moved(std::vector<PointBuffer> scans, const Eigen::Vector3f& origin) {
  for (PointBuffer& scan : scans) {
    for (std::size_t i = 0; i < scan.size(); ++i) {
      scan.x[i] += origin.x();
      scan.y[i] += origin.y();
      scan.z[i] += origin.z();
    }
  }
  return scans;
}

/// Four scans of a drive, sensor frame.
std::vector<PointBuffer> scans_of(Scene scene, Sensor sensor) {
  const simulation::Config config = drive_of(scene, sensor, 40, 8);
  simulation::Simulator simulator(config);
  std::vector<PointBuffer> scans;
  for (const std::size_t i : {0U, 13U, 26U, 39U}) {
    const simulation::SimulatedScan scan = simulator.scan(i);
    scans.emplace_back();
    for (std::size_t k = 0; k + 3 < scan.xyzi.size(); k += 4) {
      scans.back().push_back(scan.xyzi[k], scan.xyzi[k + 1], scan.xyzi[k + 2]);
    }
  }
  return scans;
}

TEST_CASE("The place where beams meet is found, and nothing if it is the origin") {
  const auto [scene, sensor] = GENERATE(table<Scene, Sensor>({{Scene::kUrban, Sensor::kOs1_64},
                                                              {Scene::kCrowd, Sensor::kVlp16},
                                                              {Scene::kHighway, Sensor::kHdl32}}));
  const std::vector<PointBuffer> scans = scans_of(scene, sensor);
  CHECK_FALSE(find_ray_origin(scans));
  CHECK_FALSE(find_ray_origin(moved(scans, {0.0F, 0.0F, 0.2F})));
  for (const Eigen::Vector3f& origin :
       {Eigen::Vector3f(1.0F, 0.0F, 1.5F), Eigen::Vector3f(1.0F, 0.0F, 0.0F),
        Eigen::Vector3f(0.0F, 0.0F, 1.5F), Eigen::Vector3f(-1.2F, 0.3F, 0.6F)}) {
    INFO("sensor at " << origin.transpose());
    const auto found = find_ray_origin(moved(scans, origin));
    REQUIRE(found);
    REQUIRE(found->known == RayOrigin::Known::kPosition);
    CHECK((found->position - origin.cast<double>()).norm() < 0.1);
    CHECK(found->hidden < found->hidden_as_given);
  }
}

TEST_CASE("Rays that begin along the way of a scan are those of compensated motion") {
  constexpr float kWay = 3.0F;  // m during a scan, which begins at azimuth 0
  std::vector<PointBuffer> scans = scans_of(Scene::kUrban, Sensor::kOs1_64);
  for (PointBuffer& scan : scans) {
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const double turn = std::atan2(scan.y[i], scan.x[i]) / (2.0 * M_PI);
      scan.x[i] += kWay * static_cast<float>(turn < 0.0 ? turn + 1.0 : turn);
    }
  }
  const auto by_scans = find_ray_origin(scans);
  REQUIRE(by_scans);
  REQUIRE(by_scans->known == RayOrigin::Known::kHorizontal);
  const double distance = by_scans->position.norm();

  const TemporaryFolder folder;
  const auto finds_at_step = [&](double step) {
    std::vector<Pose> poses(scans.size(), Pose::Identity());
    for (std::size_t i = 0; i < scans.size(); ++i) {
      std::vector<float> xyzi;
      for (std::size_t k = 0; k < scans[i].size(); ++k) {
        xyzi.insert(xyzi.end(), {scans[i].x[k], scans[i].y[k], scans[i].z[k], 0.0F});
      }
      fs::create_directories(folder / "velodyne");
      write_scan(folder / ("velodyne/" + simulation::scan_name(i) + ".bin"), xyzi);
      poses[i].translation().x() = static_cast<double>(i) * step;
    }
    write_poses(folder / "poses.txt", poses);
    return find_ray_origin(Recording(folder.path()), 0, scans.size() - 1).has_value();
  };
  CHECK(finds_at_step(distance / 0.76));
  CHECK_FALSE(finds_at_step(distance / 0.74));
}

TEST_CASE("Without beams of fixed elevations, clouds of the sensor raise no alarm") {
  CHECK_FALSE(find_ray_origin(scans_of(Scene::kUrban, Sensor::kLivox)));
}

/// Posts before a wall in a view of some width (deg) along x, by rays of any elevation that begin
/// at `origin`.
std::vector<PointBuffer> view_of(double width, const Eigen::Vector2d& origin) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> azimuth(-0.5 * width, 0.5 * width), slope(-0.3, 0.3);
  std::vector<PointBuffer> scans(1);
  for (int k = 0; k < 60000; ++k) {
    const double degrees = azimuth(random);
    const double range = std::fmod(degrees + 360.0, 4.0) < 2.0 ? 6.0 : 18.0;
    const double x = range * std::cos(degrees * M_PI / 180.0);
    const double y = range * std::sin(degrees * M_PI / 180.0);
    scans[0].push_back(static_cast<float>(x + origin.x()), static_cast<float>(y + origin.y()),
                       static_cast<float>(range * slope(random)));
  }
  return scans;
}

TEST_CASE("Shadows show the place where rays begin unless these are nearly parallel") {
  const auto known_in = [](double width) {
    const auto found = find_ray_origin(view_of(width, {0.0, 1.0}));
    return found && found->known == RayOrigin::Known::kHorizontal;
  };
  CHECK(known_in(140.0));
  CHECK(known_in(112.0));
  CHECK_FALSE(known_in(106.0));
  CHECK_FALSE(known_in(70.0));
}

/// The origin that is found in 30 scans of a random world.
std::optional<RayOrigin> origin_in_world(std::uint64_t seed) {
  simulation::Config config = simulation::random_world(seed);
  config.scans = 30;
  simulation::Simulator simulator(config);
  const TemporaryFolder folder;
  REQUIRE(simulation::write_sequence(simulator, folder.path()));
  return find_ray_origin(Recording(folder.path()), 0, 29);
}

TEST_CASE("A sensor that looks ahead below trees raises no alarm") {
  CHECK_FALSE(origin_in_world(21086));
}

TEST_CASE("Beams that meet a little better elsewhere are those of compensated motion") {
  // A motorway, de-skewed clouds: at 0.6 m from the origin, beams are 1.32 times as sharp.
  CHECK_FALSE(origin_in_world(9113));
}

TEST_CASE("The advice names the option with numbers") {
  RayOrigin origin;
  origin.known = RayOrigin::Known::kPosition;
  origin.position = {1.0, -0.001, 1.5};
  CHECK(option_for(origin) == "--sensor-origin \"1.00 0.00 1.50\"");
  CHECK_THAT(advice(origin), ContainsSubstring("pass --sensor-origin \"1.00 0.00 1.50\"."));
  origin.known = RayOrigin::Known::kNothing;
  CHECK_THAT(advice(origin), ContainsSubstring("--sensor-origin \"X Y Z\""));
}

TEST_CASE("Scans with few or no points show nothing") {
  CHECK_FALSE(find_ray_origin(std::vector<PointBuffer>()));
  CHECK_FALSE(find_ray_origin(std::vector<PointBuffer>(3)));
  std::vector<PointBuffer> one(1);
  one[0].push_back(5.0F, 1.0F, 2.0F);
  CHECK_FALSE(find_ray_origin(one));
}

}  // namespace
}  // namespace dynains::test
