// Random worlds: everything that differs from recording to recording, drawn from a seed.
#pragma once

#include <cstdint>

#include "dynains/simulation/config.hpp"

namespace dynains::simulation {

/// A configuration whose scene, sensor, mounting, carrier and disturbances are drawn from `seed`.
/// Static things have instance ids. Poses are exact; length and labelling are the defaults.
/// Recordings of real sensors are meant to lie inside the distribution; random_world.cpp lists the
/// ranges.
Config random_world(std::uint64_t seed);

}  // namespace dynains::simulation
