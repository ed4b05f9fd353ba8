#include <algorithm>
#include <cmath>
#include <utility>

#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {

World hill(const Config& config) {
  const double speed = 9;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.012, 0.15, 20)),
                     random.chance(0.5) ? 5.8 : 3.9, 2.2});
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.055, 0.08);
  ground.hill_length = random.uniform(110, 220);
  ground.roughness = 0.08;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const std::size_t forward = builder.lane(street, -kLaneHalf),
                    backward = builder.lane(street, kLaneHalf);
  builder.ego(forward, kBefore, speed);
  const double end = kBefore + travel(config, speed) + 40;
  if (builder.lively()) {
    if (street.half_width > 5) add_parking_moves(builder, kBefore - 20, end, builder.count(4), 7);
    fill_lane(builder, forward, 40, speed, 0.1, 0.05, 0.05);
    fill_lane(builder, backward, 32, speed, 0.1, 0.05, 0.05);
  }
  Frontage look;
  look.buildings = random.uniform(0.3, 0.65);
  look.height = 7;
  look.setback = 5;
  look.street_trees = 0.25;
  look.parked = random.uniform(0.2, 0.6);
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  const double trees = random.uniform(4, 15), bushes = random.uniform(5, 20);
  builder.plant(street, street.half_width + street.pavement + 1, 50, trees, bushes);
  builder.pavement_walkers(street, kBefore - 40, end + 20, builder.count(20));
  builder.crossing_walkers(street, kBefore, end, builder.count(3));
  return builder.finish();
}

}  // namespace dynains::simulation
