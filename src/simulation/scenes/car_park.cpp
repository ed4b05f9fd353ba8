#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {
namespace {

struct Aisle {
  double speed = 3;     ///< m/s
  double start = 40;    ///< m along the aisle
  double lane = 1.35;   ///< m beside the centre line
  double radius = 8.5;  ///< m, of the turn to the next one
};
constexpr Aisle kAisle;

/// A parking place: arc length (m) along the aisle, and its side (+1 left, -1 right).
struct Place {
  double s;
  int side;
};

/// Straight aisles joined by U-turns that alternate.
std::vector<Bend> serpentine(double aisle, double least_length) {
  std::vector<Bend> bends{{aisle, 0}};
  double length = aisle;
  for (int turn = 1; length < least_length || bends.size() < 7; turn = -turn) {
    bends.push_back({kPi * kAisle.radius, turn / kAisle.radius});
    bends.push_back({aisle, 0});
    length += kPi * kAisle.radius + aisle;
  }
  return bends;
}

bool is_straight(const Street& street, double s, double reach) {
  const double bend = street.centre.at(s + reach).heading - street.centre.at(s - reach).heading;
  return std::abs(bend) <= 0.02;
}

/// Places on both sides of the straight parts; a tree stands on some of them.
std::vector<Place> find_places(Builder& builder, Random& random, const Street& street,
                               bool roofed) {
  std::vector<Place> places;
  for (const int side : {-1, 1}) {
    for (double s = 6; s < street.centre.length() - 6; s += 2.6) {
      if (!is_straight(street, s, 5)) continue;
      if (random.unit() < 0.03) {
        if (!roofed) builder.tree(street.centre.beside(s, side * 7.5).position, 6, 2, 2.2);
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
  const double lateral = place.side < 0 ? -kAisle.lane : kAisle.lane;
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
  Traffic::Driver& driver = traffic.add_driver(object, path, leaving ? 0 : 1, kAisle.speed);
  if (leaving) {
    driver.speed = 0;
    driver.schedule = {{0, 0}, {start, kAisle.speed}};
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
    builder.place(builder.hedge(8, 0.8, 1.6, model_random), {p, heading, 4, 0.4}, -0.1);
  } else {
    builder.place(fence_model(8, 1.6, true), {p, heading, 4, 0.1}, -0.1);
  }
}

/// Rectangle around all aisles, m.
struct Extent {
  Vec2 low, high;
};

Extent extent_of(const Street& street, double margin) {
  Extent extent{{1e9, 1e9}, {-1e9, -1e9}};
  for (const Vec2 p : street.centre.points()) {
    extent.low = {std::min(extent.low.x, p.x - margin), std::min(extent.low.y, p.y - margin)};
    extent.high = {std::max(extent.high.x, p.x + margin), std::max(extent.high.y, p.y + margin)};
  }
  return extent;
}

/// The four edges of the car park. `step`: length of an element, m. Calls `add(position, heading)`
/// for each element; the car park is to its right.
template <class Add>
void for_each_edge(const Extent& extent, double step, Add&& add) {
  const Vec2 low = extent.low, high = extent.high;
  for (int edge = 0; edge < 4; ++edge) {
    const bool along_x = edge % 2 == 0;
    const double sign = edge < 2 ? 1 : -1;
    const double begin = along_x ? low.x : low.y, finish = along_x ? high.x : high.y;
    const double cross = along_x ? (sign > 0 ? high.y : low.y) : (sign > 0 ? high.x : low.x);
    const double heading = along_x ? (sign > 0 ? 0 : kPi) : (sign > 0 ? -kPi / 2 : kPi / 2);
    for (double d = begin + 4; d < finish; d += step) {
      add(edge, along_x ? Vec2{d, cross} : Vec2{cross, d}, heading);
    }
  }
}

/// Buildings, hedges or fences along each edge.
void surround(Builder& builder, Random& random, const Street& street) {
  const Extent extent = extent_of(street, random.uniform(10, 14));
  int last_edge = -1;
  double kind = 0;
  for_each_edge(extent, 8.2, [&](int edge, Vec2 p, double heading) {
    if (edge != last_edge) kind = random.unit();
    last_edge = edge;
    Random model_random = random.fork(random.bits());
    add_border(builder, p, heading, kind, model_random);
  });
}

/// Ceiling, columns between the places, and parapets or walls along the edges.
void roof_over(Builder& builder, Random& random, const Street& street) {
  constexpr double kClear = 2.9, kPanel = 10;  // m
  const Extent extent = extent_of(street, 12);
  for (double x = extent.low.x; x < extent.high.x; x += kPanel) {
    for (double y = extent.low.y; y < extent.high.y; y += kPanel) {
      builder.place_anyway(slab_model(kPanel, kPanel, kClear, kClear + 0.3),
                           {{x + kPanel / 2, y + kPanel / 2}, 0});
      builder.place_anyway(slab_model(kPanel, 0.4, kClear - 0.4, kClear),
                           {{x + kPanel / 2, y + kPanel / 2}, 0});
    }
  }
  for (double s = 7.3; s < street.centre.length(); s += 7.8) {
    for (const int side : {-1, 1}) {
      const Waypoint at = street.centre.beside(s, side * 8.6);
      builder.place(column_model(0.5, kClear), {at.position, at.heading, 0.25, 0.25}, 0.02);
    }
  }
  const bool walls = random.chance(0.5);
  for_each_edge(extent, 8, [&](int, Vec2 p, double heading) {
    builder.place_anyway(wall_model(8, walls ? kClear : 1.1), {p, heading});
  });
}

World parking_level(const Config& config, Random& random, bool roofed) {
  const double aisle = random.uniform(60, 90);
  const double drive = travel(config, kAisle.speed);
  std::vector<Street> streets{
      {route_of_bends(serpentine(aisle, 2 * kAisle.start + drive + 60)), 3.3, 0}};
  TerrainConfig ground;
  ground.kerb = 0;
  ground.roughness = 0.03;
  ground.hill_slope = random.uniform(0.002, 0.03);
  if (roofed) {
    ground.roughness = 0.005;
    ground.hill_slope = 0.002;
  }
  ground.street_label = semantic::kParking;
  ground.open_label = semantic::kParking;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const std::size_t forward = builder.lane(street, -kAisle.lane);
  const std::size_t backward = builder.lane(street, kAisle.lane);
  builder.ego(forward, kAisle.start, kAisle.speed);

  const double occupied = random.uniform(0.55, 0.9);
  const double from = kAisle.start - 30, to = kAisle.start + drive + 60;
  const std::vector<Place> places = find_places(builder, random, street, roofed);
  fill_places(builder, random, street, places, occupied, from, to);
  fill_lane(builder, {forward, 45, kAisle.speed});
  fill_lane(builder, {backward, 40, kAisle.speed});
  add_walkers(builder, random, street, from, to);
  if (roofed) {
    roof_over(builder, random, street);
    return builder.finish();
  }
  surround(builder, random, street);
  for (double s = 10; s < street.centre.length(); s += random.uniform(18, 30)) {
    Random model_random = random.fork(random.bits());
    builder.place(pole_model(6, true, false, model_random),
                  {street.centre.beside(s, 8.5).position, 0, 0.15, 0.15}, 0.05);
  }
  return builder.finish();
}

}  // namespace

World car_park(const Config& config, Random random) { return parking_level(config, random, false); }
World garage(const Config& config, Random random) { return parking_level(config, random, true); }

}  // namespace dynains::simulation
