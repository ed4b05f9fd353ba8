#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {
namespace {

constexpr double kPaceInForest = 1.4;  // m/s

/// Trees from the edge of the track on, dense at first.
void add_trees(Builder& builder, Random& random, const Street& street) {
  const double per_100_m = random.uniform(110, 180);
  const auto trees = static_cast<int>(street.centre.length() / 100 * per_100_m);
  for (int i = 0; i < trees; ++i) {
    const double s = random.uniform(0, street.centre.length()), u = random.unit();
    const double lateral = street.half_width + 0.6 + 35 * u * std::sqrt(u);
    const double size = random.unit();
    const Vec2 at = street.centre.beside(s, random.chance(0.5) ? lateral : -lateral).position;
    const double height = random.chance(0.25) ? 2 + 4 * size : 9 + 12 * size;  // young or grown
    builder.tree(at, height, 0.15 * height + 0.5, 0.35 * height * random.uniform(0.4, 1.2));
  }
}

/// Walkers, in twos at times, and cyclists on the track.
void add_people(Builder& builder, Random& random, const Street& street, double from, double to) {
  for (int i = 0; i < builder.count(16); ++i) {
    const double s = random.uniform(from, to), pace = random.uniform(1.0, 2.6);
    const double run = random.either_sign(30, 90), lateral = random.either_sign(0.3, 1.3);
    const double stop = random.chance(0.2) ? random.uniform(2, 10) : 1e9;
    const bool in_company = random.chance(0.4);
    for (int k = 0; k <= (in_company ? 1 : 0); ++k) {
      std::vector<Vec2> goals;
      for (int step = 0; step <= 4; ++step) {
        goals.push_back(
            street.centre.beside(s + run * step / 4, lateral + (lateral > 0 ? -0.7 : 0.7) * k)
                .position);
      }
      builder.walker(std::move(goals), pace, 0, stop);
    }
  }
}

}  // namespace

World forest(const Config& config) {
  Random random(mix(config.seed, 77));
  const double drive = travel(config, kPaceInForest), start = 60;
  const double length = 2 * start + drive + 40;
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.03, 0, 17)), 1.7, 0});
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.02, 0.08);
  ground.hill_length = 60;
  ground.roughness = 0.18;
  ground.kerb = 0;
  ground.street_label = ground.open_label;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  builder.ego(builder.lane(street, -0.4), start, kPaceInForest);
  builder.traffic().objects[0].size = {0.8, 0.6, 0.9};
  add_trees(builder, random, street);
  builder.plant(street, street.half_width + 0.3, 20, 0, random.uniform(60, 120));
  if (builder.lively()) fill_lane(builder, builder.lane(street, 0.5), 35, 4, 0, 0, 1);
  add_people(builder, random, street, start - 40, start + drive + 50);
  return builder.finish();
}

}  // namespace dynains::simulation
