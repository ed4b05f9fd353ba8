#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {
namespace {

constexpr double kWalkingSpeed = 1.2;  // m/s
constexpr double kStartOnSquare = 80;  // m along the street

/// Trees, street furniture and stalls between the walkers.
void furnish_square(Builder& builder, Random& random, const Street& street, double length,
                    double side_of_ego) {
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
void add_group(Builder& builder, Random& random, const Street& street, double from, double to) {
  const double half = street.half_width;
  const double s = random.uniform(from, to), mood = random.unit(), when = random.uniform(1.5, 11);
  const bool along_wall = random.chance(0.25);
  const double side = random.chance(0.5) ? 1 : -1;
  const double lateral = along_wall ? side * (half - 0.1) : random.uniform(-0.85, 0.85) * half;
  const double run = random.either_sign(15, 60);
  const double drift = along_wall ? 0 : random.uniform(-0.3, 0.3) * half;
  const double pace = random.uniform(0.7, 1.7);
  const auto company = random.chance(0.35) ? 1 + random.index(3) : 0;
  const double start = mood < 0.12 ? 1e9 : mood < 0.25 ? when : 0;
  const double stop = mood > 0.9 ? when : 1e9;
  for (std::size_t k = 0; k <= company; ++k) {
    const std::size_t row = k / 2;  // two walk side by side
    const double beside = 0.65 * static_cast<double>(k % 2);
    const double behind = -0.7 * static_cast<double>(row);
    std::vector<Vec2> goals;
    for (int step = 0; step <= 3; ++step) {
      const double u = step / 3.0;
      const double l = std::clamp(lateral + drift * u + beside * (lateral > 0 ? -1 : 1),
                                  -half + 0.05, half - 0.05);
      goals.push_back(street.centre.beside(s + run * u + behind, l).position);
    }
    const Vec2 ego = builder.traffic().lanes[0].route.at(kStartOnSquare).position;
    if (norm(goals[0] - ego) < 2.0) continue;
    builder.walker(std::move(goals), pace, start, stop);
  }
}

void add_cyclists(Builder& builder, Random& random, const Street& street, double length) {
  for (int i = 0; i < 3; ++i) {
    const double s = kStartOnSquare + random.uniform(-40, 60), side = random.chance(0.5) ? 1 : -1;
    const double lateral = side * random.uniform(0.2, 0.45) * street.half_width;
    const bool with = random.chance(0.5);
    const std::size_t object = builder.traffic().add_object(Kind::kCyclist);
    const std::size_t path = builder.traffic().add_lane(street.centre.shifted(
        with ? 0 : length, with ? length : 0, [lateral](double) { return lateral; }));
    const double along = with ? s : builder.traffic().lanes[path].route.length() - s;
    if (std::abs(s - kStartOnSquare) < 5) {
      builder.traffic().objects.pop_back();
      continue;
    }
    builder.traffic().add_driver(object, path, along, 3.2);
  }
}

}  // namespace

World crowd(const Config& config) {
  Random random(mix(config.seed, 77));
  const double drive = travel(config, kWalkingSpeed), length = 2 * kStartOnSquare + drive + 20;
  const double half = random.uniform(6, 11);
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.008, 0, 17)), half, 0});
  TerrainConfig ground;
  ground.street_label = semantic::kSidewalk;
  ground.kerb = 0;
  ground.hill_slope = random.uniform(0.002, 0.02);
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const double side_of_ego = random.uniform(-0.3, 0.3) * half;
  const std::size_t lane = builder.traffic().add_lane(street.centre.shifted(
      0, length, [side_of_ego](double s) { return side_of_ego + 0.6 * std::sin(s / 9); }));
  builder.ego(lane, kStartOnSquare, kWalkingSpeed);
  make_robot(builder.traffic());

  Frontage look;
  look.buildings = 0.95;
  look.setback = 0.6;
  look.parked = 0;
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  furnish_square(builder, random, street, length, side_of_ego);
  const double from = kStartOnSquare - 45, to = kStartOnSquare + drive + 55;
  const int number = builder.count(std::min(0.85 * (to - from), 2000.0));
  for (int i = 0; i < number; ++i) add_group(builder, random, street, from, to);
  if (builder.lively()) add_cyclists(builder, random, street, length);
  return builder.finish();
}

}  // namespace dynains::simulation
