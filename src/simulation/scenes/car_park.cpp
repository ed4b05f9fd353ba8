#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "simulation/scenes/builder.hpp"
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
std::vector<Bend> serpentine(double aisle, double min_length) {
  std::vector<Bend> bends{{aisle, 0}};
  double length = aisle;
  for (int turn = 1; length < min_length || bends.size() < 7; turn = -turn) {
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
std::vector<Place> find_places(Builder& builder, Random& random, bool roofed) {
  const Street& street = builder.street();
  std::vector<Place> places;
  for (const int side : {-1, 1}) {
    for (double s = 6; s < street.centre.length() - 6; s += 2.6) {
      if (!is_straight(street, s, 5)) continue;
      if (random.unit() >= 0.03) {
        places.push_back({s, side});
      } else if (!roofed) {
        builder.tree(street.centre.beside(s, side * 7.5).position, 6, 2, 2.2);
      }
    }
  }
  return places;
}

/// The way of a car out of its place with a quarter turn and then along the lane, or along the lane
/// and then into its place.
std::vector<Vec2> way_of(const Street& street, int side, const Waypoint& spot, const Waypoint& lane,
                         double s_lane, double lateral, bool leaving) {
  std::vector<Vec2> points, curve;
  const Vec2 ahead = direction(spot.heading);
  const auto add_lane_points = [&](double from, double to) {
    const double step = from < to ? 1 : -1;
    for (double d = from; step * (to - d) > 0; d += step) {
      const double s = s_lane + (leaving == (side < 0) ? d : -d);
      if (s < 1 || s > street.centre.length() - 1) {
        if (leaving) break;
        continue;
      }
      points.push_back(street.centre.beside(s, lateral).position);
    }
  };
  if (leaving) {
    for (const double d : {0.0, 0.7, 1.4}) points.push_back(spot.position + d * ahead);
    curve = turn_points({points.back() + 0.7 * ahead, spot.heading}, lane);
    points.insert(points.end(), curve.begin(), curve.end());
    add_lane_points(1, 60);
    return points;
  }
  add_lane_points(30, 0.5);
  const double heading = spot.heading + kPi;
  const Vec2 back = direction(heading);
  curve = turn_points(lane, {spot.position - 2.1 * back, heading});
  points.insert(points.end(), curve.begin(), curve.end());
  for (const double d : {1.4, 0.7}) points.push_back(spot.position - d * back);
  points.push_back(spot.position);
  return points;
}

/// A car that leaves its place `start` seconds after the beginning, or arrives there. False if
/// there is no room for it.
bool add_moving_car(Builder& builder, const Place& place, bool leaving, double start) {
  Traffic& traffic = builder.traffic();
  const Street& street = builder.street();
  Waypoint spot = street.centre.beside(place.s, place.side * 6.0);
  spot.heading += place.side > 0 ? -kPi / 2 : kPi / 2;
  const double s_lane = place.s + (leaving ? 7.5 : -7.5) * (place.side < 0 ? 1 : -1);
  const double lateral = place.side * kAisle.lane;
  Waypoint lane = street.centre.beside(s_lane, lateral);
  if (place.side > 0) lane.heading += kPi;
  const Footprint room{spot.position, spot.heading, 2.5, 1.2};
  if (!is_straight(street, s_lane, 8) || !traffic.fixed.is_free(room, 0)) return false;

  std::vector<Vec2> points = way_of(street, place.side, spot, lane, s_lane, lateral, leaving);
  if (points.size() < 8) return false;
  Route route(std::move(points));
  if (!builder.is_free_of_drivers(route.at(0), 3.5)) return false;
  const std::size_t object = traffic.add_object(Kind::kCar);
  const std::size_t path = traffic.add_lane(std::move(route));
  Traffic::Driver& driver = traffic.add_driver(object, path, leaving ? 0 : 1, kAisle.speed);
  if (leaving) {
    driver.speed = 0;
    driver.schedule = {{0, 0}, {start, kAisle.speed}};
  }
  driver.waits_for_gap = leaving;
  driver.stays_at_end = !leaving;
  traffic.fixed.add({spot.position, spot.heading, 2.3, 0.95});
  return true;
}

/// Cars that leave and arrive within [from, to] (m), and parked cars on most other places.
void fill_places(Builder& builder, Random& random, const std::vector<Place>& places,
                 double occupied, double from, double to) {
  std::vector<bool> taken(places.size(), false);
  for (int i = 0; i < builder.count(9) && !places.empty(); ++i) {
    const std::size_t index = random.index(places.size());
    const Place& place = places[index];
    const bool leaving = random.chance(0.6);
    const double start = random.uniform(1, 10);
    if (place.s < from || place.s > to || taken[index]) continue;
    taken[index] = add_moving_car(builder, place, leaving, start);
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double along = places[i].s + 0.1 * random.normal();
    Waypoint spot =
        builder.street().centre.beside(along, places[i].side * (5.9 + 0.15 * random.normal()));
    spot.heading += random.chance(0.7) ? kPi / 2 : -kPi / 2;
    spot.heading += 0.02 * random.normal();
    const bool used = random.chance(occupied), van = random.chance(0.12);
    if (used && !taken[i]) builder.park(spot, van ? Kind::kVan : Kind::kCar);
  }
}

/// People who come out between parked cars and walk along the aisle.
void add_walkers(Builder& builder, Random& random, double from, double to) {
  const Route& aisle = builder.street().centre;
  for (int i = 0; i < builder.count(24); ++i) {
    const double s = random.uniform(from, to), pace = random.uniform(0.9, 1.6);
    const int side = random.chance(0.5) ? 1 : -1;
    const double lateral = side * 2.95, deep = side * random.uniform(4, 8);
    const double run = random.either_sign(15, 40);
    const double start = random.chance(0.3) ? random.uniform(1, 9) : 0;
    builder.walker(
        {aisle.beside(s + 1.3, deep).position, aisle.beside(s + 1.3, lateral).position,
         aisle.beside(s + run / 2, lateral).position, aisle.beside(s + run, lateral).position},
        pace, {start});
  }
}

/// One element of the border at `p`: a building, a hedge or a fence by `kind` in [0, 1].
void add_border(Builder& builder, Vec2 p, double heading, double kind, Random& model_random) {
  Traffic& traffic = builder.traffic();
  if (kind >= 0.4) {
    const bool hedge = kind < 0.75;
    builder.place(hedge ? builder.hedge(8, 0.8, 1.6, model_random) : fence_model(8, 1.6, true),
                  {p, heading, 4, hedge ? 0.4 : 0.1}, -0.1);
    return;
  }
  const Footprint plot{p + 5.0 * left_of(direction(heading)), heading, 4.1, 5};
  if (!traffic.fixed.is_free(plot, -0.1)) return;
  traffic.fixed.add(plot);
  builder.place_anyway(building_model(8.2, 10, 6 + 4 * kind, model_random), {p, heading});
}

/// Rectangle around all aisles, m.
struct Extent {
  Vec2 low{1e9, 1e9}, high{-1e9, -1e9};
};

Extent extent_of(const Street& street, double margin) {
  Extent extent;
  for (const Vec2 p : street.centre.points()) {
    extent.low = {std::min(extent.low.x, p.x - margin), std::min(extent.low.y, p.y - margin)};
    extent.high = {std::max(extent.high.x, p.x + margin), std::max(extent.high.y, p.y + margin)};
  }
  return extent;
}

/// The four edges of the car park. `step`: length of an element, m. Calls `add(edge, position,
/// heading)` for each element; the car park is to its right.
template <class Add>
void for_each_edge(const Extent& extent, double step, Add&& add) {
  const Vec2 low = extent.low, high = extent.high;
  const double borders[] = {high.y, high.x, low.y, low.x};
  constexpr double kHeadings[] = {0, -kPi / 2, kPi, kPi / 2};
  for (int edge = 0; edge < 4; ++edge) {
    const bool along_x = edge % 2 == 0;
    const double begin = along_x ? low.x : low.y, finish = along_x ? high.x : high.y;
    for (double d = begin + 4; d < finish; d += step) {
      add(edge, along_x ? Vec2{d, borders[edge]} : Vec2{borders[edge], d}, kHeadings[edge]);
    }
  }
}

/// Buildings, hedges or fences along each edge, and lamps.
void surround(Builder& builder, Random& random) {
  const Street& street = builder.street();
  int last_edge = -1;
  double kind = 0;
  for_each_edge(extent_of(street, random.uniform(10, 14)), 8.2,
                [&](int edge, Vec2 p, double heading) {
                  if (edge != last_edge) kind = random.unit();
                  last_edge = edge;
                  Random model_random = random.fork(random.bits());
                  add_border(builder, p, heading, kind, model_random);
                });
  for (double s = 10; s < street.centre.length(); s += random.uniform(18, 30)) {
    Random model_random = random.fork(random.bits());
    builder.place(pole_model(6, true, false, model_random),
                  {street.centre.beside(s, 8.5).position, 0, 0.15, 0.15}, 0.05);
  }
}

/// Ceiling, columns between the places, and parapets or walls along the edges.
void roof_over(Builder& builder, Random& random) {
  constexpr double kClear = 2.9, kPanel = 10;  // m
  const Street& street = builder.street();
  const Extent extent = extent_of(street, 12);
  for (double x = extent.low.x; x < extent.high.x; x += kPanel) {
    for (double y = extent.low.y; y < extent.high.y; y += kPanel) {
      const Waypoint middle{{x + kPanel / 2, y + kPanel / 2}, 0};
      builder.place_anyway(slab_model(kPanel, kPanel, kClear, kClear + 0.3), middle);
      builder.place_anyway(slab_model(kPanel, 0.4, kClear - 0.4, kClear), middle);
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
  const double aisle = random.uniform(60, 90), drive = travel(config, kAisle.speed);
  const double slope = random.uniform(0.002, 0.03);
  const TerrainConfig ground{roofed ? 0.002 : slope, 180,
                             roofed ? 0.005 : 0.03,  0,
                             semantic::kParking,     semantic::kParking};
  Builder builder(config, ground,
                  {{route_of_bends(serpentine(aisle, 2 * kAisle.start + drive + 60)), 3.3, 0}});
  const std::size_t forward = builder.lane(builder.street(), -kAisle.lane);
  const std::size_t backward = builder.lane(builder.street(), kAisle.lane);
  builder.ego(forward, kAisle.start, kAisle.speed);

  const double occupied = random.uniform(0.55, 0.9);
  const double from = kAisle.start - 30, to = kAisle.start + drive + 60;
  const std::vector<Place> places = find_places(builder, random, roofed);
  fill_places(builder, random, places, occupied, from, to);
  builder.fill_lane({forward, 45, kAisle.speed});
  builder.fill_lane({backward, 40, kAisle.speed});
  add_walkers(builder, random, from, to);
  roofed ? roof_over(builder, random) : surround(builder, random);
  return builder.finish();
}

}  // namespace

World car_park(const Config& config, Random random) { return parking_level(config, random, false); }
World garage(const Config& config, Random random) { return parking_level(config, random, true); }

}  // namespace dynains::simulation
