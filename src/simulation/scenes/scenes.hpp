// One function per scene.
#pragma once

#include "simulation/world.hpp"

namespace dynains::simulation {

World urban(const Config& config);
World highway(const Config& config);
World vegetation(const Config& config);
World crowd(const Config& config);
World stop_and_go(const Config& config);
World canopy(const Config& config);
World hill(const Config& config);
World car_park(const Config& config);
World garage(const Config& config);
World mixed(const Config& config);
World hall(const Config& config);
World forest(const Config& config);

}  // namespace dynains::simulation
