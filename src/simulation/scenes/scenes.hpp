// One function per scene. `random` is the stream of its layout.
#pragma once

#include "simulation/world.hpp"

namespace dynains::simulation {

World urban(const Config& config, Random random);
World highway(const Config& config, Random random);
World vegetation(const Config& config, Random random);
World crowd(const Config& config, Random random);
World stop_and_go(const Config& config, Random random);
World canopy(const Config& config, Random random);
World hill(const Config& config, Random random);
World car_park(const Config& config, Random random);
World garage(const Config& config, Random random);
World mixed(const Config& config, Random random);
World hall(const Config& config, Random random);
World forest(const Config& config, Random random);
World room(const Config& config, Random random);
World corridor(const Config& config, Random random);
World tunnel(const Config& config, Random random);

}  // namespace dynains::simulation
