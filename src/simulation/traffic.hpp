// Motion of objects: vehicles follow routes and brake for obstacles; people walk to their
// goals and give way to one another.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "simulation/ground_plan.hpp"
#include "simulation/models.hpp"
#include "simulation/random.hpp"

namespace dynains::simulation {

/// Something with an instance id, moving or not.
struct Object {
  Kind kind = Kind::kCar;
  Size size;
  std::uint64_t seed = 0;
  Model model = {};            ///< empty for people, whose shape changes
  std::uint16_t label = 0;     ///< SemanticKITTI class; 0: that of its kind
  std::uint32_t instance = 0;  ///< 0: by its number
};

/// Pose of an object at the time of one scan.
struct ObjectPose {
  std::size_t object = 0;
  Waypoint at;
  double speed = 0;
  double phase = 0;  ///< of the gait, rad
};

struct EgoPose {
  Waypoint at;
  double speed = 0;
  double acceleration = 0;
  double turn_rate = 0;  ///< rad/s
};

/// Traffic light for two crossing streams.
struct Signal {
  double period = 40;
  double phase = 0;
  /// Stream 0 is the main street, 1 the side street.
  bool is_red(double time, int stream) const {
    const double turn = (time + phase) / period;
    const double part = turn - std::floor(turn);
    return stream == 0 ? part >= 0.5 : part < 0.57 || part >= 0.92;
  }
};

struct StopLine {
  double s = 0;
  std::size_t signal = 0;
  int stream = 0;
};

struct Lane {
  Route route;
  std::vector<StopLine> stop_lines;
};

class Traffic {
 public:
  struct Driver {
    std::size_t object = 0;
    std::size_t lane = 0;
    double s = 0;  ///< of the vehicle's middle
    double speed = 0;
    double cruise = 10;         ///< m/s
    bool stays_at_end = false;  ///< parks at the end of the route instead of leaving the world
    bool yields = false;        ///< to vehicles that are about to cross, or come from behind
    double rest_gap = 2.0;      ///< m, gap to the vehicle in front at rest
    double foresight = 1.2;     ///< s, how early people are given way to
    /// From `first` seconds on, `second` replaces `cruise`.
    std::vector<std::pair<double, double>> schedule = {};
    double acceleration = 0;
    bool active = true;
  };

  struct Walker {
    std::size_t object = 0;
    Vec2 position;
    double heading = 0;
    std::vector<Vec2> goals;  ///< visited in order, there and back
    double pace = 1.3;        ///< m/s
    double start = 0;         ///< s; stands still before
    double stop = 1e9;        ///< s; stands still from then on
    Vec2 velocity;
    std::size_t goal = 0;
    double phase = 0;
  };

  /// New vehicles enter a lane at its start.
  struct Flow {
    std::size_t lane = 0;
    double spacing = 40;                         ///< m, about
    double speed = 12;                           ///< m/s, about
    double trucks = 0, buses = 0, cyclists = 0;  ///< shares
    double vans = 0.15;                          ///< share
    double stops = 0;                            ///< share that waits somewhere, and goes on
    double next_gap = 0;
  };

  explicit Traffic(Random random) : random_(random) {}

  FootprintSet fixed;  ///< obstacles that walkers avoid
  std::vector<Object> objects;
  std::vector<ObjectPose> parked;
  std::vector<Lane> lanes;
  std::vector<Signal> signals;
  std::vector<Driver> drivers;  ///< the first is the ego vehicle
  std::vector<Walker> walkers;
  std::vector<Flow> flows;

  std::size_t add_object(Kind kind) { return add_object(kind, random_size(kind, random_)); }

  std::size_t add_object(Kind kind, const Size& size) {
    objects.push_back({kind, size, random_.bits()});
    if (kind != Kind::kPedestrian && kind != Kind::kCyclist) {
      Random random(objects.back().seed);
      objects.back().model = vehicle_model(kind, size, random);
    }
    return objects.size() - 1;
  }

  std::size_t add_lane(Route route, std::vector<StopLine> stop_lines = {}) {
    lanes.push_back({std::move(route), std::move(stop_lines)});
    return lanes.size() - 1;
  }

  Driver& add_driver(std::size_t object, std::size_t lane, double s, double cruise) {
    drivers.push_back({object, lane, s, cruise, cruise});
    return drivers.back();
  }

  /// Vehicles all along the lane at random gaps, except near drivers that are already there.
  void fill(Flow flow) {
    double s = random_.uniform(2, flow.spacing);
    while (s < lanes[flow.lane].route.length() - 2) {
      enter(flow, s);
      s += std::max(14.0, flow.spacing * random_.uniform(0.4, 1.6));
    }
    flow.next_gap = flow.spacing;
    flows.push_back(flow);
  }

  Waypoint place_of(const Driver& driver) const { return lanes[driver.lane].route.at(driver.s); }
  Footprint footprint_of(std::size_t object, const Waypoint& at) const {
    const Size& size = objects[object].size;
    return {at.position, at.heading, size.length / 2, size.width / 2};
  }

  bool is_free_of_drivers(const Footprint& footprint) const {
    for (const Driver& driver : drivers) {
      if (driver.active && overlap(footprint, footprint_of(driver.object, place_of(driver)))) {
        return false;
      }
    }
    return true;
  }

  /// Advances by `dt` seconds.
  void step(double dt) {
    const Vec2 centre = place_of(drivers[0]).position;
    collect_bodies(centre);
    for (Driver& driver : drivers) {
      if (!driver.active) continue;
      const bool is_near = norm(place_of(driver).position - centre) <= kActiveRadius;
      driver.acceleration = is_near ? wanted_acceleration(driver) : 0;
    }
    for (Driver& driver : drivers) {
      const double before = driver.speed;
      if (!driver.active) continue;
      const Vec2 at = place_of(driver).position;
      if (norm(at - centre) > kActiveRadius) continue;
      driver.speed = std::max(0.0, before + dt * driver.acceleration);
      driver.s += 0.5 * dt * (before + driver.speed);
      const double length = lanes[driver.lane].route.length();
      if (!driver.stays_at_end && driver.s >= length - 0.5 && &driver != &drivers[0]) {
        driver.active = false;
      }
      driver.s = std::min(driver.s, length);
    }
    for (Walker& walker : walkers) {
      if (norm(walker.position - centre) < kActiveRadius) walk(walker, dt);
    }
    for (Flow& flow : flows) {
      double nearest = 1e9;
      for (const Driver& driver : drivers) {
        if (driver.active && driver.lane == flow.lane) nearest = std::min(nearest, driver.s);
      }
      if (nearest > flow.next_gap) {
        enter(flow, 2.0);
        flow.next_gap = std::max(14.0, flow.spacing * random_.uniform(0.4, 1.6));
      }
    }
    time_ += dt;
    const double heading = place_of(drivers[0]).heading;
    if (time_ > 1.5 * dt) {
      // Acceleration of a body with a bounded turn rate.
      turn_rate_ += 0.2 * (wrap(heading - last_heading_) / dt - turn_rate_);
    }
    last_heading_ = heading;
  }

  EgoPose ego() const {
    const Driver& driver = drivers[0];
    return {place_of(driver), driver.speed, driver.acceleration, turn_rate_};
  }

  /// Everybody within `radius` of `centre`; the vehicle of the sensor is the first if it is.
  std::vector<ObjectPose> around(Vec2 centre, double radius) const {
    std::vector<ObjectPose> result;
    const auto add = [&](const ObjectPose& pose) {
      if (norm(pose.at.position - centre) < radius) result.push_back(pose);
    };
    for (const Driver& driver : drivers) {
      if (driver.active) add({driver.object, place_of(driver), driver.speed, 1.1 * driver.s});
    }
    for (const Walker& walker : walkers) {
      add({walker.object, {walker.position, walker.heading}, norm(walker.velocity), walker.phase});
    }
    for (const ObjectPose& pose : parked) add(pose);
    return result;
  }

 private:
  static constexpr double kActiveRadius = 260;  ///< m, around the sensor; others stand still

  struct Body {
    Footprint footprint;
    Vec2 velocity;
    std::size_t object;
    bool person;
  };

  Kind random_kind(const Flow& flow) {
    double u = random_.unit();
    const auto is_among = [&u](double share) { return (u -= share) < 0; };
    if (is_among(flow.trucks)) return Kind::kTruck;
    if (is_among(flow.buses)) return Kind::kBus;
    if (is_among(flow.vans)) return Kind::kVan;
    if (is_among(flow.cyclists)) return Kind::kCyclist;
    return Kind::kCar;
  }

  void enter(Flow& flow, double s) {
    const Kind kind = random_kind(flow);
    const double factor = random_.uniform(0.85, 1.15);
    const double speed = kind == Kind::kCyclist ? 4.5 * factor : flow.speed * factor;
    const std::size_t object = add_object(kind);
    Footprint footprint = footprint_of(object, lanes[flow.lane].route.at(s));
    footprint.half_length = objects[object].size.length / 2 + 3 + 0.5 * speed;
    // Nobody appears inside somebody else.
    if (!is_free_of_drivers(footprint) || !fixed.is_free(footprint, 0)) {
      objects.pop_back();
      return;
    }
    Driver& driver = add_driver(object, flow.lane, s, speed);
    if (!random_.chance(flow.stops)) return;
    const double begin = time_ + random_.uniform(0, 20);
    driver.schedule = {{begin, 0}, {begin + random_.uniform(5, 40), speed}};
  }

  void collect_bodies(Vec2 centre) {
    bodies_.clear();
    for (const ObjectPose& pose : around(centre, kActiveRadius + 40)) {
      bodies_.push_back({footprint_of(pose.object, pose.at),
                         pose.speed * direction(pose.at.heading), pose.object,
                         objects[pose.object].kind == Kind::kPedestrian});
    }
  }

  double free_distance(const Driver& driver, double reach, double& speed_ahead) const {
    const Lane& lane = lanes[driver.lane];
    const Size& size = objects[driver.object].size;
    const double clearance = size.width / 2 + 0.3;
    const Vec2 here = place_of(driver).position;
    std::vector<const Body*> near;
    for (const Body& body : bodies_) {
      if (body.object == driver.object) continue;
      const double far = reach + size.length + body.footprint.half_length + 4;
      if (norm(body.footprint.centre - here) < far) near.push_back(&body);
    }
    if (near.empty()) return reach;
    for (double d = 0; d <= reach; d += 0.7) {
      const double s = driver.s + size.length / 2 + d;
      if (s > lane.route.length()) break;
      const Waypoint at = lane.route.at(s);
      for (const Body* body : near) {
        const auto blocks = [&](double seconds, double margin) {
          Footprint footprint = body->footprint;
          footprint.centre = footprint.centre + seconds * body->velocity;
          return distance(footprint, at.position) < clearance + margin;
        };
        const bool is_near_mover = driver.yields && d > 2 && norm(body->velocity) > 1;
        // Vehicles brake for people before these step onto the lane.
        if (blocks(0, 0) || (body->person && d > 1 && blocks(driver.foresight, 0)) ||
            (is_near_mover && (blocks(0.7, 0.3) || blocks(1.4, 0.3) || blocks(2.1, 0.3)))) {
          speed_ahead = std::max(0.0, dot(body->velocity, direction(at.heading)));
          return d;
        }
      }
    }
    return reach;
  }

  /// Speed (m/s) on a free road: schedule, gaps in cross traffic, bends.
  double wanted_speed(const Driver& driver) const {
    const Lane& lane = lanes[driver.lane];
    double cruise = driver.cruise;
    for (const auto& change : driver.schedule) {
      if (time_ >= change.first) cruise = change.second;
    }
    if (driver.yields && driver.speed < 0.1 && cruise > 0) {
      const Waypoint at = place_of(driver);
      for (const Body& body : bodies_) {
        if (body.object == driver.object || norm(body.velocity) < 1) continue;
        const Vec2 towards = at.position - body.footprint.centre;
        const double distance = norm(towards);
        if (distance < 25 && dot(towards, body.velocity) > 0.7 * distance * norm(body.velocity)) {
          cruise = 0;
        }
      }
    }
    // Bends: at most 2 m/s^2 to the side.
    for (const double ahead : {0.0, 5.0, 12.0, 25.0}) {
      const double a = lane.route.at(driver.s + ahead).heading;
      const double b = lane.route.at(driver.s + ahead + 4).heading;
      const double curvature = std::abs(wrap(b - a)) / 4;
      if (curvature > 0.004) {
        const double bend_speed = std::sqrt(2.0 / curvature);
        cruise = std::min(cruise, std::sqrt(bend_speed * bend_speed + 2 * 1.5 * ahead));
      }
    }
    return cruise;
  }

  double wanted_acceleration(const Driver& driver) const {
    const Lane& lane = lanes[driver.lane];
    const Size& size = objects[driver.object].size;
    const double cruise = wanted_speed(driver);
    const double v = driver.speed;
    if (cruise <= 0.01) return v > 0.05 ? -2.0 : -v / 0.1;

    const double reach = v * v / 4 + 2.0 * v + 8;
    double speed_ahead = 0;
    double gap = free_distance(driver, reach, speed_ahead);
    bool blocked = gap < reach;
    const auto stop_at = [&](double distance) {
      gap = distance;
      speed_ahead = 0;
      blocked = true;
    };
    const double front = driver.s + size.length / 2;
    for (const StopLine& line : lane.stop_lines) {
      const double to_line = line.s - front;
      const bool can_stop = to_line > v * v / 7;
      if (to_line > -0.5 && to_line < gap && can_stop &&
          signals[line.signal].is_red(time_, line.stream)) {
        stop_at(to_line + 1.5);
      }
    }
    if (driver.stays_at_end) {
      const double to_end = lane.route.length() - driver.s;
      if (to_end < 0.1) return -v / 0.1;
      if (to_end + 2 < gap || to_end < 0.3) stop_at(to_end + 2);
    }
    constexpr double comfort = 1.5;  // m/s^2
    // Intelligent driver model: Treiber, Hennecke, Helbing, "Congested traffic states", 2000.
    const double ratio = v / cruise;
    double acceleration = comfort * (1 - ratio * ratio * ratio * ratio);
    if (blocked) {
      const double closing = v - speed_ahead;
      const double wanted =
          driver.rest_gap + std::max(0.0, 1.1 * v + v * closing / (2 * std::sqrt(comfort * 2.0)));
      const double share = wanted / std::max(gap, 0.1);
      acceleration -= comfort * share * share;
    }
    return std::clamp(acceleration, -7.0, comfort);
  }

  /// Velocity (m/s) towards the walker's goal; takes the next goal near the current one.
  static Vec2 wanted_velocity(Walker& walker) {
    Vec2 to_goal = walker.goals[walker.goal] - walker.position;
    if (norm(to_goal) < 0.8) {
      ++walker.goal;
      if (walker.goal == walker.goals.size()) {
        walker.goal = 0;
        std::reverse(walker.goals.begin(), walker.goals.end());
      }
      to_goal = walker.goals[walker.goal] - walker.position;
    }
    return (walker.pace / std::max(norm(to_goal), 0.3)) * to_goal;
  }

  /// Acceleration (m/s^2): towards the wanted velocity, away from others and from obstacles.
  /// Social force model: Helbing and Molnar, 1995; people also pass on the right.
  Vec2 social_force(const Walker& walker, Vec2 wanted) const {
    Vec2 force = (1 / 0.5) * (wanted - walker.velocity);
    for (const Body& body : bodies_) {
      const Vec2 apart = walker.position - body.footprint.centre;
      const double far = norm(apart);
      // The nearest of all is the walker itself.
      if (far > 4 + body.footprint.half_length || far < (body.person ? 0.05 : 0.01)) continue;
      const double gap = distance(body.footprint, walker.position);
      if (gap > 2.5) continue;
      const Vec2 away = (1 / far) * apart;
      const double strength = (body.person ? 4.0 : 7.0) * std::exp(-gap / 0.45);
      force = force + strength * (away + (-0.35) * left_of((1 / walker.pace) * wanted));
    }
    fixed.visit_near(walker.position, [&](const Footprint& footprint) {
      const double gap = distance(footprint, walker.position);
      if (gap > 1.2) return;
      // Away from the nearest point of the rectangle.
      const Vec2 u = direction(footprint.heading), d = walker.position - footprint.centre;
      const double x = std::clamp(dot(d, u), -footprint.half_length, footprint.half_length);
      const double y = std::clamp(dot(d, left_of(u)), -footprint.half_width, footprint.half_width);
      const Vec2 nearest = footprint.centre + x * u + y * left_of(u);
      const Vec2 apart = gap > 0.01 ? walker.position - nearest : d;
      force = force + (8.0 * std::exp(-gap / 0.25) / std::max(norm(apart), 1e-3)) * apart;
    });
    return force;
  }

  /// Whether a step to `next` ends too near to an obstacle or a body, and nearer than before it.
  bool is_blocked(const Walker& walker, Vec2 next) const {
    const auto comes_too_near = [&](const Footprint& footprint, double keep) {
      const double gap = distance(footprint, next);
      return gap < keep && gap < distance(footprint, walker.position);
    };
    bool blocked = false;
    fixed.visit_near(next, [&](const Footprint& footprint) {
      blocked = blocked || comes_too_near(footprint, 0.25);
    });
    for (const Body& body : bodies_) {
      const bool itself = body.person && norm(body.footprint.centre - walker.position) < 1e-6;
      if (blocked || itself || norm(body.footprint.centre - next) > 10) continue;
      blocked = comes_too_near(body.footprint, body.person ? 0.2 : 0.35);
    }
    return blocked;
  }

  void walk(Walker& walker, double dt) {
    const bool standing = time_ < walker.start || time_ >= walker.stop || walker.goals.empty();
    if (standing) {
      walker.velocity = {};
      return;
    }
    const Vec2 wanted = wanted_velocity(walker);
    Vec2 velocity = walker.velocity + dt * social_force(walker, wanted);
    const double speed = norm(velocity), limit = 1.4 * walker.pace;
    if (speed > limit) velocity = (limit / speed) * velocity;
    const Vec2 next = walker.position + dt * velocity;
    if (is_blocked(walker, next)) {
      walker.velocity = {};
      return;
    }
    walker.velocity = velocity;
    walker.position = next;
    if (norm(velocity) > 0.2) {
      const double turn = wrap(std::atan2(velocity.y, velocity.x) - walker.heading);
      walker.heading += std::clamp(turn, -4 * dt, 4 * dt);
    }
    walker.phase += 2 * kPi * 0.75 * norm(velocity) * dt;
  }

  Random random_;
  double time_ = 0;
  std::vector<Body> bodies_;
  double last_heading_ = 0;
  double turn_rate_ = 0;
};

}  // namespace dynains::simulation
