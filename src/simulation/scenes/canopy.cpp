#include <algorithm>
#include <cmath>
#include <utility>

#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {

namespace {

/// A bridge over the street; returns its width along the street (m).
double add_bridge(Builder& builder, Random& random, const Street& street, double s) {
  const double verge = street.half_width + street.pavement;
  const Waypoint at = street.centre.at(s);
  const double width = random.uniform(8, 22), clearance = random.uniform(4.3, 5.2);
  builder.place_anyway(bridge_model(2 * verge + 0.6, width, clearance), at);
  for (const int side : {-1, 1}) {
    builder.traffic().fixed.add(
        {street.centre.beside(s, side * (verge + 6.3)).position, at.heading, width / 2, 6});
  }
  return width;
}

/// A roof over the street; returns its length along the street (m).
double add_roof(Builder& builder, Random& random, const Street& street, double s) {
  const double half = street.half_width;
  const Waypoint at = street.centre.at(s);
  const double run = random.uniform(10, 24), height = random.uniform(4.2, 5);
  builder.place_anyway(shelter_model(run, 2 * (half + 1.2), height), at);
  for (double x = -run / 2; x < run / 2; x += 0.8) {
    for (const int side : {-1, 1}) {
      builder.traffic().fixed.add(
          {street.centre.beside(s + x, side * (half + 1.0)).position, at.heading, 0.4, 0.15});
    }
  }
  return run;
}

/// Pairs of trees whose crowns meet over the street, from arc length `s` (m) on; returns their end.
double add_avenue(Builder& builder, Random& random, const Street& street, double s) {
  const int pairs = static_cast<int>(2 + random.index(4));
  for (int i = 0; i < pairs; ++i) {
    for (const int side : {-1, 1}) {
      const Vec2 p =
          street.centre.beside(s + random.uniform(-1, 1), side * (street.half_width + 0.7))
              .position;
      const double radius = random.uniform(3.8, 5.5), high = random.uniform(8, 12);
      builder.tree(p, high, radius, random.uniform(3.6, 4.2));
    }
    s += random.uniform(7, 10);
  }
  return s;
}

/// Bridges, roofs and avenues all along the street.
void cover_street(Builder& builder, Random& random, const Street& street) {
  for (double s = random.uniform(10, 25); s < street.centre.length() - 25;) {
    const double kind = random.unit();
    if (kind < 0.35) {
      const double width = add_bridge(builder, random, street, s);
      s += width + random.uniform(15, 35);
    } else if (kind < 0.6) {
      const double run = add_roof(builder, random, street, s);
      s += run + random.uniform(8, 25);
    } else {
      s = add_avenue(builder, random, street, s);
      s += random.uniform(3, 15);
    }
  }
}

/// Arcades over the pavements.
void add_arcades(Builder& builder, Random& random, const Street& street) {
  const double verge = street.half_width + street.pavement;
  for (double s = random.uniform(5, 40); s < street.centre.length() - 20;
       s += random.uniform(30, 70)) {
    const int side = random.chance(0.5) ? 1 : -1;
    const double run = random.uniform(8, 16), height = random.uniform(2.6, 3.2);
    const Waypoint at = street.centre.beside(s, side * (verge - 0.6));
    builder.place_anyway(shelter_model(run, 2.4, height), at);
    for (double x = -run / 2 + 0.3; x <= run / 2; x += std::max(3.0, run / 4)) {
      for (const double y : {-1.0, 1.0}) {
        builder.traffic().fixed.add(
            {at.position + x * direction(at.heading) + y * left_of(direction(at.heading)),
             at.heading, 0.12, 0.12});
      }
    }
  }
}

}  // namespace

World canopy(const Config& config) {
  const double speed = 6;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.005, 0, 17)), 5.8, 3.4});
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.002, 0.015);
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const std::size_t forward = builder.lane(street, -kLaneHalf),
                    backward = builder.lane(street, kLaneHalf);
  builder.ego(forward, kBefore, speed);
  const double end = kBefore + travel(config, speed) + 40;
  if (builder.lively()) {
    add_parking_moves(builder, kBefore - 20, end, builder.count(5), 6);
    fill_lane(builder, forward, 30, speed, 0.1, 0.05, 0.06);
    fill_lane(builder, backward, 24, 1.2 * speed, 0.1, 0.05, 0.06);
  }
  cover_street(builder, random, street);
  add_arcades(builder, random, street);
  Frontage look;
  look.buildings = 0.7;
  look.street_trees = 0.1;
  look.parked = 0.5;
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  builder.pavement_walkers(street, kBefore - 40, end + 20,
                           builder.count(0.22 * (end - kBefore + 60)));
  builder.crossing_walkers(street, kBefore - 10, end, builder.count(4));
  return builder.finish();
}

}  // namespace dynains::simulation
