// Builds a scene from static and moving objects that keep their distance.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "simulation/world.hpp"

namespace dynains::simulation {

/// How the sides of a street look: shares of plots and places that are in use.
struct Frontage {
  double buildings = 0, gardens = 0;  ///< the latter of the plots without the former
  double setback = 1, height = 12;    ///< m, of buildings, at most and about
  double street_trees = 0, poles = 0, furniture = 0;  ///< along kerbs of pavements
  double parked = 0;
  double angle = 0;  ///< rad, of parked cars to the street; 0: along it
};

/// People who walk along the main street.
struct Strollers {
  double from, to;      ///< m along the street, where they start
  int number;           ///< of groups of one to four
  double inner, outer;  ///< m to either side of its centre line
  double run = 60;      ///< m, at most, there and back
  double drift = 0;     ///< m to the side on the way, at most
};

/// A straight street across the main one.
struct Crossing {
  double main_s;  ///< m along the main street
  std::size_t street;
};

inline constexpr double kLaneHalf = 1.75;  // m, from the centre line of a side street to its lanes

/// From the edge of the carriageway to the middle of a place, m.
inline double depth_of_place(double angle) {
  return angle > 0 ? 2.4 * std::sin(angle) + 0.9 * std::cos(angle) : 1.12;
}

inline bool is_straight(const Street& street, double s) {
  const double bend = street.centre.at(s + 8).heading - street.centre.at(s - 8).heading;
  return std::abs(bend) <= 0.02;
}

/// Random numbers of a builder are a stream of their own, beside that of the scene.
class Builder {
 public:
  Builder(const Config& config, const TerrainConfig& ground, std::vector<Street> streets)
      : config_(config),
        random_(seed_of_day(config, 1000 + static_cast<std::uint64_t>(config.scene))),
        world_{Terrain(ground, std::move(streets), random_.fork(1)), Traffic(random_.fork(2))} {}

  Traffic& traffic() { return world_.traffic; }
  const Street& street(std::size_t i = 0) const { return world_.terrain.streets()[i]; }
  bool lively() const { return config_.scene != Scene::kStatic && config_.traffic > 0; }
  /// As many as the configuration asks for.
  int count(double usual) const {
    return lively() ? static_cast<int>(std::lround(usual * config_.traffic)) : 0;
  }

  World finish() { return std::move(world_); }

  // Static things.

  /// Puts a model on the ground unless its footprint is taken.
  bool place(const Model& model, const Footprint& footprint, double margin = 0.1) {
    if (!world_.traffic.fixed.is_free(footprint, margin)) return false;
    world_.traffic.fixed.add(footprint);
    place_anyway(model, {footprint.centre, footprint.heading});
    return true;
  }

  void place_anyway(const Model& model, const Waypoint& at) {
    const double z = world_.terrain.height(at.position);
    const Rigid T_world_model{rotation_z(at.heading),
                              {static_cast<float>(at.position.x), static_cast<float>(at.position.y),
                               static_cast<float>(z)}};
    for (const Primitive& part : model) {
      world_.statics.push_back({transformed(T_world_model, part), world_.models});
    }
    ++world_.models;
  }

  void tree(Vec2 at, double height, double crown, double clear) {
    Random random = random_.fork(random_.bits());
    place(tree_model(is_open(), height, crown, clear, random), {at, 0, 0.35, 0.35}, 0.2);
  }

  Model hedge(double length, double width, double height, Random& random) const {
    return hedge_model(is_open(), length, width, height, random);
  }
  /// Buildings, gardens, trees, poles and parked cars on one side (+1 left, -1 right).
  void furnish(const Street& street, int side, const Frontage& look) {
    const PlaceBeside at = [&street, side](double s, double lateral, double turn) {
      Waypoint p = street.centre.beside(s, side * lateral);
      p.heading += (side > 0 ? 0 : kPi) + turn;
      return p;
    };
    build_plots(at, street, look);
    if (street.pavement > 1.5) furnish_kerb(at, street, look);
    if (street.half_width > 4.5) park_along(at, street, look);
  }

  /// Trees and bushes beside the main street, numbers per 100 m and side.
  void plant(double from, double to, double trees, double bushes) {
    const double length = street().centre.length();
    for (const bool is_tree : {true, false}) {
      const auto plants = static_cast<int>(length / 50 * (is_tree ? trees : bushes));
      for (int i = 0; i < plants; ++i) {
        const double s = random_.uniform(0, length), u = random_.unit(), size = random_.unit();
        const double lateral = from + (to - from) * u * u;
        const Vec2 p = street().centre.beside(s, random_.chance(0.5) ? lateral : -lateral).position;
        if (world_.terrain.distance_to_street(p) < (is_tree ? 0.5 : 1.8)) continue;
        if (is_tree) {
          tree(p, 4 + 14 * size, 1.2 + 3.0 * size, 1.0 + 3.0 * size);
        } else {
          bush(p, 0.5 + 1.1 * size, 0.5 + 1.6 * size);
        }
      }
    }
  }

  /// A model each `step` (m) along the main street, `lateral` (m) beside its centre line.
  void row(double lateral, double step, const std::function<Model(Random&)>& model) {
    for (double s = step / 2; s < street().centre.length() - step / 2; s += step) {
      const Waypoint at = street().centre.beside(s, lateral);
      world_.traffic.fixed.add({at.position, at.heading, std::min(step / 2, 5.0), 0.1});
      place_anyway(model(random_), at);
    }
  }

  /// Thin things along the kerbs of the main street; `amount` is the ratio to their usual number.
  void clutter(double amount) {
    if (amount <= 0) return;
    const double length = street().centre.length();
    for (const int side : {-1, 1}) {
      for (double s = random_.uniform(1, 8); s < length; s += random_.uniform(2, 9) / amount) {
        add_thing(s, side);
      }
      if (random_.chance(0.35 * amount)) add_wires(side);
    }
    // People who linger.
    const double half = street().half_width, start = world_.traffic.drivers[0].s;
    stroll({start - 20, start + 90, count(10 * amount), half - 0.3, half + 2.0, 3});
  }

  // Vehicles.

  /// Lights; before the lanes of the main street.
  void add_lights(const std::vector<Crossing>& crossings) {
    for (const Crossing& crossing : crossings) {
      const double period = random_.uniform(26, 44), phase = random_.uniform(0, 44);
      const double margin = street(crossing.street).half_width + 3;
      const std::size_t signal = world_.traffic.signals.size();
      world_.traffic.signals.push_back({period, phase});
      if (lively()) main_lines_[0].push_back({crossing.main_s - margin, signal, 0});
      main_lines_[1].push_back({street().centre.length() - crossing.main_s - margin, signal, 0});
    }
  }

  /// A lane of a street: `lateral` to the left of the centre line; negative runs with it.
  std::size_t lane(const Street& street, double lateral, std::vector<StopLine> lines = {}) {
    const double length = street.centre.length();
    const bool with = lateral < 0;
    return world_.traffic.add_lane(street.centre.shifted(with ? 0 : length, with ? length : 0,
                                                         [lateral](double) { return lateral; }),
                                   std::move(lines));
  }

  std::size_t main_lane(double lateral) {
    const std::size_t side = lateral < 0 ? 0 : 1,
                      number = lane(street(), lateral, main_lines_[side]);
    if (std::abs(lateral) > outer_[side].first) outer_[side] = {std::abs(lateral), number};
    return number;
  }

  /// The sensor on a lane. `small`: a robot or a person, who keep less distance than a car.
  void ego(std::size_t lane, double s, double usual_speed, bool small) {
    Traffic& t = world_.traffic;
    const double speed = config_.ego_speed < 0 ? usual_speed : config_.ego_speed;
    Traffic::Driver& driver =
        t.add_driver(t.add_object(Kind::kCar, {4.3, 1.8, 1.55}), lane, s, speed);
    if (small) {
      t.objects.back().size = {0.8, 0.6, 0.9};
      driver.rest_gap = 0.3;
      driver.foresight = 0.2;
    }
    if (config_.halt <= 0) return;
    const double middle = 0.5 * config_.scans / config_.rate;
    driver.schedule = {{middle - 0.5 * config_.halt, 0}, {middle + 0.5 * config_.halt, speed}};
  }

  /// Vehicles all along a lane, as many as the configuration asks for.
  void fill_lane(Traffic::Flow flow) {
    if (!lively()) return;
    flow.spacing /= std::max(config_.traffic, 1e-3);
    world_.traffic.fill(flow);
  }

  /// Traffic on side streets, and a vehicle that turns into the main street at each.
  void cross_traffic(const std::vector<Crossing>& crossings, double speed) {
    for (std::size_t i = 0; i < crossings.size(); ++i) {
      const Street& side = street(crossings[i].street);
      const double line = side.centre.length() / 2 - street().half_width - 3;
      for (const double lateral : {-kLaneHalf, kLaneHalf}) {
        const std::size_t across = lane(side, lateral, {{line, i, 1}});
        fill_lane({across, random_.uniform(30, 60), speed * 0.8, 0.05, 0.05, 0.1});
      }
      turning_car(crossings[i], i, speed);
    }
  }

  /// Vehicles that leave their places beside the main street, or park there, about when the sensor
  /// passes. `angle` as of Frontage.
  void maneuvers(double from, double to, int number, double angle, double speed) {
    const Traffic::Driver ego = world_.traffic.drivers[0];
    for (int i = 0; i < number; ++i) {
      const int side = random_.chance(0.5) ? 1 : -1;
      const double s = random_.uniform(from, to), late = random_.uniform(-6, 6);
      const double start = std::max(1.0, (s - ego.s) / std::max(ego.cruise, 0.5) + late);
      maneuver(s, side, angle, random_.chance(0.65), start, speed);
    }
  }

  /// Vehicles ahead of the sensor and behind it on a lane; the first waits, goes and waits again.
  void queue(std::size_t lane, double cruise) {
    Traffic& t = world_.traffic;
    const bool mine = t.drivers[0].lane == lane;
    const double seconds = config_.scans / config_.rate + 5;
    for (const double way : {-1.0, 1.0}) {
      double s = t.drivers[0].s + (mine ? way * 4.5 : 0) + (way > 0 ? random_.uniform(0, 4) : 0);
      const auto number = static_cast<int>(3 + random_.index(4));
      for (int i = 0; i < number; ++i) {
        const double kind = random_.unit();
        const std::size_t object = t.add_object(kind < 0.75   ? Kind::kCar
                                                : kind < 0.92 ? Kind::kVan
                                                              : Kind::kTruck);
        const double half = t.objects[object].size.length / 2;
        s += way * (half + random_.uniform(1.8, 3.5));
        t.add_driver(object, lane, s, cruise).speed = 0;
        s += way * half;
      }
    }
    Traffic::Driver& head = t.drivers.back();
    head.schedule = {{0, 0}};
    for (double time = random_.uniform(1, 4); time < seconds; time += random_.uniform(3, 6)) {
      head.schedule.push_back({time, random_.uniform(5, 9)});
      time += random_.uniform(4, 9);
      head.schedule.push_back({time, 0});
    }
  }

  bool is_free_of_drivers(const Waypoint& at, double half_length) const {
    return world_.traffic.is_free_of_drivers({at.position, at.heading, half_length, 1.2});
  }

  // People.

  void stroll(const Strollers& strollers) {
    for (int i = 0; i < strollers.number; ++i) {
      const double s = random_.uniform(strollers.from, strollers.to);
      const double run = random_.either_sign(0.3, 1) * strollers.run;
      const double lateral = random_.either_sign(strollers.inner, strollers.outer);
      const double drift = random_.uniform(-1, 1) * strollers.drift;
      const double pace = random_.uniform(0.6, 1.7), mood = random_.unit();
      const double when = random_.uniform(1.5, 11);
      // Abreast where there is room.
      const bool alone = strollers.outer < 1 || !random_.chance(0.35);
      const int company = alone ? 0 : static_cast<int>(1 + random_.index(3));
      for (int k = 0; k <= company; ++k) {
        // Two walk side by side.
        const int row = k / 2;
        const double beside = 0.65 * (k % 2) * (lateral > 0 ? -1 : 1), behind = 0.7 * row;
        std::vector<Vec2> goals;
        bool is_clear = true;
        for (double u = 0; u <= 1; u += 0.25) {
          const double l =
              std::clamp(lateral + drift * u + beside, -strollers.outer, strollers.outer);
          const double along =
              std::clamp(s + run * u - behind, 0.5, street().centre.length() - 0.5);
          goals.push_back(street().centre.beside(along, l).position);
          // People on pavements stay off all streets.
          is_clear = is_clear && (strollers.inner <= street().half_width ||
                                  world_.terrain.distance_to_street(goals.back()) > 0.2);
        }
        if (!is_clear) continue;
        // Some stand all the time, some start, and some stop.
        walker(goals, pace, mood < 0.13 ? 1e9 : mood < 0.27 ? when : 0, mood > 0.9 ? when : 1e9);
      }
    }
  }

  /// People who cross from `reach` (m) on one side to the other.
  void cross(double from, double to, int number, double reach) {
    const Route& main = street().centre;
    for (int i = 0; i < number; ++i) {
      const double s = random_.uniform(from, to), pace = random_.uniform(1.0, 1.8);
      const double side = random_.chance(0.5) ? reach : -reach, there = s + random_.uniform(-2, 2);
      const double onwards = random_.either_sign(15, 30);
      walker({main.beside(s, side).position, main.beside(there, -side).position,
              main.beside(there + onwards, -side).position},
             pace, random_.uniform(0, 10), 1e9);
    }
  }

 private:
  /// Waypoint at arc length s (m), `lateral` (m) beside the street, turned by `turn` (rad).
  using PlaceBeside = std::function<Waypoint(double s, double lateral, double turn)>;

  bool is_open() const { return config_.foliage == Foliage::kOpen; }
  /// Smallest distance (m) of the corners and edges to the streets.
  double clearance(const Footprint& f) const {
    double least = 1e9;
    const Vec2 u = f.half_length * direction(f.heading);
    const Vec2 v = f.half_width * left_of(direction(f.heading));
    for (const double a : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
      for (const double b : {-1.0, 0.0, 1.0}) {
        least = std::min(least, world_.terrain.distance_to_street(f.centre + a * u + b * v));
      }
    }
    return least;
  }

  void bush(Vec2 at, double radius, double height) {
    Random random = random_.fork(random_.bits());
    place(bush_model(is_open(), radius, height, random), {at, 0, 0.8 * radius, 0.8 * radius}, 0.2);
  }

  void build_plots(const PlaceBeside& at, const Street& street, const Frontage& look) {
    const double back = street.half_width + street.pavement, length = street.centre.length();
    for (double s = 2; s < length - 8;) {
      const double front = random_.uniform(8, 20), deep = random_.uniform(8, 14);
      const double gap = random_.chance(0.4) ? 0.05 : random_.uniform(1, 8);
      const double setback = 0.2 + look.setback * random_.unit();
      const double height = look.height * random_.uniform(0.6, 1.4);
      const Waypoint middle = at(s + front / 2, back + setback, 0);
      // The front faces the street: building models extend to their left.
      const Vec2 inwards = left_of(direction(middle.heading));
      const Footprint plot{middle.position + (deep / 2) * inwards, middle.heading, front / 2,
                           deep / 2};
      if (!random_.chance(look.buildings) || clearance(plot) <= street.pavement * 0.8) {
        if (random_.chance(look.gardens)) garden(at, s, front, back);
      } else if (world_.traffic.fixed.is_free(plot, 0)) {
        world_.traffic.fixed.add(plot);
        place_anyway(building_model(front, deep, height, random_), middle);
      }
      s += front + gap;
    }
  }

  /// Hedges, fences, bushes and trees on an open plot.
  void garden(const PlaceBeside& at, double s, double front, double back) {
    const double which = random_.unit(), height = random_.uniform(0.9, 2.0);
    const Waypoint line = at(s + front / 2, back + 0.6, 0);
    const Footprint strip{line.position, line.heading, front / 2, 0.4};
    if (which < 0.8 && clearance(strip) > 1) {
      const Fence fence = which < 0.65 ? Fence::kWire : Fence::kWood;
      place(which < 0.45 ? hedge(front, 0.7, height, random_)
                         : fence_model(fence, front, height, random_),
            strip, 0);
    }
    const auto plants = static_cast<int>(3 + random_.index(7));
    for (int i = 0; i < plants; ++i) {
      const double along = s + random_.uniform(1, front), deep = back + random_.uniform(2, 22);
      const bool is_tree = random_.chance(0.45);
      const double size = random_.unit();
      const Vec2 p = at(along, deep, 0).position;
      if (world_.terrain.distance_to_street(p) < 3) continue;
      if (is_tree) {
        tree(p, 5 + 8 * size, 1.5 + 2.5 * size, 1.2 + 1.5 * size);
      } else {
        bush(p, 0.6 + 0.9 * size, 0.8 + 1.2 * size);
      }
    }
  }

  void furnish_kerb(const PlaceBeside& at, const Street& street, const Frontage& look) {
    const double length = street.centre.length();
    for (double s = random_.uniform(3, 9); s < length - 3; s += random_.uniform(5, 11)) {
      const Waypoint kerb = at(s, street.half_width + 0.55, 0);
      const double height = random_.uniform(6, 12), crown = random_.uniform(1.6, 3.2);
      const double clear = random_.uniform(2.3, 3.6);
      const bool lamp = random_.chance(0.4), sign = !lamp || random_.chance(0.5);
      if (world_.terrain.distance_to_street(kerb.position) < 0) continue;  // another one
      if (random_.chance(look.street_trees)) {
        tree(kerb.position, height, crown, clear);
      } else if (random_.chance(look.poles)) {
        place(pole_model(lamp ? 7 : 2.6, lamp, sign, random_),
              {kerb.position, kerb.heading, 0.1, 0.1}, 0.2);
      } else if (random_.chance(look.furniture)) {
        place(furniture_model(random_), {kerb.position, kerb.heading, 0.8, 0.35});
      }
    }
  }

  void park_along(const PlaceBeside& at, const Street& street, const Frontage& look) {
    const double angle = look.angle, middle = street.half_width - depth_of_place(angle);
    const double pitch = angle > 0 ? random_.uniform(2.3, 2.8) / std::sin(angle) : 6.7;
    const bool nose_in = angle > 0 && random_.chance(0.6);
    for (double s = random_.uniform(2, 8); s < street.centre.length() - 5; s += pitch) {
      const double u = random_.unit();
      const Kind kind = u < 0.85 ? Kind::kCar : Kind::kVan;
      const bool used = random_.chance(look.parked), odd = angle > 0 && random_.chance(0.1);
      const double turn = 0.03 * random_.normal() + angle + (nose_in != odd ? 0 : kPi);
      const double along = s + (angle > 0 ? 0 : random_.uniform(-0.7, 0.7));
      const Waypoint p = at(along, middle + 0.08 * random_.normal(), turn);
      if (!used || is_near_crossing(street, p.position, 7)) continue;
      if (angle == 0 || is_straight(street, s)) park(p, kind);
    }
  }

  void park(const Waypoint& at, Kind kind) {
    Traffic& t = world_.traffic;
    const std::size_t object = t.add_object(kind);
    const Footprint footprint = t.footprint_of(object, at);
    if (!t.fixed.is_free(footprint, 0.25)) return t.objects.pop_back();
    t.fixed.add(footprint);
    t.parked.push_back({object, at, 0, 0});
  }

  /// Whether another street than `street` is nearer to `p` than `margin` (m).
  bool is_near_crossing(const Street& street, Vec2 p, double margin) const {
    for (const Street& other : world_.terrain.streets()) {
      const Vec2 q = other.centre.at(other.centre.nearest(p)).position;
      if (&other != &street && norm(q - p) < other.half_width + margin) return true;
    }
    return false;
  }

  void turning_car(const Crossing& crossing, std::size_t signal, double speed) {
    Traffic& t = world_.traffic;
    const Street &main = street(), &side = street(crossing.street);
    const double from_left = random_.chance(0.5) ? 1 : -1;
    Waypoint before = side.centre.beside(
        side.centre.length() / 2 + from_left * (main.half_width + 3), from_left * kLaneHalf);
    if (from_left > 0) before.heading += kPi;
    const double forward = random_.chance(0.5) ? 1 : -1, s_exit = crossing.main_s + forward * 14.0;
    Waypoint after = main.centre.beside(s_exit, -forward * kLaneHalf);
    if (forward < 0) after.heading += kPi;
    std::vector<Vec2> points;
    const double run = 60;  // m
    for (double d = -run; d < -1; d += 1.5) {
      points.push_back(before.position + d * direction(before.heading));
    }
    add_curve(before, after, points);
    for (double d = 1.5; d < 70; d += 1.5) {
      const double s = s_exit + forward * d;
      if (s < 1 || s > main.centre.length() - 1) break;
      points.push_back(main.centre.beside(s, -forward * kLaneHalf).position);
    }
    const std::size_t turning = t.add_lane(Route(std::move(points)), {{run, signal, 1}});
    const std::size_t object = t.add_object(Kind::kCar);
    const double s = random_.uniform(8, run - 8);
    if (!is_free_of_drivers(t.lanes[turning].route.at(s), 5)) return t.objects.pop_back();
    t.add_driver(object, turning, s, speed * 0.7).yields = true;
  }

  void maneuver(double s, int side, double angle, bool leaving, double start, double speed) {
    Traffic& t = world_.traffic;
    const Lane lane = t.lanes[outer_[side < 0 ? 0 : 1].second];
    Waypoint spot = street().centre.beside(s, side * (street().half_width - depth_of_place(angle)));
    // Vehicles that drive in turn away from the lane, those that drive out turn into it.
    spot.heading += (side < 0 ? 0 : kPi) + (leaving ? angle : -angle);
    const Vec2 ahead = direction(spot.heading);
    const double reach = angle > 0 ? 7.5 : 9;  // m, along the lane
    const double joint = lane.route.nearest(spot.position) + (leaving ? reach : -reach);
    const double begin = std::max(1.0, joint - random_.uniform(15, 50)), end = lane.route.length();
    if (joint < 5 || joint > end - 20 || (angle > 0 && !is_straight(street(), s)) ||
        is_near_crossing(street(), spot.position, 6)) {
      return;
    }
    std::vector<Vec2> points;
    if (leaving) {
      for (const double d : {0.0, 0.7, 1.4}) points.push_back(spot.position + d * ahead);
      add_curve({spot.position + 2.1 * ahead, spot.heading}, lane.route.at(joint), points);
      for (double d = joint + 1; d < end; ++d) points.push_back(lane.route.at(d).position);
    } else {
      for (double d = begin; d < joint - 0.5; ++d) points.push_back(lane.route.at(d).position);
      add_curve(lane.route.at(joint), {spot.position - 2.1 * ahead, spot.heading}, points);
      for (const double d : {1.4, 0.7, 0.0}) points.push_back(spot.position - d * ahead);
    }
    Route route(std::move(points));
    const double room = angle > 0 ? 0 : leaving ? 5 : -4;
    const Footprint needed{spot.position + room * ahead, spot.heading, angle > 0 ? 2.5 : 8.5, 1.1};
    if (!t.fixed.is_free(needed, 0) || !is_free_of_drivers(route.at(0), 6)) return;
    t.fixed.add(needed);
    std::vector<StopLine> lines;
    const double first = leaving ? route.nearest(lane.route.at(joint).position) : 0;
    for (StopLine line : lane.stop_lines) {
      line.s += first - (leaving ? joint : begin);
      if (line.s > first) lines.push_back(line);
    }
    const std::size_t object = t.add_object(random_.chance(0.8) ? Kind::kCar : Kind::kVan);
    Traffic::Driver& driver =
        t.add_driver(object, t.add_lane(std::move(route), std::move(lines)), 0, speed);
    driver.yields = true;
    driver.stays_at_end = !leaving;
    if (!leaving) return;
    driver.speed = 0;
    driver.schedule = {{0, 0}, {start, speed}};
  }

  void walker(const std::vector<Vec2>& goals, double pace, double start, double stop) {
    Traffic& t = world_.traffic;
    // Nobody starts inside something, or at the sensor.
    if (norm(goals[0] - t.place_of(t.drivers[0]).position) < 1) return;
    if (!t.fixed.is_free({goals[0], 0, 0.5, 0.5}, 0)) return;
    const std::size_t object = t.add_object(Kind::kPedestrian);
    const Vec2 towards = goals[1] - goals[0];
    const double speed = start <= 0 ? pace / std::max(norm(towards), 0.1) : 0;
    const double phase = 0.01 * static_cast<double>(t.objects[object].seed % 628);
    t.walkers.push_back({object, goals[0], std::atan2(towards.y, towards.x), goals, pace, start,
                         stop, speed * towards, 1, phase});
  }

  void add_thing(double s, int side) {
    const double beyond = std::max(street().pavement, 1.5) + 1.5;
    const double lateral = side * (street().half_width + random_.uniform(0.15, beyond));
    const double kind = random_.unit(), length = random_.uniform(2, 7);
    Waypoint at = street().centre.beside(s, lateral);
    if (kind < 0.25) {
      at.heading += kPi / 2 * random_.uniform(0, 4);
      put(pole_model(random_.uniform(1.8, 3.2), false, true, random_), at, 0.1, 0.3);
    } else if (kind < 0.5) {
      const auto bicycles = static_cast<int>(1 + random_.index(6));
      const double turn = random_.chance(0.7) ? kPi / 2 : 0, pitch = turn > 0 ? 0.6 : 1.9;
      for (int i = 0; i < bicycles; ++i) {
        put(bicycle_model(),
            {at.position + (pitch * i) * direction(at.heading),
             at.heading + turn + 0.1 * random_.normal()},
            0.85, 0.2);
      }
    } else if (kind < 0.8) {
      const Fence fence = kind < 0.65 ? Fence::kRailing : Fence::kPales;
      put(fence_model(fence, length, random_.uniform(0.6, 1.5), random_), at, length / 2, 0.06);
    } else {
      at.heading += random_.uniform(0, 2 * kPi);
      put(furniture_model(random_), at, 0.8, 0.35);
    }
  }

  void add_wires(int side) {
    const double lateral = side * (street().half_width + 0.4), height = random_.uniform(5.5, 8);
    const double span = random_.uniform(18, 35);
    const auto wires = static_cast<int>(1 + random_.index(3));
    for (double s = random_.uniform(0, 20); s + span < street().centre.length(); s += span) {
      const Vec2 a = street().centre.beside(s, lateral).position;
      const Vec2 along = street().centre.beside(s + span, lateral).position - a;
      const Waypoint middle{a + 0.5 * along, std::atan2(along.y, along.x)};
      put(pole_model(height + 0.3, false, false, random_), {a, middle.heading}, 0.15, 0.15);
      for (int i = 0; i < wires; ++i) {
        place_anyway(wire_model(norm(along), height - 0.4 * i, random_), middle);
      }
    }
  }

  /// Adds an object unless it overlaps a street or the path of the sensor.
  void put(const Model& model, const Waypoint& at, double half_length, double half_width) {
    const Footprint thing{at.position, at.heading, half_length, half_width};
    const Route& way = world_.traffic.lanes[world_.traffic.drivers[0].lane].route;
    const bool in_the_way = distance(thing, way.at(way.nearest(at.position)).position) < 1.2;
    if (!in_the_way && clearance(thing) >= 0.05) place(model, thing, 0.02);
  }

  Config config_;
  Random random_;
  World world_;
  std::vector<StopLine> main_lines_[2];      ///< lights along the main street and against it
  std::pair<double, std::size_t> outer_[2];  ///< lateral and number of its outer lanes
};

}  // namespace dynains::simulation
