// Everything that a scene consists of.
#pragma once

#include <cstdint>
#include <vector>

#include "simulation/config.hpp"
#include "simulation/terrain.hpp"
#include "simulation/traffic.hpp"

namespace dynains::simulation {

/// A primitive that never moves.
struct StaticPart {
  Primitive primitive;  ///< world frame
  std::uint32_t model;  ///< number of the thing that it is a part of
};

struct World {
  Terrain terrain;
  Traffic traffic;
  std::vector<StaticPart> statics = {};
  std::uint32_t models = 0;  ///< of `statics`
};

/// Seed for a purpose, which differs from day to day.
inline std::uint64_t seed_of_day(const Config& config, std::uint64_t purpose) {
  const std::uint64_t seed = mix(config.seed, purpose);
  return config.day == 0 ? seed : mix(seed, static_cast<std::uint64_t>(config.day));
}

/// The scene at its start time.
World build_scene(const Config& config);
/// The scene with the changes up to the day of the configuration.
World build_world(const Config& config);

}  // namespace dynains::simulation
