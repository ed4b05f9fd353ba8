#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "simulation/materials.hpp"
#include "simulation/world.hpp"

namespace dynains::simulation {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kBefore = 140.0;  // m of street behind the start and beyond the end
constexpr double kLaneHalf = 1.75;

/// Where the main street bends: constant curvature over a length.
struct Bend {
  double length, curvature;
};

Route route_of_bends(const std::vector<Bend>& bends) {
  std::vector<Vec2> points{{0, 0}};
  double heading = 0, curvature = 0;
  for (const Bend& bend : bends) {
    for (double s = 0; s < bend.length; s += 1) {
      // No driver turns the wheel at once.
      curvature += std::clamp(bend.curvature - curvature, -0.006, 0.006);
      heading += curvature;
      points.push_back(points.back() + direction(heading));
    }
  }
  return Route(std::move(points));
}

/// How one side of a street looks.
struct Frontage {
  double buildings = 0.8;   ///< share of plots that are built on
  double setback = 1.0;     ///< m between pavement and facade, at most
  double height = 12;       ///< m, about
  double street_trees = 0.6;
  double poles = 0.6;
  double gardens = 0.85;    ///< hedges, fences, bushes and trees on open plots
  double parked = 0.6;      ///< share of parking places in use
  double furniture = 0.5;
};

class Builder {
 public:
  Builder(const Config& config, const TerrainConfig& ground, std::vector<Street> streets)
      : config_(config),
        random_(mix(config.seed, 1000 + static_cast<std::uint64_t>(config.scene))),
        world_{Terrain(ground, std::move(streets), random_.fork(1)), {},
               Traffic(random_.fork(2))} {}

  Random& random() { return random_; }
  Traffic& traffic() { return world_.traffic; }
  Terrain& terrain() { return world_.terrain; }
  const Street& street(std::size_t i) const { return world_.terrain.streets()[i]; }
  World finish() { return std::move(world_); }
  bool lively() const { return config_.scene != Scene::kStatic && config_.traffic > 0; }
  double traffic_scale() const { return std::max(config_.traffic, 1e-3); }
  int count(double usual) const {
    return lively() ? static_cast<int>(std::lround(usual * config_.traffic)) : 0;
  }

  /// Puts a model on the ground unless its footprint is taken.
  bool place(const Model& model, const Footprint& footprint, double margin = 0.1) {
    if (!world_.traffic.fixed.is_free(footprint, margin)) return false;
    world_.traffic.fixed.add(footprint);
    place_anyway(model, {footprint.centre, footprint.heading});
    return true;
  }

  void place_anyway(const Model& model, const Waypoint& at) {
    const double z = world_.terrain.height(at.position);
    world_.statics.add({rotation_z(at.heading),
                        {static_cast<float>(at.position.x), static_cast<float>(at.position.y),
                         static_cast<float>(z)}},
                       model);
  }

  /// Distance from every corner and the middle of the edges to the streets.
  double clearance(const Footprint& f) const {
    double least = 1e9;
    const Vec2 u = direction(f.heading), v = left_of(u);
    for (const double a : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
      for (const double b : {-1.0, 0.0, 1.0}) {
        least = std::min(least, world_.terrain.distance_to_street(
                                    f.centre + (a * f.half_length) * u + (b * f.half_width) * v));
      }
    }
    return least;
  }

  void tree(Vec2 at, double height, double radius, double clear) {
    Random random = random_.fork(random_.bits());
    const double heading = random.uniform(0, 2 * kPi);
    place(tree_model(height, radius, clear, random), {at, heading, 0.35, 0.35}, 0.2);
  }

  void bush(Vec2 at, double radius, double height) {
    Random random = random_.fork(random_.bits());
    const double heading = random.uniform(0, 2 * kPi);
    place(bush_model(radius, height, random), {at, heading, 0.8 * radius, 0.8 * radius}, 0.2);
  }

  void park(const Waypoint& at, Kind kind) {
    Traffic& t = world_.traffic;
    const std::size_t object = t.add_object(kind);
    const Size& size = t.objects[object].size;
    const Footprint footprint{at.position, at.heading, size.length / 2, size.width / 2};
    if (!t.fixed.is_free(footprint, 0.25)) {
      t.objects.pop_back();
      return;
    }
    t.fixed.add(footprint);
    t.parked.push_back({static_cast<std::uint32_t>(object), at, 0, 0});
  }

  Kind parked_kind() {
    const double u = random_.unit();
    return u < 0.82 ? Kind::kCar : u < 0.96 ? Kind::kVan : Kind::kTruck;
  }

  /// Buildings, gardens, trees, poles and parked cars on one side (+1 left, -1 right).
  void furnish(const Street& street, int side, const Frontage& look) {
    const double edge = street.half_width, back = edge + street.pavement;
    const double length = street.centre.length();
    auto at = [&](double s, double lateral, double turn = 0) {
      Waypoint p = street.centre.beside(s, side * lateral);
      p.heading += (side > 0 ? 0 : kPi) + turn;
      return p;
    };
    auto near_other_street = [&](Vec2 p, double lateral) {
      return world_.terrain.distance_to_street(p) < lateral - edge - 0.6;
    };

    // Plots.
    for (double s = 2; s < length - 8;) {
      const double front = random_.uniform(8, 20);
      const double deep = random_.uniform(8, 14);
      const double gap = random_.chance(0.5) ? 0.05 : random_.uniform(1, 5);
      const double setback = 0.2 + look.setback * random_.unit();
      const Waypoint middle = at(s + front / 2, back + setback);
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

    // The strip along the kerb.
    for (double s = random_.uniform(3, 9); s < length - 3;) {
      const Waypoint kerb = at(s, edge + 0.55);
      const bool tree_here = random_.chance(look.street_trees);
      const bool pole_here = random_.chance(look.poles);
      const bool furniture_here = random_.chance(look.furniture);
      const double tree_height = random_.uniform(6, 12), radius = random_.uniform(1.6, 3.2);
      const double clear = random_.uniform(2.3, 3.6);
      const bool lamp = random_.chance(0.4), sign = random_.chance(0.5);
      Random model_random = random_.fork(random_.bits());
      if (street.pavement > 1.5 && !near_other_street(kerb.position, edge + 0.55)) {
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

    // Parked vehicles.
    if (look.parked > 0 && edge > 4.5) {
      for (double s = random_.uniform(2, 8); s < length - 5; s += random_.uniform(6, 7.5)) {
        const Kind kind = parked_kind();
        const double turn = 0.02 * random_.normal();
        const double lateral = edge - 1.12 + 0.08 * random_.normal();
        const bool used = random_.chance(look.parked);
        const Waypoint p = at(s, lateral, turn + kPi);
        if (!used || kind == Kind::kTruck) continue;
        const Footprint f{p.position, p.heading, 3.5, 1.0};
        bool crossing = false;
        for (const Street& other : world_.terrain.streets()) {
          if (&other == &street) continue;
          const Waypoint q = other.centre.at(other.centre.nearest(p.position));
          crossing = crossing || norm(q.position - p.position) < other.half_width + 7;
        }
        if (!crossing && clearance(f) < 0.6) park(p, kind);
      }
    }
  }

  /// Hedges, fences, bushes and trees on an open plot.
  void garden(const std::function<Waypoint(double, double, double)>& at, double s, double front,
              double back, const Frontage& look) {
    if (!random_.chance(look.gardens)) return;
    const double which = random_.unit();
    const double height = random_.uniform(0.9, 2.0);
    const Waypoint line = at(s + front / 2, back + 0.6, 0);
    Random model_random = random_.fork(random_.bits());
    const Footprint strip{line.position, line.heading, front / 2, 0.4};
    if (clearance(strip) > 1) {
      if (which < 0.45) {
        place(hedge_model(front, 0.7, height, model_random), strip, 0);
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

  /// Woods and meadows beside a street.
  void plant(const Street& street, double from, double to, double trees_per_100_m,
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

  /// A lane of a street: `lateral` to the left of the centre line; negative runs with it.
  std::size_t lane(const Street& street, double lateral, std::vector<StopLine> lines = {}) {
    const double length = street.centre.length();
    const bool with = lateral < 0;
    return world_.traffic.add_lane(
        street.centre.shifted(with ? 0 : length, with ? length : 0,
                              [lateral](double) { return lateral; }),
        std::move(lines));
  }

  /// The ego vehicle on a lane, `kBefore` metres from its start.
  void ego(std::size_t lane, double s, double usual_speed) {
    Traffic& t = world_.traffic;
    const double speed = config_.ego_speed < 0 ? usual_speed : config_.ego_speed;
    t.add_driver(t.add_object(Kind::kCar, {4.3, 1.8, 1.55}), lane, s, speed);
  }

  /// Somebody who walks along `goals`, from `goals[0]`.
  void walker(std::vector<Vec2> goals, double pace, double start = 0, double stop = 1e9,
              Kind kind = Kind::kPedestrian) {
    Traffic& t = world_.traffic;
    // Nobody starts inside something.
    for (const Vec2 corner : {Vec2{0.5, 0}, Vec2{-0.5, 0}, Vec2{0, 0.5}, Vec2{0, -0.5}}) {
      if (!t.fixed.is_free({goals[0] + corner, 0, 0.1, 0.1}, 0)) return;
    }
    Traffic::Walker walker;
    walker.object = t.add_object(kind);
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

  /// People on the pavements of a street between arc lengths.
  void pavement_walkers(const Street& street, double from, double to, int number) {
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

  /// People who cross the carriageway somewhere.
  void crossing_walkers(const Street& street, double from, double to, int number) {
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

  /// A parked vehicle that pulls out into the lane at `start` seconds.
  void leaving_car(const Street& street, double s, double lateral_place, double lateral_lane,
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
    t.fixed.add({p.position, p.heading, size.length / 2, size.width / 2});
    Route route = street.centre.shifted(s - sign * 3, end, lateral);
    const std::size_t path =
        t.add_lane(std::move(route), lines_from(street, s - sign * 3, lateral_lane < 0));
    Traffic::Driver& driver = t.add_driver(object, path, 3, cruise);
    driver.yields = true;
    driver.speed = 0;
    driver.schedule = {{0, 0}, {start, cruise}};
    driver.waits_for_gap = true;
  }

  /// A moving vehicle that leaves its lane and parks at arc length `s`.
  void arriving_car(const Street& street, double from, double s, double lateral_place,
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

  /// Lights of the main street along it and against it, from the start of those lanes.
  std::vector<StopLine> main_lines[2];

  /// The same for a route that begins at arc length `begin` of the main street.
  std::vector<StopLine> lines_from(const Street& street, double begin, bool with) const {
    std::vector<StopLine> result;
    for (StopLine line : main_lines[with ? 0 : 1]) {
      line.s -= with ? begin : street.centre.length() - begin;
      if (line.s > 0) result.push_back(line);
    }
    return result;
  }

  bool is_free_of_drivers(const Waypoint& at, double half_length) const {
    const Traffic& t = world_.traffic;
    for (const Traffic::Driver& driver : t.drivers) {
      const Waypoint other = t.lanes[driver.lane].route.at(driver.s);
      const Size& size = t.objects[driver.object].size;
      if (overlap({at.position, at.heading, half_length, 1.2},
                  {other.position, other.heading, size.length / 2, size.width / 2})) {
        return false;
      }
    }
    return true;
  }

 private:
  Config config_;
  Random random_;
  World world_;
};

double travel(const Config& config, double usual_speed) {
  const double speed = config.ego_speed < 0 ? usual_speed : config.ego_speed;
  return speed * config.scans / config.rate;
}

/// Gentle bends and now and then a corner, alternating so that the street never meets itself.
std::vector<Bend> winding(Random& random, double length, double gentle, double corner_chance,
                          double corner_radius) {
  std::vector<Bend> bends{{60, 0}};
  double done = 60;
  int turn = random.chance(0.5) ? 1 : -1;
  while (done < length) {
    const double straight = random.uniform(50, 110);
    const bool corner = random.chance(corner_chance);
    const double radius = corner_radius * random.uniform(0.9, 1.3);
    const double angle = corner ? kPi / 2 * random.uniform(0.85, 1.05) : 0;
    const double curvature = corner ? turn / radius : turn * gentle * random.uniform(0.2, 1.0);
    const double arc = corner ? angle * radius : random.uniform(30, 80);
    bends.push_back({straight, 0});
    bends.push_back({arc, curvature});
    done += straight + arc;
    turn = -turn;
  }
  bends.push_back({60, 0});
  return bends;
}

/// Straight streets across the main one, where that is straight.
struct Crossing {
  double main_s;
  std::size_t street;
};

std::vector<Crossing> add_side_streets(Random& random, std::vector<Street>& streets,
                                       double spacing, double half_width) {
  std::vector<Crossing> crossings;
  const Route main = streets[0].centre;
  double s = random.uniform(25, 25 + spacing);
  while (s < main.length() - 30) {
    const double before = main.at(s - 22).heading, after = main.at(s + 22).heading;
    if (std::abs(after - before) > 0.06) {
      s += 7;
      continue;
    }
    const Waypoint middle = main.at(s);
    const double heading = middle.heading + kPi / 2 + random.uniform(-0.2, 0.2);
    std::vector<Vec2> points;
    for (double d = -110; d <= 110; d += 2) {
      points.push_back(middle.position + d * direction(heading));
    }
    // Not where it would meet the main street a second time, or another side street.
    bool meets = false;
    for (const Vec2 p : points) {
      if (norm(p - middle.position) < 25) continue;
      for (std::size_t i = 0; i < streets.size(); ++i) {
        const Waypoint near = streets[i].centre.at(streets[i].centre.nearest(p));
        meets = meets || norm(near.position - p) < 16;
      }
    }
    if (meets) {
      s += 15;
      continue;
    }
    crossings.push_back({s, streets.size()});
    streets.push_back({Route(std::move(points)), half_width, 2.5});
    s += spacing * random.uniform(0.7, 1.4);
  }
  return crossings;
}

/// Two-way traffic with lights at the crossings, and vehicles that turn there.
struct StreetLanes {
  std::size_t forward, backward;
};

StreetLanes add_crossing_traffic(Builder& builder, const std::vector<Crossing>& crossings,
                                 double speed, double ego_s) {
  Traffic& traffic = builder.traffic();
  Random& random = builder.random();
  const Street& main = builder.street(0);
  const double main_length = main.centre.length();
  std::vector<StopLine> forward, backward;
  for (const Crossing& crossing : crossings) {
    const double period = random.uniform(26, 44), phase = random.uniform(0, 44);
    traffic.signals.push_back({period, phase});
    const std::size_t signal = traffic.signals.size() - 1;
    const double margin = builder.street(crossing.street).half_width + 3;
    forward.push_back({crossing.main_s - margin, signal, 0});
    backward.push_back({main_length - crossing.main_s - margin, signal, 0});
  }
  if (!builder.lively()) forward.clear();
  const StreetLanes lanes{builder.lane(main, -kLaneHalf, forward),
                          builder.lane(main, kLaneHalf, backward)};
  builder.ego(lanes.forward, ego_s, speed);
  builder.main_lines[0] = forward;
  builder.main_lines[1] = backward;
  for (std::size_t i = 0; i < crossings.size() && builder.lively(); ++i) {
    const Street& side = builder.street(crossings[i].street);
    const double middle = side.centre.length() / 2;
    const std::vector<StopLine> lines{{middle - main.half_width - 3, i, 1}};
    for (const double lateral : {-kLaneHalf, kLaneHalf}) {
      const std::size_t lane = builder.lane(side, lateral, lines);
      Traffic::Flow flow;
      flow.lane = lane;
      flow.spacing = random.uniform(30, 60) / builder.traffic_scale();
      flow.speed = speed * 0.8;
      flow.cyclists = 0.1;
      flow.trucks = 0.05;
      traffic.fill(flow);
    }
    // One stream turns from the side street into the main street.
    const bool from_left = random.chance(0.5);
    const Waypoint stop = side.centre.beside(middle + (from_left ? main.half_width + 3 : -main.half_width - 3),
                                             from_left ? kLaneHalf : -kLaneHalf);
    Waypoint before = stop;
    if (from_left) before.heading += kPi;
    const double s_exit = crossings[i].main_s + (random.chance(0.5) ? 14.0 : -14.0);
    const bool exit_forward = s_exit > crossings[i].main_s;
    Waypoint after = main.centre.beside(s_exit, exit_forward ? -kLaneHalf : kLaneHalf);
    if (!exit_forward) after.heading += kPi;
    std::vector<Vec2> points;
    const double run = 60;
    for (double d = -run; d < -1; d += 1.5) {
      points.push_back(before.position + d * direction(before.heading));
    }
    for (const Vec2 p : turn_points(before, after)) points.push_back(p);
    for (double d = 1.5; d < 70; d += 1.5) {
      const double s = s_exit + (exit_forward ? d : -d);
      if (s < 1 || s > main_length - 1) break;
      points.push_back(main.centre.beside(s, exit_forward ? -kLaneHalf : kLaneHalf).position);
    }
    const std::size_t turning =
        traffic.add_lane(Route(std::move(points)), {StopLine{run, i, 1}});
    const std::size_t object = traffic.add_object(Kind::kCar);
    const double s = random.uniform(8, run - 8);
    if (builder.is_free_of_drivers(traffic.lanes[turning].route.at(s), 5)) {
      traffic.add_driver(object, turning, s, speed * 0.7).yields = true;
    } else {
      traffic.objects.pop_back();
    }
  }
  return lanes;
}

void fill_lane(Builder& builder, std::size_t lane, double spacing, double speed, double trucks,
               double buses, double cyclists) {
  if (!builder.lively()) return;
  Traffic::Flow flow;
  flow.lane = lane;
  flow.spacing = spacing / builder.traffic_scale();
  flow.speed = speed;
  flow.trucks = trucks;
  flow.buses = buses;
  flow.cyclists = cyclists;
  builder.traffic().fill(flow);
}

/// Cars that leave their places and cars that park, along the stretch that is driven.
void add_parking_moves(Builder& builder, double from, double to, int number, double speed) {
  Random& random = builder.random();
  const Street& main = builder.street(0);
  for (int i = 0; i < number; ++i) {
    const int side = random.chance(0.5) ? 1 : -1;
    const double s = random.uniform(from, to), start = random.uniform(1, 9);
    const double place = side * (main.half_width - 1.12);
    if (builder.terrain().distance_to_street(main.centre.beside(s, place).position) < -2) continue;
    if (random.chance(0.65)) {
      builder.leaving_car(main, s, place, side * kLaneHalf, start, speed);
    } else {
      const double run = random.uniform(30, 60);
      builder.arriving_car(main, side < 0 ? s - run : s + run, s, place, side * kLaneHalf, speed);
    }
  }
}

World urban(const Config& config) {
  const double speed = 8.5;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets;
  const double half_width = random.chance(0.7) ? 5.8 : 3.9;
  streets.push_back({route_of_bends(winding(random, length, 0.006, 0.35, 17)), half_width,
                     random.uniform(2.4, 4.0)});
  const auto crossings = add_side_streets(random, streets, 85, 4.0);
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.005, 0.03);
  Builder builder(config, ground, std::move(streets));

  const StreetLanes lanes = add_crossing_traffic(builder, crossings, speed, kBefore);
  const double end = kBefore + travel(config, speed) + 40;
  if (builder.lively()) {
    if (half_width > 5) add_parking_moves(builder, kBefore - 20, end, builder.count(8), 7);
    fill_lane(builder, lanes.forward, 38, speed, 0.08, 0.05, 0.06);
    fill_lane(builder, lanes.backward, 30, speed, 0.08, 0.05, 0.06);
  }
  Frontage look;
  look.buildings = random.uniform(0.55, 0.95);
  look.street_trees = random.uniform(0.2, 0.7);
  look.parked = random.uniform(0.35, 0.85);
  look.height = random.uniform(7, 16);
  look.setback = random.uniform(0.2, 5);
  for (std::size_t i = 0; i < builder.terrain().streets().size(); ++i) {
    Frontage side = look;
    side.buildings = i == 0 ? look.buildings : 0.8 * look.buildings;
    builder.furnish(builder.street(i), 1, side);
    builder.furnish(builder.street(i), -1, side);
  }
  const double walk_from = kBefore - 50, walk_to = end + 30;
  builder.pavement_walkers(builder.street(0), walk_from, walk_to,
                           builder.count(0.16 * (walk_to - walk_from)));
  builder.crossing_walkers(builder.street(0), walk_from, walk_to, builder.count(5));
  return builder.finish();
}

/// Rails, walls or hedges along a street at a fixed distance from its centre line.
void add_barrier(Builder& builder, const Street& street, double lateral, double piece,
                 const std::function<Model(Random&)>& model) {
  for (double s = piece / 2; s < street.centre.length() - piece / 2; s += piece) {
    Random random = builder.random().fork(builder.random().bits());
    const Waypoint at = street.centre.beside(s, lateral);
    builder.traffic().fixed.add({at.position, at.heading, piece / 2, 0.1});
    builder.place_anyway(model(random), at);
  }
}

World highway(const Config& config) {
  const double speed = 25;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  const double median = random.uniform(0.9, 2.5), lane_width = 3.7;
  const double inner = median + 0.5 + lane_width / 2, outer = inner + lane_width;
  const double edge = outer + lane_width / 2 + 2.6;
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.0022, 0, 17)), edge, 0});
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.005, 0.025);
  ground.hill_length = 400;
  ground.kerb = 0;
  ground.roughness = 0.1;
  Builder builder(config, ground, std::move(streets));
  Traffic& traffic = builder.traffic();
  const Street& street = builder.street(0);

  const std::size_t right = builder.lane(street, -outer), left = builder.lane(street, -inner);
  const std::size_t far_left = builder.lane(street, inner), far_right = builder.lane(street, outer);
  const bool ego_right = random.chance(0.65);
  builder.ego(ego_right ? right : left, kBefore, speed);
  if (builder.lively()) {
    const double cruise = traffic.drivers[0].cruise;
    const auto lead_kind = random.chance(0.3) ? Kind::kTruck : Kind::kCar;
    const std::size_t lead = traffic.add_object(lead_kind);
    traffic.add_driver(lead, ego_right ? right : left, kBefore + random.uniform(32, 48), cruise);
    fill_lane(builder, right, 70, 0.93 * speed, 0.35, 0.05, 0);
    fill_lane(builder, left, 65, 1.2 * speed, 0.02, 0.02, 0);
    fill_lane(builder, far_left, 65, 1.2 * speed, 0.02, 0.02, 0);
    fill_lane(builder, far_right, 60, 0.93 * speed, 0.35, 0.05, 0);
  }
  auto rail = [](Random&) { return guard_rail_model(8); };
  add_barrier(builder, street, 0, 8, rail);
  add_barrier(builder, street, edge + 0.4, 8, rail);
  add_barrier(builder, street, -edge - 0.4, 8, rail);
  for (const int side : {-1, 1}) {
    if (random.chance(0.3)) {
      const double wall_height = random.uniform(2.5, 4);
      add_barrier(builder, street, side * (edge + 3.5), 5, [wall_height](Random&) {
        return fence_model(5, wall_height, false);
      });
    }
  }
  // Gantries, poles and bridges.
  for (double s = random.uniform(60, 160); s < street.centre.length() - 20;
       s += random.uniform(150, 320)) {
    if (random.chance(0.4)) {
      builder.place_anyway(bridge_model(2 * edge + 4, 10, 5.5), street.centre.at(s));
    } else {
      Model gantry{make_primitive(Shape::kBox, materials::kSteelPole, {0, 0, 6.2F},
                                  {0.15F, static_cast<float>(edge + 1), 0.15F}),
                   make_primitive(Shape::kBox, materials::kSignPlate, {0.2F, -6, 6.6F},
                                  {0.05F, 2.5F, 1.2F})};
      for (const float side : {-1.0F, 1.0F}) {
        gantry.push_back(make_primitive(Shape::kCylinder, materials::kSteelPole,
                                        {0, side * static_cast<float>(edge + 1), 3},
                                        {0.15F, 0.15F, 3.3F}));
      }
      builder.place_anyway(gantry, street.centre.at(s));
    }
  }
  const double trees = random.uniform(4, 14), bushes = random.uniform(6, 25);
  builder.plant(street, edge + 4.5, edge + 45, trees, bushes);
  for (double s = random.uniform(5, 20); s < street.centre.length(); s += 50) {
    Random model_random = random.fork(random.bits());
    for (const int side : {-1, 1}) {
      const Waypoint at = street.centre.beside(s, side * (edge + 1.2));
      builder.place_anyway(pole_model(1.1, false, false, model_random), at);
    }
  }
  return builder.finish();
}

World vegetation(const Config& config) {
  const double speed = 6;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.015, 0, 17)), 3.4, 0});
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.01, 0.05);
  ground.hill_length = 90;
  ground.roughness = 0.16;
  ground.kerb = 0;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const std::size_t forward = builder.lane(street, -1.6), backward = builder.lane(street, 1.6);
  builder.ego(forward, kBefore, speed);
  fill_lane(builder, forward, 75, speed, 0.05, 0, 0.15);
  fill_lane(builder, backward, 60, 1.3 * speed, 0.05, 0, 0.2);
  const double trees = random.uniform(40, 80), bushes = random.uniform(50, 100);
  builder.plant(street, 4.4, 45, trees, bushes);
  for (const int side : {-1, 1}) {
    if (!random.chance(0.4)) continue;
    add_barrier(builder, street, side * 4.6, 6, [](Random& r) {
      return r.chance(0.6) ? hedge_model(6, 1.0, r.uniform(0.8, 2.2), r) : fence_model(6, 1.1, true);
    });
  }
  for (int i = 0; i < builder.count(8); ++i) {
    const double s = kBefore + random.uniform(-30, 90), pace = random.uniform(1, 1.8);
    const double lateral = random.either_sign(2.7, 3.2);
    const double run = random.chance(0.5) ? 40 : -40;
    const double start = random.chance(0.2) ? random.uniform(2, 8) : 0;
    builder.walker({street.centre.beside(s, lateral).position,
                    street.centre.beside(s + run / 2, lateral).position,
                    street.centre.beside(s + run, lateral).position},
                   pace, start);
  }
  return builder.finish();
}

World crowd(const Config& config) {
  const double speed = 1.2;
  Random random(mix(config.seed, 77));
  const double before = 80, length = 2 * before + travel(config, speed) + 20;
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
  builder.ego(lane, before, speed);
  // A robot among people, not a car.
  builder.traffic().objects[0].size = {0.8, 0.6, 0.9};
  builder.traffic().drivers[0].rest_gap = 0.3;
  builder.traffic().drivers[0].foresight = 0.2;

  Frontage look;
  look.buildings = 0.95;
  look.setback = 0.6;
  look.parked = 0;
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  for (double s = 5; s < length - 5; s += random.uniform(7, 14)) {
    const double lateral = random.either_sign(0.5, 0.85) * half;
    const Waypoint at = street.centre.beside(s, lateral);
    Random model_random = random.fork(random.bits());
    const double what = random.unit();
    if (std::abs(lateral - side_of_ego) < 2.2) continue;
    if (what < 0.45) {
      const double tall = model_random.uniform(5, 9), radius = model_random.uniform(1.5, 2.8);
      builder.tree(at.position, tall, radius, 2.3);
    } else if (what < 0.8) {
      builder.place(furniture_model(model_random), {at.position, at.heading, 0.8, 0.35});
    } else {
      // A stall.
      builder.place(shelter_model(3, 2.2, 2.4), {at.position, at.heading, 1.5, 1.1});
    }
  }
  const double from = before - 45, to = before + travel(config, speed) + 55;
  const int number = builder.count(std::min(0.85 * (to - from), 2000.0));
  for (int i = 0; i < number; ++i) {
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
      const double beside = 0.65 * static_cast<double>(k % 2), behind = -0.7 * static_cast<double>(k / 2);
      std::vector<Vec2> goals;
      for (int step = 0; step <= 3; ++step) {
        const double u = step / 3.0;
        const double l = std::clamp(lateral + drift * u + beside * (lateral > 0 ? -1 : 1),
                                    -half + 0.05, half - 0.05);
        goals.push_back(street.centre.beside(s + run * u + behind, l).position);
      }
      if (norm(goals[0] - builder.traffic().lanes[0].route.at(before).position) < 2.0) continue;
      builder.walker(std::move(goals), pace, start, stop);
    }
  }
  if (builder.lively()) {
    for (int i = 0; i < 3; ++i) {
      const double s = before + random.uniform(-40, 60), side = random.chance(0.5) ? 1 : -1;
      const double lateral = side * random.uniform(0.2, 0.45) * half;
      const bool with = random.chance(0.5);
      const std::size_t object = builder.traffic().add_object(Kind::kCyclist);
      const std::size_t path = builder.traffic().add_lane(street.centre.shifted(
          with ? 0 : length, with ? length : 0, [lateral](double) { return lateral; }));
      const double along = with ? s : builder.traffic().lanes[path].route.length() - s;
      if (std::abs(s - before) < 5) {
        builder.traffic().objects.pop_back();
        continue;
      }
      builder.traffic().add_driver(object, path, along, 3.2);
    }
  }
  return builder.finish();
}

World stop_and_go(const Config& config) {
  const double speed = 8;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.003, 0, 17)), 9.4, 3.2});
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.005, 0.03);
  Builder builder(config, ground, std::move(streets));
  Traffic& traffic = builder.traffic();
  const Street& street = builder.street(0);
  const double inner = -1.75, outer = -5.2;
  const std::size_t lanes[] = {builder.lane(street, inner), builder.lane(street, outer)};
  const std::size_t back_inner = builder.lane(street, -inner);
  const std::size_t back_outer = builder.lane(street, -outer);
  const std::size_t mine = random.index(2);
  builder.ego(lanes[mine], kBefore, speed);
  if (builder.lively()) {
    traffic.drivers[0].speed = 0;
    for (std::size_t lane = 0; lane < 2; ++lane) {
      // A queue whose head waits, goes and waits again.
      const auto ahead = static_cast<int>(3 + random.index(4));
      double s = kBefore + (lane == mine ? 9 : random.uniform(-4, 4));
      const auto first = traffic.drivers.size();
      for (int i = 0; i < ahead; ++i) {
        const double kind = random.unit();
        const std::size_t object = traffic.add_object(kind < 0.75 ? Kind::kCar : kind < 0.9 ? Kind::kVan : Kind::kTruck);
        s += traffic.objects[object].size.length / 2;
        traffic.add_driver(object, lanes[lane], s, speed).speed = 0;
        s += traffic.objects[object].size.length / 2 + random.uniform(1.8, 3.5);
        if (i == 0) s += 0.5;
      }
      if (traffic.drivers.size() > first) {
        Traffic::Driver& head = traffic.drivers.back();
        double t = random.uniform(1, 4);
        head.schedule = {{0, 0}};
        const double end = config.scans / config.rate + 5;
        while (t < end) {
          head.schedule.push_back({t, random.uniform(5, 9)});
          t += random.uniform(4, 9);
          head.schedule.push_back({t, 0});
          t += random.uniform(3, 6);
        }
      }
      // And those behind.
      double behind = kBefore - (lane == mine ? 2.2 : 6.0);
      for (int i = 0; i < 4; ++i) {
        const std::size_t object = traffic.add_object(random.chance(0.8) ? Kind::kCar : Kind::kVan);
        behind -= traffic.objects[object].size.length / 2 + random.uniform(2, 4);
        traffic.add_driver(object, lanes[lane], behind, speed).speed = 0;
        behind -= traffic.objects[object].size.length / 2;
      }
    }
    for (int i = 0; i < builder.count(9); ++i) {
      const int side = random.chance(0.5) ? 1 : -1;
      const double s = kBefore + random.uniform(-25, 80), start = random.uniform(1, 10);
      builder.leaving_car(street, s, side * 8.28, side * 5.2, start, 7);
    }
    fill_lane(builder, back_inner, 25, speed, 0.08, 0.05, 0);
    fill_lane(builder, back_outer, 22, 0.8 * speed, 0.08, 0.08, 0.05);
  }
  Frontage look;
  look.buildings = random.uniform(0.6, 0.95);
  look.parked = random.uniform(0.4, 0.8);
  look.height = random.uniform(8, 18);
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  builder.pavement_walkers(street, kBefore - 40, kBefore + 90, builder.count(22));
  builder.crossing_walkers(street, kBefore - 20, kBefore + 60, builder.count(3));
  return builder.finish();
}

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
  const double half = street.half_width, verge = half + street.pavement;
  const std::size_t forward = builder.lane(street, -kLaneHalf), backward = builder.lane(street, kLaneHalf);
  builder.ego(forward, kBefore, speed);
  const double end = kBefore + travel(config, speed) + 40;
  if (builder.lively()) {
    add_parking_moves(builder, kBefore - 20, end, builder.count(5), 6);
    fill_lane(builder, forward, 30, speed, 0.1, 0.05, 0.06);
    fill_lane(builder, backward, 24, 1.2 * speed, 0.1, 0.05, 0.06);
  }
  // Something overhead all along: bridges, roofs, trees whose crowns meet.
  for (double s = random.uniform(10, 25); s < street.centre.length() - 25;) {
    const double what = random.unit();
    const Waypoint at = street.centre.at(s);
    if (what < 0.35) {
      const double width = random.uniform(8, 22), clearance = random.uniform(4.3, 5.2);
      builder.place_anyway(bridge_model(2 * verge + 0.6, width, clearance), at);
      for (const int side : {-1, 1}) {
        builder.traffic().fixed.add({street.centre.beside(s, side * (verge + 6.3)).position,
                                     at.heading, width / 2, 6});
      }
      s += width + random.uniform(15, 35);
    } else if (what < 0.6) {
      const double run = random.uniform(10, 24), height = random.uniform(4.2, 5);
      builder.place_anyway(shelter_model(run, 2 * (half + 1.2), height), at);
      for (double x = -run / 2; x < run / 2; x += 0.8) {
        for (const int side : {-1, 1}) {
          builder.traffic().fixed.add(
              {street.centre.beside(s + x, side * (half + 1.0)).position, at.heading, 0.4, 0.15});
        }
      }
      s += run + random.uniform(8, 25);
    } else {
      const int pairs = static_cast<int>(2 + random.index(4));
      for (int i = 0; i < pairs; ++i) {
        for (const int side : {-1, 1}) {
          const Vec2 p = street.centre.beside(s + random.uniform(-1, 1), side * (half + 0.7)).position;
          const double radius = random.uniform(3.8, 5.5), high = random.uniform(8, 12);
          builder.tree(p, high, radius, random.uniform(3.6, 4.2));
        }
        s += random.uniform(7, 10);
      }
      s += random.uniform(3, 15);
    }
  }
  // Arcades over the pavements.
  for (double s = random.uniform(5, 40); s < street.centre.length() - 20; s += random.uniform(30, 70)) {
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
  Frontage look;
  look.buildings = 0.7;
  look.street_trees = 0.1;
  look.parked = 0.5;
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  builder.pavement_walkers(street, kBefore - 40, end + 20, builder.count(0.22 * (end - kBefore + 60)));
  builder.crossing_walkers(street, kBefore - 10, end, builder.count(4));
  return builder.finish();
}

World hill(const Config& config) {
  const double speed = 9;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.012, 0.15, 20)), random.chance(0.5) ? 5.8 : 3.9, 2.2});
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.055, 0.08);
  ground.hill_length = random.uniform(110, 220);
  ground.roughness = 0.08;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const std::size_t forward = builder.lane(street, -kLaneHalf), backward = builder.lane(street, kLaneHalf);
  builder.ego(forward, kBefore, speed);
  const double end = kBefore + travel(config, speed) + 40;
  if (builder.lively()) {
    if (street.half_width > 5) add_parking_moves(builder, kBefore - 20, end, builder.count(4), 7);
    fill_lane(builder, forward, 40, speed, 0.1, 0.05, 0.05);
    fill_lane(builder, backward, 32, speed, 0.1, 0.05, 0.05);
  }
  Frontage look;
  look.buildings = random.uniform(0.3, 0.65);
  look.height = 7;
  look.setback = 5;
  look.street_trees = 0.25;
  look.parked = random.uniform(0.2, 0.6);
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  const double trees = random.uniform(4, 15), bushes = random.uniform(5, 20);
  builder.plant(street, street.half_width + street.pavement + 1, 50, trees, bushes);
  builder.pavement_walkers(street, kBefore - 40, end + 20, builder.count(20));
  builder.crossing_walkers(street, kBefore, end, builder.count(3));
  return builder.finish();
}

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
      for (const Vec2 p : turn_points({points.back() + 0.7 * direction(spot.heading), spot.heading}, lane)) points.push_back(p);
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

}  // namespace

void StaticGeometry::add(const Rigid& T_world_model, const Model& model) {
  for (const Primitive& primitive : model) {
    const auto index = static_cast<std::uint32_t>(primitives_.size());
    primitives_.push_back(transformed(T_world_model, primitive));
    const Vec3 c = primitives_.back().centre;
    const double ix = std::floor(static_cast<double>(c.x) / kCell);
    const double iy = std::floor(static_cast<double>(c.y) / kCell);
    const auto key = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(static_cast<std::int32_t>(ix))) << 32) |
                     static_cast<std::uint32_t>(static_cast<std::int32_t>(iy));
    const auto found = cell_of_.emplace(key, cells_.size());
    if (found.second) cells_.push_back({{(ix + 0.5) * kCell, (iy + 0.5) * kCell}, {}});
    cells_[found.first->second].members.push_back(index);
  }
}

World build_world(const Config& config) {
  switch (config.scene) {
    case Scene::kHighway: return highway(config);
    case Scene::kVegetation: return vegetation(config);
    case Scene::kCrowd: return crowd(config);
    case Scene::kStopAndGo: return stop_and_go(config);
    case Scene::kCanopy: return canopy(config);
    case Scene::kHill: return hill(config);
    case Scene::kCarPark: return car_park(config);
    case Scene::kUrban:
    case Scene::kStatic: break;
  }
  return urban(config);
}

}  // namespace dynains::simulation
