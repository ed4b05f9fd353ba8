// Results do not depend on the origin of the world, on the direction of the sensor's x axis, or on
// the order of the points.

#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/random.hpp"
#include "support/simulated_runs.hpp"

namespace dynains::test {
namespace {

using simulation::SimulatedScan;

double f1(const std::vector<SimulatedScan>& scans, const StaticPoints& in_map) {
  return score(scans, in_map).f1();
}
double f1(const std::vector<SimulatedScan>& scans) { return f1(scans, static_points(scans).final); }

/// The scans of a sensor that is turned about its z axis.
std::vector<SimulatedScan> turned(std::vector<SimulatedScan> scans, double angle) {
  const Eigen::Isometry3d T_turned_sensor(
      Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix());
  for (SimulatedScan& scan : scans) {
    scan.T_world_sensor = scan.T_world_sensor * T_turned_sensor.inverse();
    for (std::size_t i = 0; i + 3 < scan.xyzi.size(); i += 4) {
      Eigen::Map<Eigen::Vector3f> p(&scan.xyzi[i]);
      p = (T_turned_sensor * p.cast<double>()).cast<float>();
    }
  }
  return scans;
}

std::vector<SimulatedScan> shuffled(const std::vector<SimulatedScan>& scans) {
  Random random(3);
  std::vector<SimulatedScan> result = scans;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const std::vector<std::size_t> order = random.permutation(scans[s].labels.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      result[s].labels[i] = scans[s].labels[order[i]];
      for (std::size_t k = 0; k < 4; ++k) {
        result[s].xyzi[4 * i + k] = scans[s].xyzi[4 * order[i] + k];
      }
    }
  }
  return result;
}

TEST_CASE("a moved world, a turned sensor and shuffled points change F1 by at most 0.002") {
  const std::vector<SimulatedScan> scans =
      simulate(drive_of(simulation::Scene::kUrban, simulation::Sensor::kOs1_64, 50, 5));
  const StaticPoints in_map = static_points(scans).final;
  const double plain = f1(scans, in_map);
  INFO("F1 " << plain);
  REQUIRE(plain > 0.9);

  const Eigen::Isometry3d T_moved_world =
      Eigen::Translation3d(5.0e5, -4.2e6, 300.0) *
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.3, -0.2, 1.0).normalized());
  std::vector<SimulatedScan> moved = scans;
  for (SimulatedScan& scan : moved) scan.T_world_sensor = T_moved_world * scan.T_world_sensor;
  const StaticPoints in_moved_map = static_points(moved).final;
  CHECK(std::abs(f1(scans, in_moved_map) - plain) <= 0.002);
  // Labels change only where rounding decides.
  std::size_t count = 0, different = 0;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    count += in_map[s].size();
    for (std::size_t i = 0; i < in_map[s].size(); ++i) {
      different += in_map[s][i] != in_moved_map[s][i] ? 1 : 0;
    }
  }
  INFO(different << " of " << count << " labels differ");
  CHECK(10000 * different <= count);
  for (const double angle : {0.7, 2.9, -1.3}) {
    INFO("turned by " << angle);
    CHECK(std::abs(f1(turned(scans, angle)) - plain) <= 0.002);
  }
  CHECK(std::abs(f1(shuffled(scans)) - plain) <= 0.002);
}

}  // namespace
}  // namespace dynains::test
