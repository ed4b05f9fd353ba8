// Streets before anything stands on them.
#pragma once

#include <vector>

#include "simulation/config.hpp"
#include "simulation/random.hpp"
#include "simulation/street.hpp"

namespace dynains::simulation {

inline constexpr double kBefore = 140.0;   ///< m of street behind the start and beyond the end
inline constexpr double kLaneHalf = 1.75;  ///< m from the centre line to the middle of a lane

/// One bend of the main street: constant curvature over a length.
struct Bend {
  double length, curvature;
};

/// Points `step` (m) apart. The curvature changes by at most `swerve` (1/m) from one to the next:
/// no driver turns the wheel at once.
Route route_of_bends(const std::vector<Bend>& bends, double step = 1, double swerve = 0.006);

/// Straight, along x.
Route straight_route(double length);

/// How far the ego vehicle drives, m. A negative speed in the configuration means `usual_speed`.
double travel(const Config& config, double usual_speed);

/// Gentle bends and now and then a corner, alternating so that the street never meets itself.
/// `corner_radius`: m, about.
Route winding(Random& random, double length, double gentle, double corner_chance = 0,
              double corner_radius = 17);

/// Straight streets across the main one, where that is straight.
struct Crossing {
  double main_s;
  std::size_t street;
};

std::vector<Crossing> add_side_streets(Random& random, std::vector<Street>& streets, double spacing,
                                       double half_width);

}  // namespace dynains::simulation
