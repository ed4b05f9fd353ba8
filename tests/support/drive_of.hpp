// Configurations of simulated drives, and the points of their scans.
#pragma once

#include "simulation/simulator.hpp"
#include "support/standard.hpp"

namespace dynains::test {

inline simulation::Config drive_of(simulation::Scene scene, simulation::Sensor sensor, int scans,
                                   std::uint64_t seed) {
  simulation::Config config;
  config.scene = scene;
  config.sensor = sensor;
  config.scans = scans;
  config.seed = seed;
  return config;
}

/// Without noise of ranges and without lost beams.
inline simulation::Config exact_drive_of(simulation::Scene scene, simulation::Sensor sensor,
                                         int scans, std::uint64_t seed) {
  simulation::Config config = drive_of(scene, sensor, scans, seed);
  config.range_noise = 0.0;
  config.dropout = 0.0;
  return config;
}

/// Point i, m, sensor frame.
inline Eigen::Vector3d point_of(const simulation::SimulatedScan& scan, std::size_t i) {
  return Eigen::Map<const Eigen::Vector3f>(&scan.xyzi[4 * i]).cast<double>();
}

inline std::uint32_t class_of(std::uint32_t label) { return label & 0xFFFFU; }
inline std::uint32_t instance_of(std::uint32_t label) { return label >> 16U; }
inline bool is_moving(std::uint32_t label) {
  return class_of(label) >= 252 && class_of(label) <= 259;
}

}  // namespace dynains::test
