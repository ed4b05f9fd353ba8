#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {
namespace {

constexpr double kAisleSpeed = 3;     // m/s
constexpr double kStartInAisle = 40;  // m along the aisle
constexpr double kLaneOffset = 1.35;  // m beside the centre line

/// A parking place: arc length (m) along the aisle, and its side (+1 left, -1 right).
struct Place {
  double s;
  int side;
};

/// Straight aisles joined by U-turns that alternate.
std::vector<Bend> serpentine(double aisle, double least_length) {
  constexpr double kRadius = 8.5;
  std::vector<Bend> bends{{aisle, 0}};
  double length = aisle;
  for (int turn = 1; length < least_length || bends.size() < 7; turn = -turn) {
    bends.push_back({kPi * kRadius, turn / kRadius});
    bends.push_back({aisle, 0});
    length += kPi * kRadius + aisle;
  }
  return bends;
}

bool is_straight(const Street& street, double s, double reach) {
  const double bend = street.centre.at(s + reach).heading - street.centre.at(s - reach).heading;
  return std::abs(bend) <= 0.02;
}

/// Places on both sides of the straight parts; a tree stands on some of them.
std::vector<Place> find_places(Builder& builder, Random& random, const Street& street) {
  std::vector<Place> places;
  for (const int side : {-1, 1}) {
    for (double s = 6; s < street.centre.length() - 6; s += 2.6) {
      if (!is_straight(street, s, 5)) continue;
      if (random.unit() < 0.03) {
        builder.tree(street.centre.beside(s, side * 7.5).position, 6, 2, 2.2);
        continue;
      }
      places.push_back({s, side});
    }
  }
  return places;
}

/// The way of a car from its place to the lane, a quarter turn and then along the lane.
std::vector<Vec2> way_out(const Street& street, const Place& place, const Waypoint& spot,
                          const Waypoint& lane, double s_lane, double lateral) {
  std::vector<Vec2> points;
  points.push_back(spot.position);
  points.push_back(spot.position + 0.7 * direction(spot.heading));
  points.push_back(spot.position + 1.4 * direction(spot.heading));
  for (const Vec2 p :
       turn_points({points.back() + 0.7 * direction(spot.heading), spot.heading}, lane)) {
    points.push_back(p);
  }
  for (double d = 1; d < 60; d += 1) {
    const double s = s_lane + (place.side < 0 ? d : -d);
    if (s < 1 || s > street.centre.length() - 1) break;
    points.push_back(street.centre.beside(s, lateral).position);
  }
  return points;
}

/// The way of a car along the lane, then a quarter turn into its place.
std::vector<Vec2> way_in(const Street& street, const Place& place, const Waypoint& spot,
                         const Waypoint& lane, double s_lane, double lateral) {
  std::vector<Vec2> points;
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
  return points;
}

/// A car that leaves its place `start` seconds after the beginning, or arrives there. False if
/// there is no room for it.
bool add_moving_car(Builder& builder, const Street& street, const Place& place, bool leaving,
                    double start) {
  Traffic& traffic = builder.traffic();
  Waypoint spot = street.centre.beside(place.s, place.side * 6.0);
  spot.heading += place.side > 0 ? -kPi / 2 : kPi / 2;
  const double s_lane = place.s + (leaving ? 7.5 : -7.5) * (place.side < 0 ? 1 : -1);
  const double lateral = place.side < 0 ? -kLaneOffset : kLaneOffset;
  Waypoint lane = street.centre.beside(s_lane, lateral);
  if (place.side > 0) lane.heading += kPi;
  const Footprint room{spot.position, spot.heading, 2.5, 1.2};
  if (!is_straight(street, s_lane, 8) || !traffic.fixed.is_free(room, 0)) return false;

  std::vector<Vec2> points = leaving ? way_out(street, place, spot, lane, s_lane, lateral)
                                     : way_in(street, place, spot, lane, s_lane, lateral);
  if (points.size() < 8) return false;
  Route route(std::move(points));
  if (!builder.is_free_of_drivers(route.at(0), 3.5)) return false;
  const std::size_t object = traffic.add_object(Kind::kCar);
  const std::size_t path = traffic.add_lane(std::move(route));
  Traffic::Driver& driver = traffic.add_driver(object, path, leaving ? 0 : 1, kAisleSpeed);
  if (leaving) {
    driver.speed = 0;
    driver.schedule = {{0, 0}, {start, kAisleSpeed}};
    driver.waits_for_gap = true;
  } else {
    driver.stays_at_end = true;
  }
  traffic.fixed.add({spot.position, spot.heading, 2.3, 0.95});
  return true;
}

/// Cars that leave and arrive within [from, to] (m), and parked cars on most other places.
void fill_places(Builder& builder, Random& random, const Street& street,
                 const std::vector<Place>& places, double occupied, double from, double to) {
  std::vector<char> taken(places.size(), 0);
  for (int i = 0; i < builder.count(9) && !places.empty(); ++i) {
    const std::size_t index = random.index(places.size());
    const Place& place = places[index];
    const bool leaving = random.chance(0.6);
    const double start = random.uniform(1, 10);
    if (place.s < from || place.s > to || taken[index]) continue;
    taken[index] = add_moving_car(builder, street, place, leaving, start) ? 1 : 0;
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double along = places[i].s + 0.1 * random.normal();
    Waypoint spot = street.centre.beside(along, places[i].side * (5.9 + 0.15 * random.normal()));
    spot.heading += random.chance(0.7) ? kPi / 2 : -kPi / 2;
    spot.heading += 0.02 * random.normal();
    const bool used = random.chance(occupied), van = random.chance(0.12);
    if (used && !taken[i]) builder.park(spot, van ? Kind::kVan : Kind::kCar);
  }
}

/// People who come out between parked cars and walk along the aisle.
void add_walkers(Builder& builder, Random& random, const Street& street, double from, double to) {
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
}

/// One element of the border at `p`: a building, a hedge or a fence by `kind` in [0, 1].
void add_border(Builder& builder, Vec2 p, double heading, double kind, Random& model_random) {
  Traffic& traffic = builder.traffic();
  if (kind < 0.4) {
    const Vec2 middle = p + 5.0 * left_of(direction(heading));
    if (traffic.fixed.is_free({middle, heading, 4.1, 5}, -0.1)) {
      traffic.fixed.add({middle, heading, 4.1, 5});
      builder.place_anyway(building_model(8.2, 10, 6 + 4 * kind, model_random), {p, heading});
    }
  } else if (kind < 0.75) {
    builder.place(hedge_model(8, 0.8, 1.6, model_random), {p, heading, 4, 0.4}, -0.1);
  } else {
    builder.place(fence_model(8, 1.6, true), {p, heading, 4, 0.1}, -0.1);
  }
}

/// The four edges of the car park.
void surround(Builder& builder, Random& random, const Street& street) {
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
    const double cross = along_x ? (sign > 0 ? high_y + margin : low_y - margin)
                                 : (sign > 0 ? high_x + margin : low_x - margin);
    const double heading = along_x ? (sign > 0 ? 0 : kPi) : (sign > 0 ? -kPi / 2 : kPi / 2);
    const double kind = random.unit();
    for (double d = begin + 4; d < finish; d += 8.2) {
      const Vec2 p = along_x ? Vec2{d, cross} : Vec2{cross, d};
      Random model_random = random.fork(random.bits());
      add_border(builder, p, heading, kind, model_random);
    }
  }
}

}  // namespace

World car_park(const Config& config) {
  Random random(mix(config.seed, 77));
  const double aisle = random.uniform(60, 90);
  const double drive = travel(config, kAisleSpeed);
  std::vector<Street> streets;
  streets.push_back({route_of_bends(serpentine(aisle, 2 * kStartInAisle + drive + 60)), 3.3, 0});
  TerrainConfig ground;
  ground.kerb = 0;
  ground.roughness = 0.03;
  ground.hill_slope = random.uniform(0.002, 0.03);
  ground.street_label = semantic::kParking;
  ground.open_label = semantic::kParking;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const std::size_t forward = builder.lane(street, -kLaneOffset);
  const std::size_t backward = builder.lane(street, kLaneOffset);
  builder.ego(forward, kStartInAisle, kAisleSpeed);

  const double occupied = random.uniform(0.55, 0.9);
  const double from = kStartInAisle - 30, to = kStartInAisle + drive + 60;
  const std::vector<Place> places = find_places(builder, random, street);
  fill_places(builder, random, street, places, occupied, from, to);
  fill_lane(builder, forward, 45, kAisleSpeed, 0, 0, 0);
  fill_lane(builder, backward, 40, kAisleSpeed, 0, 0, 0);
  add_walkers(builder, random, street, from, to);
  surround(builder, random, street);
  for (double s = 10; s < street.centre.length(); s += random.uniform(18, 30)) {
    Random model_random = random.fork(random.bits());
    builder.place(pole_model(6, true, false, model_random),
                  {street.centre.beside(s, 8.5).position, 0, 0.15, 0.15}, 0.05);
  }
  return builder.finish();
}

}  // namespace dynains::simulation
