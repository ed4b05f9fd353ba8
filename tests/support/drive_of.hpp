// Configurations of simulated drives.
#pragma once

#include <cstdint>

#include "simulation/config.hpp"

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

}  // namespace dynains::test
