#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {
namespace {

constexpr double kPaceInHall = 1.0;  // m/s
constexpr double kPanel = 8.0;       // m, of walls and of the ceiling

/// The hall extends along x from 0, and to both sides of y = 0.
struct Hall {
  double length, half_width, height;  // m
};

/// Ceiling with beams, end walls, a side wall, and a glass front on the other side.
void build_shell(Builder& builder, const Hall& hall) {
  for (double x = kPanel / 2; x < hall.length; x += kPanel) {
    for (double y = -hall.half_width; y < hall.half_width; y += kPanel) {
      builder.place_anyway(slab_model(kPanel, kPanel, hall.height, hall.height + 0.3),
                           {{x, y + kPanel / 2}, 0});
    }
    builder.place_anyway(slab_model(0.3, 2 * hall.half_width, hall.height - 0.6, hall.height),
                         {{x, 0}, 0});
    builder.place_anyway(wall_model(kPanel, hall.height), {{x, hall.half_width}, 0});
    builder.place_anyway(glass_front_model(kPanel, hall.height), {{x, -hall.half_width}, kPi});
  }
  for (double y = -hall.half_width + kPanel / 2; y < hall.half_width; y += kPanel) {
    builder.place_anyway(wall_model(kPanel, hall.height), {{0, y}, kPi / 2});
    builder.place_anyway(wall_model(kPanel, hall.height), {{hall.length, y}, -kPi / 2});
  }
}

/// Columns, stalls and furniture beside the way of the sensor.
void furnish(Builder& builder, Random& random, const Hall& hall) {
  for (double x = 8; x < hall.length - 4; x += 8) {
    for (const double side : {-0.55, 0.55}) {
      builder.place(column_model(0.6, hall.height), {{x, side * hall.half_width}, 0, 0.3, 0.3});
    }
  }
  for (double x = 4; x < hall.length - 4; x += random.uniform(3, 6)) {
    const double y = random.either_sign(0.3, 0.95) * hall.half_width;
    Random model_random = random.fork(random.bits());
    const double heading = random.uniform(-0.2, 0.2), kind = random.unit();
    if (std::abs(y) < 2.5) continue;
    if (kind < 0.5) {
      const double length = model_random.uniform(2, 4), depth = model_random.uniform(1.5, 2.5);
      builder.place(stall_model(length, depth, model_random),
                    {{x, y}, heading, length / 2, depth / 2});
    } else {
      builder.place(furniture_model(model_random), {{x, y}, heading, 0.8, 0.35});
    }
  }
}

/// People who walk from place to place, or stand at stalls for some time.
void add_people(Builder& builder, Random& random, const Hall& hall, double from, double to) {
  const int people = builder.count(std::min(0.9 * (to - from), 1000.0));
  for (int i = 0; i < people; ++i) {
    std::vector<Vec2> goals{
        {random.uniform(from, to), random.uniform(-0.9, 0.9) * hall.half_width}};
    for (int step = 0; step < 4; ++step) {
      const double x = std::clamp(goals.back().x + random.either_sign(4, 20), 2.0, hall.length - 2);
      goals.push_back({x, random.uniform(-0.9, 0.9) * hall.half_width});
    }
    const double pace = random.uniform(0.6, 1.5), mood = random.unit();
    const double when = random.uniform(2, 12);
    builder.walker(std::move(goals), pace,
                   mood < 0.15  ? 1e9
                   : mood < 0.3 ? when
                                : 0,
                   mood > 0.85 ? when : 1e9);
  }
}

/// Passers-by and a road outside, seen through the glass.
void add_outside(Builder& builder, Random& random, const Hall& hall, double from, double to) {
  for (int i = 0; i < builder.count(8); ++i) {
    const double x = random.uniform(from, to), y = -hall.half_width - random.uniform(1.5, 4);
    const double run = random.either_sign(20, 60);
    builder.walker({{x, y}, {x + run / 2, y}, {x + run, y}}, random.uniform(1.0, 1.7));
  }
}

}  // namespace

World hall(const Config& config) {
  Random random(mix(config.seed, 77));
  const double drive = travel(config, kPaceInHall), start = 15;
  const Hall hall{2 * start + drive + 20, random.uniform(9, 18), random.uniform(3.5, 7)};
  std::vector<Street> streets;
  streets.push_back({Route({{0, 0}, {hall.length / 2, 0}, {hall.length, 0}}), hall.half_width, 0});
  TerrainConfig ground;
  ground.hill_slope = 0.0005;
  ground.roughness = 0.003;
  ground.kerb = 0;
  ground.street_label = semantic::kSidewalk;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const std::size_t way = builder.traffic().add_lane(
      street.centre.shifted(0, hall.length, [](double s) { return 1.2 * std::sin(s / 7); }));
  builder.ego(way, start, kPaceInHall);
  builder.traffic().objects[0].size = {0.8, 0.6, 0.9};
  build_shell(builder, hall);
  furnish(builder, random, hall);
  add_people(builder, random, hall, start - 12, start + drive + 20);
  add_outside(builder, random, hall, start - 12, start + drive + 20);
  return builder.finish();
}

}  // namespace dynains::simulation
