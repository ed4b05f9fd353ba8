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
  double gardens = 0.5;     ///< hedges, fences, bushes and trees on open plots
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
    place(tree_model(height, radius, clear, random), {at, random.uniform(0, 6), 0.35, 0.35}, 0.2);
  }

  void bush(Vec2 at, double radius, double height) {
    Random random = random_.fork(random_.bits());
    place(bush_model(radius, height, random),
          {at, random.uniform(0, 6), 0.8 * radius, 0.8 * radius}, 0.2);
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
    const auto plants = static_cast<int>(1 + random_.index(4));
    for (int i = 0; i < plants; ++i) {
      const double along = s + random_.uniform(1, front), deep = back + random_.uniform(2.5, 14);
      const bool is_tree = random_.chance(0.5);
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
      const double run = random_.uniform(30, 80) * (random_.chance(0.5) ? 1 : -1);
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
    Traffic::Driver& driver = t.add_driver(object, t.add_lane(std::move(route)), 3, cruise);
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
    Traffic::Driver& driver = t.add_driver(
        object, t.add_lane(street.centre.shifted(from, s, lateral)), 1, cruise);
    driver.stays_at_end = true;
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
                                 double speed, double main_spacing, bool fill_forward) {
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
  const StreetLanes lanes{builder.lane(main, -kLaneHalf, forward),
                          builder.lane(main, kLaneHalf, backward)};
  (void)fill_forward;
  (void)main_spacing;
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
      traffic.add_driver(object, turning, s, speed * 0.7);
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

  const StreetLanes lanes = add_crossing_traffic(builder, crossings, speed, 30, true);
  builder.ego(lanes.forward, kBefore, speed);
  const double end = kBefore + travel(config, speed) + 40;
  if (builder.lively()) {
    // The ego vehicle is the first driver; those that came with the crossings follow it.
    auto& drivers = builder.traffic().drivers;
    std::swap(drivers.front(), drivers.back());
    add_parking_moves(builder, kBefore - 20, end, builder.count(8), 7);
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

World build_world(const Config& config) { return urban(config); }

}  // namespace dynains::simulation
