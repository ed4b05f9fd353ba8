#include "simulation/scenes/builder.hpp"

#include <algorithm>
#include <cmath>

namespace dynains::simulation {
namespace {

std::uint64_t seed_of(const Config& config) {
  const std::uint64_t seed = mix(config.seed, 1000 + static_cast<std::uint64_t>(config.scene));
  return config.day == 0 ? seed : mix(seed, static_cast<std::uint64_t>(config.day));
}

/// From `a` to `b` between `begin` and `begin` + 11 m, as a lane is changed.
double lane_change(double a, double b, double along, double begin) {
  const double u = std::clamp((along - begin) / 11.0, 0.0, 1.0);
  return a + (b - a) * u * u * (3 - 2 * u);
}

}  // namespace

Builder::Builder(const Config& config, const TerrainConfig& ground, std::vector<Street> streets)
    : config_(config),
      random_(seed_of(config)),
      world_{Terrain(ground, std::move(streets), random_.fork(1)), {}, Traffic(random_.fork(2))} {}

World Builder::finish() {
  if (config_.clutter > 0) add_clutter(*this, config_.clutter);
  return std::move(world_);
}

int Builder::count(double usual) const {
  return lively() ? static_cast<int>(std::lround(usual * config_.traffic)) : 0;
}

bool Builder::place(const Model& model, const Footprint& footprint, double margin) {
  if (!world_.traffic.fixed.is_free(footprint, margin)) return false;
  world_.traffic.fixed.add(footprint);
  place_anyway(model, {footprint.centre, footprint.heading});
  return true;
}

void Builder::place_anyway(const Model& model, const Waypoint& at) {
  const double z = world_.terrain.height(at.position);
  world_.statics.add({rotation_z(at.heading),
                      {static_cast<float>(at.position.x), static_cast<float>(at.position.y),
                       static_cast<float>(z)}},
                     model);
}

double Builder::clearance(const Footprint& f) const {
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

void Builder::tree(Vec2 at, double height, double radius, double clear) {
  Random random = random_.fork(random_.bits());
  const double heading = random.uniform(0, 2 * kPi);
  place(tree_model(is_open(), height, radius, clear, random), {at, heading, 0.35, 0.35}, 0.2);
}

void Builder::bush(Vec2 at, double radius, double height) {
  Random random = random_.fork(random_.bits());
  const double heading = random.uniform(0, 2 * kPi);
  place(bush_model(is_open(), radius, height, random), {at, heading, 0.8 * radius, 0.8 * radius},
        0.2);
}

void Builder::furnish(const Street& street, int side, const Frontage& look) {
  const PlaceBeside at = [&street, side](double s, double lateral, double turn) {
    Waypoint p = street.centre.beside(s, side * lateral);
    p.heading += (side > 0 ? 0 : kPi) + turn;
    return p;
  };
  build_plots(at, street, look);
  furnish_kerb(at, street, look);
  if (look.parked > 0 && street.half_width > 4.5) park_along(at, street, look);
}

void Builder::build_plots(const PlaceBeside& at, const Street& street, const Frontage& look) {
  const double back = street.half_width + street.pavement, length = street.centre.length();
  for (double s = 2; s < length - 8;) {
    const double front = random_.uniform(8, 20), deep = random_.uniform(8, 14);
    const double gap = random_.chance(0.4) ? 0.05 : random_.uniform(1, 8);
    const double setback = 0.2 + look.setback * random_.unit();
    const Waypoint middle = at(s + front / 2, back + setback, 0);
    const bool built = random_.chance(look.buildings);
    const double height = look.height * random_.uniform(0.6, 1.4);
    // The front faces the street: building models extend to their left.
    const Vec2 inwards = left_of(direction(middle.heading));
    const Footprint plot{middle.position + (deep / 2) * inwards, middle.heading, front / 2,
                         deep / 2};
    Random model_random = random_.fork(random_.bits());
    if (!built || clearance(plot) <= street.pavement * 0.8) {
      garden(at, s, front, back, look);
    } else if (world_.traffic.fixed.is_free(plot, 0)) {
      world_.traffic.fixed.add(plot);
      place_anyway(building_model(front, deep, height, model_random), middle);
    }
    s += front + gap;
  }
}

void Builder::garden(const PlaceBeside& at, double s, double front, double back,
                     const Frontage& look) {
  if (!random_.chance(look.gardens)) return;
  const double which = random_.unit(), height = random_.uniform(0.9, 2.0);
  const Waypoint line = at(s + front / 2, back + 0.6, 0);
  Random model_random = random_.fork(random_.bits());
  const Footprint strip{line.position, line.heading, front / 2, 0.4};
  if (which < 0.8 && clearance(strip) > 1) {
    place(which < 0.45 ? hedge(front, 0.7, height, model_random)
                       : fence_model(front, height, which < 0.65),
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

void Builder::furnish_kerb(const PlaceBeside& at, const Street& street, const Frontage& look) {
  const double length = street.centre.length();
  for (double s = random_.uniform(3, 9); s < length - 3; s += random_.uniform(5, 11)) {
    const Waypoint kerb = at(s, street.half_width + 0.55, 0);
    const bool tree_here = random_.chance(look.street_trees);
    const bool pole_here = random_.chance(look.poles);
    const bool furniture_here = random_.chance(look.furniture);
    const double tree_height = random_.uniform(6, 12), radius = random_.uniform(1.6, 3.2);
    const double clear = random_.uniform(2.3, 3.6);
    const bool lamp = random_.chance(0.4), sign = random_.chance(0.5);
    Random model_random = random_.fork(random_.bits());
    const bool near_other_street = world_.terrain.distance_to_street(kerb.position) < 0.55 - 0.6;
    if (street.pavement <= 1.5 || near_other_street) continue;
    if (tree_here) {
      tree(kerb.position, tree_height, radius, clear);
    } else if (pole_here) {
      place(pole_model(lamp ? 7 : 2.6, lamp, sign || !lamp, model_random),
            {kerb.position, kerb.heading, 0.1, 0.1}, 0.2);
    } else if (furniture_here) {
      place(furniture_model(model_random), {kerb.position, kerb.heading, 0.8, 0.3}, 0.1);
    }
  }
}

void Builder::park_along(const PlaceBeside& at, const Street& street, const Frontage& look) {
  const double length = street.centre.length();
  for (double s = random_.uniform(2, 8); s < length - 5; s += random_.uniform(6, 7.5)) {
    const Kind kind = parked_kind();
    const double turn = 0.02 * random_.normal();
    const double lateral = street.half_width - 1.12 + 0.08 * random_.normal();
    const bool used = random_.chance(look.parked);
    const Waypoint p = at(s, lateral, turn + kPi);
    if (!used || kind == Kind::kTruck || is_near_crossing(street, p.position, 7)) continue;
    if (clearance({p.position, p.heading, 3.5, 1.0}) < 0.6) park(p, kind);
  }
}

void Builder::plant(const Street& street, double from, double to, double trees_per_100_m,
                    double bushes_per_100_m) {
  const double length = street.centre.length();
  for (const int side : {-1, 1}) {
    for (const bool is_tree : {true, false}) {
      const auto plants =
          static_cast<int>(length / 100 * (is_tree ? trees_per_100_m : bushes_per_100_m));
      for (int i = 0; i < plants; ++i) {
        const double s = random_.uniform(0, length), u = random_.unit(), size = random_.unit();
        const Vec2 p = street.centre.beside(s, side * (from + (to - from) * u * u)).position;
        if (world_.terrain.distance_to_street(p) < (is_tree ? 1.2 : 1.8)) continue;
        if (is_tree) {
          tree(p, 5 + 11 * size, 1.5 + 3.0 * size, 1.0 + 2.0 * size);
        } else {
          bush(p, 0.5 + 1.1 * size, 0.5 + 1.6 * size);
        }
      }
    }
  }
}

void Builder::barrier(double lateral, double piece, const std::function<Model(Random&)>& model) {
  for (double s = piece / 2; s < street().centre.length() - piece / 2; s += piece) {
    Random random = random_.fork(random_.bits());
    const Waypoint at = street().centre.beside(s, lateral);
    world_.traffic.fixed.add({at.position, at.heading, piece / 2, 0.1});
    place_anyway(model(random), at);
  }
}

void Builder::park(const Waypoint& at, Kind kind) {
  Traffic& t = world_.traffic;
  const std::size_t object = t.add_object(kind);
  const Footprint footprint = t.footprint_of(object, at);
  if (!t.fixed.is_free(footprint, 0.25)) return t.objects.pop_back();
  t.fixed.add(footprint);
  t.parked.push_back({static_cast<std::uint32_t>(object), at, 0, 0});
}

Kind Builder::parked_kind() {
  const double u = random_.unit();
  return u < 0.82 ? Kind::kCar : u < 0.96 ? Kind::kVan : Kind::kTruck;
}

bool Builder::is_near_crossing(const Street& street, Vec2 p, double margin) const {
  for (const Street& other : world_.terrain.streets()) {
    const Vec2 q = other.centre.at(other.centre.nearest(p)).position;
    if (&other != &street && norm(q - p) < other.half_width + margin) return true;
  }
  return false;
}

std::size_t Builder::lane(const Street& street, double lateral, std::vector<StopLine> lines) {
  const double length = street.centre.length();
  const bool with = lateral < 0;
  return world_.traffic.add_lane(street.centre.shifted(with ? 0 : length, with ? length : 0,
                                                       [lateral](double) { return lateral; }),
                                 std::move(lines));
}

void Builder::ego(std::size_t lane, double s, double usual_speed, bool robot) {
  Traffic& t = world_.traffic;
  const double speed = config_.ego_speed < 0 ? usual_speed : config_.ego_speed;
  Traffic::Driver& driver =
      t.add_driver(t.add_object(Kind::kCar, {4.3, 1.8, 1.55}), lane, s, speed);
  if (robot) {
    t.objects.back().size = {0.8, 0.6, 0.9};
    driver.rest_gap = 0.3;
    driver.foresight = 0.2;
  }
  if (config_.halt <= 0) return;
  const double middle = 0.5 * config_.scans / config_.rate;
  driver.schedule = {{middle - 0.5 * config_.halt, 0}, {middle + 0.5 * config_.halt, speed}};
}

void Builder::fill_lane(Traffic::Flow flow) {
  if (!lively()) return;
  flow.spacing /= std::max(config_.traffic, 1e-3);
  world_.traffic.fill(flow);
}

StreetLanes Builder::two_way(const std::vector<Crossing>& crossings, double speed) {
  Traffic& traffic = world_.traffic;
  const Street& main = street();
  for (const Crossing& crossing : crossings) {
    const double period = random_.uniform(26, 44), phase = random_.uniform(0, 44);
    traffic.signals.push_back({period, phase});
    const std::size_t signal = traffic.signals.size() - 1;
    const double margin = street(crossing.street).half_width + 3;
    if (lively()) main_lines_[0].push_back({crossing.main_s - margin, signal, 0});
    main_lines_[1].push_back({main.centre.length() - crossing.main_s - margin, signal, 0});
  }
  const StreetLanes lanes{lane(main, -kLaneHalf, main_lines_[0]),
                          lane(main, kLaneHalf, main_lines_[1])};
  ego(lanes.forward, kBefore, speed);
  for (std::size_t i = 0; i < crossings.size() && lively(); ++i) {
    const Street& side = street(crossings[i].street);
    const double middle = side.centre.length() / 2;
    for (const double lateral : {-kLaneHalf, kLaneHalf}) {
      const std::size_t across = lane(side, lateral, {{middle - main.half_width - 3, i, 1}});
      fill_lane({across, random_.uniform(30, 60), speed * 0.8, 0.05, 0.05, 0.1});
    }
    turning_car(crossings[i], i, speed);
  }
  return lanes;
}

void Builder::turning_car(const Crossing& crossing, std::size_t signal, double speed) {
  Traffic& traffic = world_.traffic;
  const Street &main = street(), &side = street(crossing.street);
  const double from_left = random_.chance(0.5) ? 1 : -1;
  Waypoint before = side.centre.beside(side.centre.length() / 2 + from_left * (main.half_width + 3),
                                       from_left * kLaneHalf);
  if (from_left > 0) before.heading += kPi;
  const double forward = random_.chance(0.5) ? 1 : -1, s_exit = crossing.main_s + forward * 14.0;
  Waypoint after = main.centre.beside(s_exit, -forward * kLaneHalf);
  if (forward < 0) after.heading += kPi;
  std::vector<Vec2> points;
  constexpr double kRun = 60;  // m
  for (double d = -kRun; d < -1; d += 1.5) {
    points.push_back(before.position + d * direction(before.heading));
  }
  for (const Vec2 p : turn_points(before, after)) points.push_back(p);
  for (double d = 1.5; d < 70; d += 1.5) {
    const double s = s_exit + forward * d;
    if (s < 1 || s > main.centre.length() - 1) break;
    points.push_back(main.centre.beside(s, -forward * kLaneHalf).position);
  }
  const std::size_t turning = traffic.add_lane(Route(std::move(points)), {{kRun, signal, 1}});
  const std::size_t object = traffic.add_object(Kind::kCar);
  const double s = random_.uniform(8, kRun - 8);
  if (!is_free_of_drivers(traffic.lanes[turning].route.at(s), 5)) return traffic.objects.pop_back();
  traffic.add_driver(object, turning, s, speed * 0.7).yields = true;
}

void Builder::parking_moves(double from, double to, int number, double speed) {
  const Street& main = street();
  for (int i = 0; i < number; ++i) {
    const int side = random_.chance(0.5) ? 1 : -1;
    const double s = random_.uniform(from, to), start = random_.uniform(1, 9);
    const double place = side * (main.half_width - 1.12), lane = side * kLaneHalf;
    if (world_.terrain.distance_to_street(main.centre.beside(s, place).position) < -2) continue;
    if (random_.chance(0.65)) {
      leaving_car(s, place, lane, start, speed);
    } else {
      arriving_car(s + side * random_.uniform(30, 60), s, place, lane, speed);
    }
  }
}

void Builder::leaving_car(double s, double lateral_place, double lateral_lane, double start,
                          double cruise) {
  Traffic& t = world_.traffic;
  const Route& main = street().centre;
  const double sign = lateral_lane < 0 ? 1 : -1, end = sign > 0 ? main.length() : 0;
  const std::size_t object = t.add_object(random_.chance(0.8) ? Kind::kCar : Kind::kVan);
  const Waypoint p = main.beside(s, lateral_place);
  const Footprint room{p.position + (sign * 5.0) * direction(p.heading), p.heading,
                       t.objects[object].size.length / 2 + 6, 1.1};
  if (std::abs(end - s) < 40 || !t.fixed.is_free(room, 0)) return t.objects.pop_back();
  t.fixed.add(t.footprint_of(object, p));
  const double begin = s - sign * 3;
  const std::size_t path = t.add_lane(main.shifted(begin, end,
                                                   [=](double at) {
                                                     return lane_change(lateral_place, lateral_lane,
                                                                        sign * (at - s), 2.5);
                                                   }),
                                      lines_from(begin, sign > 0));
  Traffic::Driver& driver = t.add_driver(object, path, 3, cruise);
  driver.yields = driver.waits_for_gap = true;
  driver.speed = 0;
  driver.schedule = {{0, 0}, {start, cruise}};
}

void Builder::arriving_car(double from, double s, double lateral_place, double lateral_lane,
                           double cruise) {
  Traffic& t = world_.traffic;
  const Route& main = street().centre;
  const double sign = lateral_lane < 0 ? 1 : -1;
  const Waypoint p = main.beside(s, lateral_place);
  const Footprint room{p.position - (sign * 4.0) * direction(p.heading), p.heading, 8.5, 1.1};
  if (!t.fixed.is_free(room, 0) || !is_free_of_drivers(main.beside(from, lateral_lane), 8)) return;
  t.fixed.add({p.position, p.heading, 2.6, 1.0});
  const std::size_t object = t.add_object(Kind::kCar);
  const std::size_t path = t.add_lane(main.shifted(from, s,
                                                   [=](double at) {
                                                     return lane_change(lateral_lane, lateral_place,
                                                                        sign * (at - s), -14);
                                                   }),
                                      lines_from(from, sign > 0));
  Traffic::Driver& driver = t.add_driver(object, path, 1, cruise);
  driver.yields = driver.stays_at_end = true;
}

std::vector<StopLine> Builder::lines_from(double begin, bool with) const {
  std::vector<StopLine> result;
  for (StopLine line : main_lines_[with ? 0 : 1]) {
    line.s -= with ? begin : street().centre.length() - begin;
    if (line.s > 0) result.push_back(line);
  }
  return result;
}

bool Builder::walker(std::vector<Vec2> goals, double pace, const Pause& pause) {
  Traffic& t = world_.traffic;
  // Nobody starts inside something.
  for (const Vec2 corner : {Vec2{0.5, 0}, Vec2{-0.5, 0}, Vec2{0, 0.5}, Vec2{0, -0.5}}) {
    if (!t.fixed.is_free({goals[0] + corner, 0, 0.1, 0.1}, 0)) return false;
  }
  Traffic::Walker walker;
  walker.object = t.add_object(Kind::kPedestrian);
  walker.position = goals[0];
  const Vec2 towards = goals.size() > 1 ? goals[1] - goals[0] : Vec2{1, 0};
  walker.heading = std::atan2(towards.y, towards.x);
  walker.goals = std::move(goals);
  walker.goal = walker.goals.size() > 1 ? 1 : 0;
  walker.pace = pace;
  walker.start = pause.start;
  walker.stop = pause.stop;
  walker.phase = 0.01 * static_cast<double>(t.objects[walker.object].seed % 628);
  if (pause.start <= 0) walker.velocity = (pace / std::max(norm(towards), 0.1)) * towards;
  t.walkers.push_back(std::move(walker));
  return true;
}

std::vector<Vec2> Builder::way_along(double s, double run, int parts, double lateral) const {
  std::vector<Vec2> goals;
  for (int k = 0; k <= parts; ++k) {
    goals.push_back(street().centre.beside(s + run * k / parts, lateral).position);
  }
  return goals;
}

void Builder::pavement_walkers(double from, double to, int number) {
  for (int i = 0; i < number; ++i) {
    const int side = random_.chance(0.5) ? 1 : -1;
    const double s = random_.uniform(from, to), run = random_.either_sign(30, 80);
    const double lateral =
        street().half_width + random_.uniform(1.2, std::max(1.3, street().pavement - 0.4));
    const double pace = random_.uniform(0.9, 1.7);
    const double mood = random_.unit(), when = random_.uniform(2, 10);
    std::vector<Vec2> goals = way_along(s, run, 4, side * lateral);
    const bool crosses_street = std::any_of(goals.begin(), goals.end(), [&](Vec2 p) {
      return world_.terrain.distance_to_street(p) < 0.8;
    });
    if (crosses_street) continue;
    Pause pause{mood < 0.15 ? 1e9 : mood < 0.3 ? when : 0, 1e9};  // some stand all the time
    if (mood >= 0.3 && mood < 0.4) pause.stop = when;
    walker(goals, pace, pause);
    if (!random_.chance(0.3)) continue;
    for (Vec2& p : goals) p = p + Vec2{0.45, 0.55};
    walker(goals, pace, {pause.start, 1e9});  // company
  }
}

void Builder::crossing_walkers(double from, double to, int number) {
  const Route& main = street().centre;
  for (int i = 0; i < number; ++i) {
    const double s = random_.uniform(from, to), pace = random_.uniform(1.0, 1.8);
    const int side = random_.chance(0.5) ? 1 : -1;
    const double start = random_.uniform(0, 10), reach = side * (street().half_width + 1.4);
    const double s_other = s + random_.uniform(-2, 2);
    walker({main.beside(s, reach).position, main.beside(s_other, -reach).position,
            main.beside(s_other + side * 25, -reach).position},
           pace, {start});
  }
}

}  // namespace dynains::simulation
