#include <algorithm>
#include <cmath>
#include <utility>

#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {

World car_park(const Config& config) {
  const double speed = 3;
  Random random(mix(config.seed, 77));
  const double aisle = random.uniform(60, 90), radius = 8.5;
  const double before = 40, drive = travel(config, speed);
  std::vector<Bend> bends{{aisle, 0}};
  double length = aisle;
  for (int turn = 1; length < 2 * before + drive + 60 || bends.size() < 7; turn = -turn) {
    bends.push_back({kPi * radius, turn / radius});
    bends.push_back({aisle, 0});
    length += kPi * radius + aisle;
  }
  std::vector<Street> streets;
  streets.push_back({route_of_bends(bends), 3.3, 0});
  TerrainConfig ground;
  ground.kerb = 0;
  ground.roughness = 0.03;
  ground.hill_slope = random.uniform(0.002, 0.03);
  ground.street_label = semantic::kParking;
  ground.open_label = semantic::kParking;
  Builder builder(config, ground, std::move(streets));
  Traffic& traffic = builder.traffic();
  const Street& street = builder.street(0);
  const std::size_t forward = builder.lane(street, -1.35), backward = builder.lane(street, 1.35);
  builder.ego(forward, before, speed);
  const double occupied = random.uniform(0.55, 0.9);
  const double from = before - 30, to = before + drive + 60;

  // Places on both sides of the straight parts, nose to the aisle or tail to it.
  struct Place {
    double s;
    int side;
  };
  std::vector<Place> places;
  for (const int side : {-1, 1}) {
    for (double s = 6; s < street.centre.length() - 6; s += 2.6) {
      const double bend = street.centre.at(s + 5).heading - street.centre.at(s - 5).heading;
      if (std::abs(bend) > 0.02) continue;
      const double u = random.unit();
      if (u < 0.03) {
        const Vec2 p = street.centre.beside(s, side * 7.5).position;
        builder.tree(p, 6, 2, 2.2);
        continue;
      }
      places.push_back({s, side});
    }
  }
  std::vector<char> taken(places.size(), 0);
  for (int i = 0; i < builder.count(9) && !places.empty(); ++i) {
    // Leaving and arriving: a quarter turn between place and lane.
    const std::size_t index = random.index(places.size());
    const Place& place = places[index];
    const bool leaving = random.chance(0.6);
    const double start = random.uniform(1, 10);
    if (place.s < from || place.s > to || taken[index]) continue;
    Waypoint spot = street.centre.beside(place.s, place.side * 6.0);
    spot.heading += place.side > 0 ? -kPi / 2 : kPi / 2;
    const Footprint room{spot.position, spot.heading, 2.5, 1.2};
    const double s_lane = place.s + (leaving ? 7.5 : -7.5) * (place.side < 0 ? 1 : -1);
    const double lateral = place.side < 0 ? -1.35 : 1.35;
    Waypoint lane = street.centre.beside(s_lane, lateral);
    if (place.side > 0) lane.heading += kPi;
    const double bend = street.centre.at(s_lane + 8).heading - street.centre.at(s_lane - 8).heading;
    if (std::abs(bend) > 0.02 || !traffic.fixed.is_free(room, 0)) continue;
    std::vector<Vec2> points;
    if (leaving) {
      points.push_back(spot.position);
      points.push_back(spot.position + 0.7 * direction(spot.heading));
      points.push_back(spot.position + 1.4 * direction(spot.heading));
      for (const Vec2 p :
           turn_points({points.back() + 0.7 * direction(spot.heading), spot.heading}, lane))
        points.push_back(p);
      for (double d = 1; d < 60; d += 1) {
        const double s = s_lane + (place.side < 0 ? d : -d);
        if (s < 1 || s > street.centre.length() - 1) break;
        points.push_back(street.centre.beside(s, lateral).position);
      }
    } else {
      for (double d = 30; d > 0.5; d -= 1) {
        const double s = s_lane - (place.side < 0 ? d : -d);
        if (s < 1 || s > street.centre.length() - 1) continue;
        points.push_back(street.centre.beside(s, lateral).position);
      }
      Waypoint mouth = spot;
      mouth.heading += kPi;
      mouth.position = spot.position - 2.1 * direction(mouth.heading);
      for (const Vec2 p : turn_points(lane, mouth)) points.push_back(p);
      points.push_back(spot.position - 1.4 * direction(mouth.heading));
      points.push_back(spot.position - 0.7 * direction(mouth.heading));
      points.push_back(spot.position);
    }
    if (points.size() < 8) continue;
    Route route(std::move(points));
    if (!builder.is_free_of_drivers(route.at(0), 3.5)) continue;
    const std::size_t object = traffic.add_object(Kind::kCar);
    const std::size_t path = traffic.add_lane(std::move(route));
    Traffic::Driver& driver = traffic.add_driver(object, path, leaving ? 0 : 1, speed);
    if (leaving) {
      driver.speed = 0;
      driver.schedule = {{0, 0}, {start, speed}};
      driver.waits_for_gap = true;
    } else {
      driver.stays_at_end = true;
    }
    traffic.fixed.add({spot.position, spot.heading, 2.3, 0.95});
    taken[index] = 1;
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double along = places[i].s + 0.1 * random.normal();
    Waypoint spot = street.centre.beside(along, places[i].side * (5.9 + 0.15 * random.normal()));
    spot.heading += random.chance(0.7) ? kPi / 2 : -kPi / 2;
    spot.heading += 0.02 * random.normal();
    const bool used = random.chance(occupied), van = random.chance(0.12);
    if (used && !taken[i]) builder.park(spot, van ? Kind::kVan : Kind::kCar);
  }
  fill_lane(builder, forward, 45, speed, 0, 0, 0);
  fill_lane(builder, backward, 40, speed, 0, 0, 0);
  for (int i = 0; i < builder.count(24); ++i) {
    const double s = random.uniform(from, to), pace = random.uniform(0.9, 1.6);
    const int side = random.chance(0.5) ? 1 : -1;
    const double lateral = side * 2.95, deep = side * random.uniform(4, 8);
    const double run = random.either_sign(15, 40);
    const double start = random.chance(0.3) ? random.uniform(1, 9) : 0;
    const Vec2 between = street.centre.beside(s + 1.3, deep).position;
    builder.walker({between, street.centre.beside(s + 1.3, lateral).position,
                    street.centre.beside(s + run / 2, lateral).position,
                    street.centre.beside(s + run, lateral).position},
                   pace, start);
  }
  // Around it: a shop, walls, hedges, lamps.
  double low_x = 1e9, high_x = -1e9, low_y = 1e9, high_y = -1e9;
  for (const Vec2 p : street.centre.points()) {
    low_x = std::min(low_x, p.x);
    high_x = std::max(high_x, p.x);
    low_y = std::min(low_y, p.y);
    high_y = std::max(high_y, p.y);
  }
  const double margin = random.uniform(10, 14);
  for (int edge = 0; edge < 4; ++edge) {
    const bool along_x = edge % 2 == 0;
    const double sign = edge < 2 ? 1 : -1;
    const double begin = along_x ? low_x - margin : low_y - margin;
    const double finish = along_x ? high_x + margin : high_y + margin;
    const double what = random.unit();
    for (double d = begin + 4; d < finish; d += 8.2) {
      const double cross = along_x ? (sign > 0 ? high_y + margin : low_y - margin)
                                   : (sign > 0 ? high_x + margin : low_x - margin);
      const Vec2 p = along_x ? Vec2{d, cross} : Vec2{cross, d};
      const double heading = along_x ? (sign > 0 ? 0 : kPi) : (sign > 0 ? -kPi / 2 : kPi / 2);
      Random model_random = random.fork(random.bits());
      if (what < 0.4) {
        const Vec2 middle = p + 5.0 * left_of(direction(heading));
        if (traffic.fixed.is_free({middle, heading, 4.1, 5}, -0.1)) {
          traffic.fixed.add({middle, heading, 4.1, 5});
          builder.place_anyway(building_model(8.2, 10, 6 + 4 * what, model_random), {p, heading});
        }
      } else if (what < 0.75) {
        builder.place(hedge_model(8, 0.8, 1.6, model_random), {p, heading, 4, 0.4}, -0.1);
      } else {
        builder.place(fence_model(8, 1.6, true), {p, heading, 4, 0.1}, -0.1);
      }
    }
  }
  for (double s = 10; s < street.centre.length(); s += random.uniform(18, 30)) {
    Random model_random = random.fork(random.bits());
    builder.place(pole_model(6, true, false, model_random),
                  {street.centre.beside(s, 8.5).position, 0, 0.15, 0.15}, 0.05);
  }
  return builder.finish();
}

}  // namespace dynains::simulation
