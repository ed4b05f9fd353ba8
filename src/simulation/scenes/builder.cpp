#include "simulation/scenes/builder.hpp"

#include "simulation/materials.hpp"

namespace dynains::simulation {

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
  const Vec2 u = direction(f.heading), v = left_of(u);
  for (const double a : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    for (const double b : {-1.0, 0.0, 1.0}) {
      least = std::min(least, world_.terrain.distance_to_street(f.centre + (a * f.half_length) * u +
                                                                (b * f.half_width) * v));
    }
  }
  return least;
}

void Builder::tree(Vec2 at, double height, double radius, double clear) {
  Random random = random_.fork(random_.bits());
  const double heading = random.uniform(0, 2 * kPi);
  const bool open = config_.foliage == Foliage::kOpen;
  place(open ? open_tree_model(height, radius, clear, random)
             : tree_model(height, radius, clear, random),
        {at, heading, 0.35, 0.35}, 0.2);
}

void Builder::bush(Vec2 at, double radius, double height) {
  Random random = random_.fork(random_.bits());
  const double heading = random.uniform(0, 2 * kPi);
  const bool open = config_.foliage == Foliage::kOpen;
  place(open ? open_bush_model(radius, height, random) : bush_model(radius, height, random),
        {at, heading, 0.8 * radius, 0.8 * radius}, 0.2);
}

Model Builder::hedge(double length, double width, double height, Random& random) const {
  return config_.foliage == Foliage::kOpen ? open_hedge_model(length, width, height, random)
                                           : hedge_model(length, width, height, random);
}

void Builder::park(const Waypoint& at, Kind kind) {
  Traffic& t = world_.traffic;
  const std::size_t object = t.add_object(kind);
  const Footprint footprint = t.footprint_of(object, at);
  if (!t.fixed.is_free(footprint, 0.25)) {
    t.objects.pop_back();
    return;
  }
  t.fixed.add(footprint);
  t.parked.push_back({static_cast<std::uint32_t>(object), at, 0, 0});
}

Kind Builder::parked_kind() {
  const double u = random_.unit();
  return u < 0.82 ? Kind::kCar : u < 0.96 ? Kind::kVan : Kind::kTruck;
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
    const double front = random_.uniform(8, 20);
    const double deep = random_.uniform(8, 14);
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
    if (built && clearance(plot) > street.pavement * 0.8) {
      if (world_.traffic.fixed.is_free(plot, 0)) {
        world_.traffic.fixed.add(plot);
        place_anyway(building_model(front, deep, height, model_random), middle);
      }
    } else {
      garden(at, s, front, back, look);
    }
    s += front + gap;
  }
}

void Builder::furnish_kerb(const PlaceBeside& at, const Street& street, const Frontage& look) {
  const double edge = street.half_width, length = street.centre.length();
  for (double s = random_.uniform(3, 9); s < length - 3;) {
    const Waypoint kerb = at(s, edge + 0.55, 0);
    const bool tree_here = random_.chance(look.street_trees);
    const bool pole_here = random_.chance(look.poles);
    const bool furniture_here = random_.chance(look.furniture);
    const double tree_height = random_.uniform(6, 12), radius = random_.uniform(1.6, 3.2);
    const double clear = random_.uniform(2.3, 3.6);
    const bool lamp = random_.chance(0.4), sign = random_.chance(0.5);
    Random model_random = random_.fork(random_.bits());
    const bool near_other_street = world_.terrain.distance_to_street(kerb.position) < 0.55 - 0.6;
    if (street.pavement > 1.5 && !near_other_street) {
      if (tree_here) {
        tree(kerb.position, tree_height, radius, clear);
      } else if (pole_here) {
        place(pole_model(lamp ? 7 : 2.6, lamp, sign || !lamp, model_random),
              {kerb.position, kerb.heading, 0.1, 0.1}, 0.2);
      } else if (furniture_here) {
        place(furniture_model(model_random), {kerb.position, kerb.heading, 0.8, 0.3}, 0.1);
      }
    }
    s += random_.uniform(5, 11);
  }
}

void Builder::park_along(const PlaceBeside& at, const Street& street, const Frontage& look) {
  const double edge = street.half_width, length = street.centre.length();
  for (double s = random_.uniform(2, 8); s < length - 5; s += random_.uniform(6, 7.5)) {
    const Kind kind = parked_kind();
    const double turn = 0.02 * random_.normal();
    const double lateral = edge - 1.12 + 0.08 * random_.normal();
    const bool used = random_.chance(look.parked);
    const Waypoint p = at(s, lateral, turn + kPi);
    if (!used || kind == Kind::kTruck) continue;
    const Footprint f{p.position, p.heading, 3.5, 1.0};
    if (!is_near_crossing(street, p.position, 7) && clearance(f) < 0.6) park(p, kind);
  }
}

bool Builder::is_near_crossing(const Street& street, Vec2 p, double margin) const {
  for (const Street& other : world_.terrain.streets()) {
    const Vec2 q = other.centre.at(other.centre.nearest(p)).position;
    if (&other != &street && norm(q - p) < other.half_width + margin) return true;
  }
  return false;
}

void Builder::garden(const PlaceBeside& at, double s, double front, double back,
                     const Frontage& look) {
  if (!random_.chance(look.gardens)) return;
  const double which = random_.unit();
  const double height = random_.uniform(0.9, 2.0);
  const Waypoint line = at(s + front / 2, back + 0.6, 0);
  Random model_random = random_.fork(random_.bits());
  const Footprint strip{line.position, line.heading, front / 2, 0.4};
  if (clearance(strip) > 1) {
    if (which < 0.45) {
      place(hedge(front, 0.7, height, model_random), strip, 0);
    } else if (which < 0.8) {
      place(fence_model(front, height, which < 0.65), strip, 0);
    }
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

void Builder::plant(const Street& street, double from, double to, double trees_per_100_m,
                    double bushes_per_100_m) {
  const double length = street.centre.length();
  for (const int side : {-1, 1}) {
    const auto trees = static_cast<int>(length / 100 * trees_per_100_m);
    for (int i = 0; i < trees; ++i) {
      const double s = random_.uniform(0, length), u = random_.unit(), size = random_.unit();
      const Vec2 p = street.centre.beside(s, side * (from + (to - from) * u * u)).position;
      const double radius = 1.5 + 3.0 * size;
      if (world_.terrain.distance_to_street(p) < 1.2) continue;
      tree(p, 5 + 11 * size, radius, 1.0 + 2.0 * size);
    }
    const auto bushes = static_cast<int>(length / 100 * bushes_per_100_m);
    for (int i = 0; i < bushes; ++i) {
      const double s = random_.uniform(0, length), u = random_.unit(), size = random_.unit();
      const Vec2 p = street.centre.beside(s, side * (from + (to - from) * u * u)).position;
      if (world_.terrain.distance_to_street(p) < 1.8) continue;
      bush(p, 0.5 + 1.1 * size, 0.5 + 1.6 * size);
    }
  }
}

void Builder::ego(std::size_t lane, double s, double usual_speed) {
  Traffic& t = world_.traffic;
  const double speed = config_.ego_speed < 0 ? usual_speed : config_.ego_speed;
  Traffic::Driver& driver =
      t.add_driver(t.add_object(Kind::kCar, {4.3, 1.8, 1.55}), lane, s, speed);
  if (config_.halt <= 0) return;
  const double middle = 0.5 * config_.scans / config_.rate;
  driver.schedule = {{middle - 0.5 * config_.halt, 0}, {middle + 0.5 * config_.halt, speed}};
}

void Builder::walker(std::vector<Vec2> goals, double pace, double start, double stop) {
  Traffic& t = world_.traffic;
  // Nobody starts inside something.
  for (const Vec2 corner : {Vec2{0.5, 0}, Vec2{-0.5, 0}, Vec2{0, 0.5}, Vec2{0, -0.5}}) {
    if (!t.fixed.is_free({goals[0] + corner, 0, 0.1, 0.1}, 0)) return;
  }
  Traffic::Walker walker;
  walker.object = t.add_object(Kind::kPedestrian);
  walker.position = goals[0];
  const Vec2 towards = goals.size() > 1 ? goals[1] - goals[0] : Vec2{1, 0};
  walker.heading = std::atan2(towards.y, towards.x);
  walker.goals = std::move(goals);
  walker.goal = walker.goals.size() > 1 ? 1 : 0;
  walker.pace = pace;
  walker.start = start;
  walker.stop = stop;
  walker.phase = 0.01 * static_cast<double>(t.objects[walker.object].seed % 628);
  if (start <= 0) walker.velocity = (pace / std::max(norm(towards), 0.1)) * towards;
  t.walkers.push_back(std::move(walker));
}

void Builder::pavement_walkers(const Street& street, double from, double to, int number) {
  for (int i = 0; i < number; ++i) {
    const int side = random_.chance(0.5) ? 1 : -1;
    const double s = random_.uniform(from, to);
    const double run = random_.either_sign(30, 80);
    const double lateral =
        street.half_width + random_.uniform(1.2, std::max(1.3, street.pavement - 0.4));
    const double pace = random_.uniform(0.9, 1.7);
    const double mood = random_.unit(), when = random_.uniform(2, 10);
    std::vector<Vec2> goals;
    for (int k = 0; k <= 4; ++k) {
      goals.push_back(street.centre.beside(s + run * k / 4, side * lateral).position);
    }
    bool crosses_street = false;
    for (const Vec2 p : goals) {
      crosses_street = crosses_street || world_.terrain.distance_to_street(p) < 0.8;
    }
    if (crosses_street) continue;
    if (mood < 0.15) {
      walker(goals, pace, 1e9);  // stands all the time
    } else if (mood < 0.3) {
      walker(goals, pace, when);
    } else if (mood < 0.4) {
      walker(goals, pace, 0, when);
    } else {
      walker(goals, pace);
    }
    // Company.
    if (random_.chance(0.3)) {
      for (Vec2& p : goals) p = p + Vec2{0.45, 0.55};
      walker(goals, pace, mood < 0.3 ? (mood < 0.15 ? 1e9 : when) : 0);
    }
  }
}

void Builder::crossing_walkers(const Street& street, double from, double to, int number) {
  for (int i = 0; i < number; ++i) {
    const double s = random_.uniform(from, to), pace = random_.uniform(1.0, 1.8);
    const int side = random_.chance(0.5) ? 1 : -1;
    const double start = random_.uniform(0, 10), reach = street.half_width + 1.4;
    const double s_other = s + random_.uniform(-2, 2);
    walker({street.centre.beside(s, side * reach).position,
            street.centre.beside(s_other, -side * reach).position,
            street.centre.beside(s_other + side * 25, -side * reach).position},
           pace, start);
  }
}

void Builder::leaving_car(const Street& street, double s, double lateral_place, double lateral_lane,
                          double start, double cruise) {
  Traffic& t = world_.traffic;
  const double end = lateral_lane < 0 ? street.centre.length() : 0;
  const double sign = lateral_lane < 0 ? 1 : -1;
  auto lateral = [=](double at) {
    const double u = std::clamp((sign * (at - s) - 2.5) / 11.0, 0.0, 1.0);
    return lateral_place + (lateral_lane - lateral_place) * u * u * (3 - 2 * u);
  };
  const std::size_t object = t.add_object(random_.chance(0.8) ? Kind::kCar : Kind::kVan);
  const Waypoint p = street.centre.beside(s, lateral_place);
  const Size& size = t.objects[object].size;
  const Footprint room{p.position + (sign * 5.0) * direction(p.heading), p.heading,
                       size.length / 2 + 6, 1.1};
  if (std::abs(end - s) < 40 || !t.fixed.is_free(room, 0)) {
    t.objects.pop_back();
    return;
  }
  t.fixed.add(t.footprint_of(object, p));
  Route route = street.centre.shifted(s - sign * 3, end, lateral);
  const std::size_t path =
      t.add_lane(std::move(route), lines_from(street, s - sign * 3, lateral_lane < 0));
  Traffic::Driver& driver = t.add_driver(object, path, 3, cruise);
  driver.yields = true;
  driver.speed = 0;
  driver.schedule = {{0, 0}, {start, cruise}};
  driver.waits_for_gap = true;
}

void Builder::arriving_car(const Street& street, double from, double s, double lateral_place,
                           double lateral_lane, double cruise) {
  Traffic& t = world_.traffic;
  const double sign = lateral_lane < 0 ? 1 : -1;
  const Waypoint p = street.centre.beside(s, lateral_place);
  const Footprint room{p.position - (sign * 4.0) * direction(p.heading), p.heading, 8.5, 1.1};
  const Waypoint begin = street.centre.beside(from, lateral_lane);
  if (!t.fixed.is_free(room, 0) || !is_free_of_drivers(begin, 8)) return;
  t.fixed.add({p.position, p.heading, 2.6, 1.0});
  auto lateral = [=](double at) {
    const double u = std::clamp((sign * (at - s) + 14) / 11.0, 0.0, 1.0);
    return lateral_lane + (lateral_place - lateral_lane) * u * u * (3 - 2 * u);
  };
  const std::size_t object = t.add_object(Kind::kCar);
  const std::size_t path = t.add_lane(street.centre.shifted(from, s, lateral),
                                      lines_from(street, from, lateral_lane < 0));
  Traffic::Driver& driver = t.add_driver(object, path, 1, cruise);
  driver.yields = true;
  driver.stays_at_end = true;
}

std::vector<StopLine> Builder::lines_from(const Street& street, double begin, bool with) const {
  std::vector<StopLine> result;
  for (StopLine line : main_lines[with ? 0 : 1]) {
    line.s -= with ? begin : street.centre.length() - begin;
    if (line.s > 0) result.push_back(line);
  }
  return result;
}

}  // namespace dynains::simulation
