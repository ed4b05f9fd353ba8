// What must not matter: where the world's origin is, which way the sensor's x axis points, and in
// which order points come.
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evaluation/evaluate.hpp"
#include "dynains/simulation/simulator.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/remover.hpp"

namespace dynains::test {
namespace {

using simulation::SimulatedScan;

std::vector<SimulatedScan> street() {
  simulation::Config config;
  config.scene = simulation::Scene::kUrban;
  config.sensor = simulation::Sensor::kOs1_64;
  config.scans = 50;
  config.seed = 5;
  simulation::Simulator simulator(config);
  std::vector<SimulatedScan> scans;
  for (std::size_t i = 0; i < simulator.size(); ++i) scans.push_back(simulator.scan(i));
  return scans;
}

/// By scan: whether each point is static by its final verdict.
using StaticPoints = std::vector<std::vector<std::uint8_t>>;

/// The remover takes the poses moved by `T_moved_world`.
StaticPoints static_points(const std::vector<SimulatedScan>& scans,
                           const Eigen::Isometry3d& T_moved_world = Eigen::Isometry3d::Identity()) {
  StaticPoints result(scans.size());
  const auto keep = [&](const ScanVerdict& verdict) {
    for (const PointLabel label : verdict.labels) {
      result.at(verdict.scan).push_back(is_static(label) ? 1 : 0);
    }
  };
  DynaInsRemover remover;
  for (const SimulatedScan& scan : scans) {
    const RawPoints<float> points{scan.xyzi.data(), scan.xyzi.size() / 4, 4};
    const FrameResult frame = remover.push(points, T_moved_world * scan.T_world_sensor, scan.time);
    if (frame.finished) keep(*frame.finished);
  }
  remover.flush(keep);
  return result;
}

double score(const std::vector<SimulatedScan>& scans, const StaticPoints& in_map) {
  const auto source = [&](std::size_t i, evaluation::LabelledScan& scan) {
    if (i == scans.size()) return false;
    scan.xyz = scans[i].xyzi.data();
    scan.stride = 4;
    scan.T_world_sensor = scans[i].T_world_sensor;
    scan.time = scans[i].time;
    scan.truth = scans[i].labels;
    scan.in_map = in_map[i];
    return true;
  };
  evaluation::EvaluationConfig config;
  config.max_range = 50.0;
  return evaluation::evaluate(source, {"final"}, {}, config).rows[2].voxels.f1();
}

double score(const std::vector<SimulatedScan>& scans) { return score(scans, static_points(scans)); }

/// The same scans of a sensor that is turned about its z axis.
std::vector<SimulatedScan> turned(std::vector<SimulatedScan> scans, double angle) {
  const Eigen::Isometry3d T_turned_sensor(
      Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix());
  for (SimulatedScan& scan : scans) {
    scan.T_world_sensor = scan.T_world_sensor * T_turned_sensor.inverse();
    for (std::size_t i = 0; i + 3 < scan.xyzi.size(); i += 4) {
      const Eigen::Vector3d p(scan.xyzi[i], scan.xyzi[i + 1], scan.xyzi[i + 2]);
      Eigen::Map<Eigen::Vector3f>(&scan.xyzi[i]) = (T_turned_sensor * p).cast<float>();
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
  const std::vector<SimulatedScan> scans = street();
  const StaticPoints in_map = static_points(scans);
  const double plain = score(scans, in_map);
  INFO("F1 " << plain);
  REQUIRE(plain > 0.9);

  Eigen::Isometry3d T_moved_world = Eigen::Isometry3d::Identity();
  T_moved_world.translate(Eigen::Vector3d(5.0e5, -4.2e6, 300.0));
  T_moved_world.rotate(Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.3, -0.2, 1.0).normalized()));
  const StaticPoints in_moved_map = static_points(scans, T_moved_world);
  CHECK(std::abs(score(scans, in_moved_map) - plain) <= 0.002);
  // Not even a label changes, but where rounding decides.
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
    CHECK(std::abs(score(turned(scans, angle)) - plain) <= 0.002);
  }
  CHECK(std::abs(score(shuffled(scans)) - plain) <= 0.002);
}

}  // namespace
}  // namespace dynains::test
