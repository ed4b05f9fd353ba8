#include <algorithm>
#include <cmath>
#include <utility>

#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {

World vegetation(const Config& config) {
  const double speed = 6;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.015, 0, 17)), 3.4, 0});
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.01, 0.05);
  ground.hill_length = 90;
  ground.roughness = 0.16;
  ground.kerb = 0;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const std::size_t forward = builder.lane(street, -1.6), backward = builder.lane(street, 1.6);
  builder.ego(forward, kBefore, speed);
  fill_lane(builder, forward, 75, speed, 0.05, 0, 0.15);
  fill_lane(builder, backward, 60, 1.3 * speed, 0.05, 0, 0.2);
  const double trees = random.uniform(40, 80), bushes = random.uniform(50, 100);
  builder.plant(street, 4.4, 45, trees, bushes);
  for (const int side : {-1, 1}) {
    if (!random.chance(0.4)) continue;
    add_barrier(builder, street, side * 4.6, 6, [&builder](Random& r) {
      return r.chance(0.6) ? builder.hedge(6, 1.0, r.uniform(0.8, 2.2), r)
                           : fence_model(6, 1.1, true);
    });
  }
  for (int i = 0; i < builder.count(8); ++i) {
    const double s = kBefore + random.uniform(-30, 90), pace = random.uniform(1, 1.8);
    const double lateral = random.either_sign(2.7, 3.2);
    const double run = random.chance(0.5) ? 40 : -40;
    const double start = random.chance(0.2) ? random.uniform(2, 8) : 0;
    builder.walker({street.centre.beside(s, lateral).position,
                    street.centre.beside(s + run / 2, lateral).position,
                    street.centre.beside(s + run, lateral).position},
                   pace, start);
  }
  return builder.finish();
}

}  // namespace dynains::simulation
