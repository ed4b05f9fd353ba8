// Traffic that several scenes share.
#pragma once

#include <functional>
#include <vector>

#include "simulation/scenes/builder.hpp"
#include "simulation/scenes/layout.hpp"

namespace dynains::simulation {

/// Two-way traffic with lights at the crossings, and vehicles that turn there.
struct StreetLanes {
  std::size_t forward, backward;
};

StreetLanes add_crossing_traffic(Builder& builder, const std::vector<Crossing>& crossings,
                                 double speed, double ego_s);

/// Makes the ego vehicle a robot, which keeps less distance than a car.
void make_robot(Traffic& traffic);

/// Vehicles all along a lane, as many as the configuration asks for.
void fill_lane(Builder& builder, Traffic::Flow flow);

/// Cars that leave their places and cars that park, along the stretch that is driven.
void add_parking_moves(Builder& builder, double from, double to, int number, double speed);

/// Rails, walls or hedges along a street at a fixed distance from its centre line.
void add_barrier(Builder& builder, const Street& street, double lateral, double piece,
                 const std::function<Model(Random&)>& model);

}  // namespace dynains::simulation
