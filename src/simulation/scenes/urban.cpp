#include <algorithm>
#include <cmath>
#include <utility>

#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {

World urban(const Config& config) {
  const double speed = 8.5;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets;
  const double width = random.unit();
  const double half_width = width < 0.25 ? 3.9 : width < 0.7 ? 5.8 : 8.2;
  streets.push_back({route_of_bends(winding(random, length, 0.006, 0.35, 17)), half_width,
                     random.uniform(2.4, 4.0)});
  const auto crossings = add_side_streets(random, streets, 85, 4.0);
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.005, 0.03);
  Builder builder(config, ground, std::move(streets));

  const StreetLanes lanes = add_crossing_traffic(builder, crossings, speed, kBefore);
  const double end = kBefore + travel(config, speed) + 40;
  if (builder.lively()) {
    if (half_width > 5) add_parking_moves(builder, kBefore - 20, end, builder.count(8), 7);
    fill_lane(builder, lanes.forward, 38, speed, 0.08, 0.05, 0.06);
    fill_lane(builder, lanes.backward, 30, speed, 0.08, 0.05, 0.06);
  }
  Frontage look;
  look.buildings = random.uniform(0.55, 0.95);
  look.street_trees = random.uniform(0.2, 0.7);
  look.parked = random.uniform(0.35, 0.85);
  look.height = random.uniform(7, 16);
  look.setback = random.uniform(0.2, 5);
  for (std::size_t i = 0; i < builder.terrain().streets().size(); ++i) {
    Frontage side = look;
    side.buildings = i == 0 ? look.buildings : 0.8 * look.buildings;
    builder.furnish(builder.street(i), 1, side);
    builder.furnish(builder.street(i), -1, side);
  }
  const double walk_from = kBefore - 50, walk_to = end + 30;
  builder.pavement_walkers(builder.street(0), walk_from, walk_to,
                           builder.count(0.16 * (walk_to - walk_from)));
  builder.crossing_walkers(builder.street(0), walk_from, walk_to, builder.count(5));
  return builder.finish();
}

}  // namespace dynains::simulation
