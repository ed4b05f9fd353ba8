// Scenes at walking pace.
#include <algorithm>
#include <cmath>

#include "simulation/scenes/builder.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {
namespace {

constexpr double kStartOnSquare = 80;  // m along the street

/// Trees, street furniture and stalls between the walkers.
void furnish_square(Builder& builder, Random& random, double length, double side_of_ego) {
  const Street& street = builder.street();
  for (double s = 5; s < length - 5; s += random.uniform(7, 14)) {
    const double lateral = random.either_sign(0.5, 0.85) * street.half_width;
    const Waypoint at = street.centre.beside(s, lateral);
    Random model_random = random.fork(random.bits());
    const double kind = random.unit();
    if (std::abs(lateral - side_of_ego) < 2.2) continue;
    if (kind < 0.45) {
      const double tall = model_random.uniform(5, 9), radius = model_random.uniform(1.5, 2.8);
      builder.tree(at.position, tall, radius, 2.3);
    } else if (kind < 0.8) {
      builder.place(furniture_model(model_random), {at.position, at.heading, 0.8, 0.35});
    } else {
      builder.place(shelter_model(3, 2.2, 2.4), {at.position, at.heading, 1.5, 1.1});
    }
  }
}

/// One group of one to four people; a quarter of the groups walk along a wall.
void add_group(Builder& builder, Random& random, double from, double to) {
  const Street& street = builder.street();
  const double half = street.half_width;
  const double s = random.uniform(from, to), mood = random.unit(), when = random.uniform(1.5, 11);
  const bool along_wall = random.chance(0.25);
  const double side = random.chance(0.5) ? 1 : -1;
  const double lateral = along_wall ? side * (half - 0.1) : random.uniform(-0.85, 0.85) * half;
  const double run = random.either_sign(15, 60);
  const double drift = along_wall ? 0 : random.uniform(-0.3, 0.3) * half;
  const double pace = random.uniform(0.7, 1.7);
  const auto company = random.chance(0.35) ? 1 + random.index(3) : 0;
  const Vec2 ego = builder.traffic().lanes[0].route.at(kStartOnSquare).position;
  for (std::size_t k = 0; k <= company; ++k) {
    // Two walk side by side.
    const double beside = 0.65 * static_cast<double>(k % 2) * (lateral > 0 ? -1 : 1);
    const std::size_t row = k / 2;
    const double behind = -0.7 * static_cast<double>(row);
    std::vector<Vec2> goals;
    for (int step = 0; step <= 3; ++step) {
      const double u = step / 3.0;
      const double l = std::clamp(lateral + drift * u + beside, -half + 0.05, half - 0.05);
      goals.push_back(street.centre.beside(s + run * u + behind, l).position);
    }
    if (norm(goals[0] - ego) < 2.0) continue;
    builder.walker(std::move(goals), pace, pause_of(mood, 0.12, 0.25, 0.9, when));
  }
}

void add_cyclists(Builder& builder, Random& random, double length) {
  Traffic& traffic = builder.traffic();
  for (int i = 0; i < 3; ++i) {
    const double s = kStartOnSquare + random.uniform(-40, 60), side = random.chance(0.5) ? 1 : -1;
    const double lateral = side * random.uniform(0.2, 0.45) * builder.street().half_width;
    const bool with = random.chance(0.5);
    const std::size_t object = traffic.add_object(Kind::kCyclist);
    const std::size_t path = traffic.add_lane(builder.street().centre.shifted(
        with ? 0 : length, with ? length : 0, [lateral](double) { return lateral; }));
    const double along = with ? s : traffic.lanes[path].route.length() - s;
    if (std::abs(s - kStartOnSquare) < 5) {
      traffic.objects.pop_back();
    } else {
      traffic.add_driver(object, path, along, 3.2);
    }
  }
}

/// Trees from the edge of the track on, dense at first.
void add_trees(Builder& builder, Random& random) {
  const Street& street = builder.street();
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

/// Walkers on the track, in twos at times.
void add_hikers(Builder& builder, Random& random, double from, double to) {
  for (int i = 0; i < builder.count(16); ++i) {
    const double s = random.uniform(from, to), pace = random.uniform(1.0, 2.6);
    const double run = random.either_sign(30, 90), lateral = random.either_sign(0.3, 1.3);
    const double stop = random.chance(0.2) ? random.uniform(2, 10) : 1e9;
    builder.walker(builder.way_along(s, run, 4, lateral), pace, {0, stop});
    if (!random.chance(0.4)) continue;
    builder.walker(builder.way_along(s, run, 4, lateral + (lateral > 0 ? -0.7 : 0.7)), pace,
                   {0, stop});
  }
}

}  // namespace

World crowd(const Config& config, Random random) {
  const double speed = 1.2;
  const double drive = travel(config, speed), length = 2 * kStartOnSquare + drive + 20;
  const double half = random.uniform(6, 11);
  std::vector<Street> streets{{winding(random, length, 0.008), half, 0}};
  TerrainConfig ground;
  ground.street_label = semantic::kSidewalk;
  ground.kerb = 0;
  ground.hill_slope = random.uniform(0.002, 0.02);
  Builder builder(config, ground, std::move(streets));
  const double side_of_ego = random.uniform(-0.3, 0.3) * half;
  const std::size_t lane = builder.traffic().add_lane(builder.street().centre.shifted(
      0, length, [side_of_ego](double s) { return side_of_ego + 0.6 * std::sin(s / 9); }));
  builder.ego(lane, kStartOnSquare, speed, true);
  Frontage look;
  look.buildings = 0.95;
  look.setback = 0.6;
  look.parked = 0;
  for (const int side : {-1, 1}) builder.furnish(builder.street(), side, look);
  furnish_square(builder, random, length, side_of_ego);
  const double from = kStartOnSquare - 45, to = kStartOnSquare + drive + 55;
  const int number = builder.count(std::min(0.85 * (to - from), 2000.0));
  for (int i = 0; i < number; ++i) add_group(builder, random, from, to);
  if (builder.lively()) add_cyclists(builder, random, length);
  return builder.finish();
}

World forest(const Config& config, Random random) {
  const double speed = 1.4, drive = travel(config, speed), start = 60;
  const double length = 2 * start + drive + 40;
  std::vector<Street> streets{{winding(random, length, 0.03), 1.7, 0}};
  TerrainConfig ground{random.uniform(0.02, 0.08), 60, 0.18, 0};
  ground.street_label = ground.open_label;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street();
  builder.ego(builder.lane(street, -0.4), start, speed);
  builder.traffic().objects[0].size = {0.8, 0.6, 0.9};
  add_trees(builder, random);
  builder.plant(street, street.half_width + 0.3, 20, 0, random.uniform(60, 120));
  if (builder.lively()) builder.fill_lane({builder.lane(street, 0.5), 35, 4, 0, 0, 1});
  add_hikers(builder, random, start - 40, start + drive + 50);
  return builder.finish();
}

}  // namespace dynains::simulation
