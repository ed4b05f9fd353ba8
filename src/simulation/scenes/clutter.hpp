// Thin things and small furniture beside any street, and the people among them.
#pragma once

#include "simulation/scenes/builder.hpp"

namespace dynains::simulation {

/// Signs, bicycles, railings, palings, wires and trolleys beside street 0, people who linger, and
/// groups with prams. `amount` is the ratio to the usual number.
void add_clutter(Builder& builder, double amount);

}  // namespace dynains::simulation
