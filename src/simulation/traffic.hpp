// Motion of objects: vehicles follow routes and brake for obstacles; people walk to their
// goals and give way to one another.
#pragma once

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
  Model model;                 ///< empty for people, whose shape changes
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
  bool is_red(double time, int stream) const;
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
    std::vector<std::pair<double, double>> schedule;
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

  std::size_t add_object(Kind kind);
  std::size_t add_object(Kind kind, const Size& size);
  std::size_t add_lane(Route route, std::vector<StopLine> stop_lines = {});
  Driver& add_driver(std::size_t object, std::size_t lane, double s, double cruise);
  /// Vehicles all along the lane at random gaps, except near drivers that are already there.
  void fill(const Flow& flow);

  Waypoint place_of(const Driver& driver) const { return lanes[driver.lane].route.at(driver.s); }
  Footprint footprint_of(std::size_t object, const Waypoint& at) const {
    const Size& size = objects[object].size;
    return {at.position, at.heading, size.length / 2, size.width / 2};
  }
  bool is_free_of_drivers(const Footprint& footprint) const;

  /// Advances by `dt` seconds.
  void step(double dt);

  EgoPose ego() const;
  /// Everybody within `radius` of `centre`.
  std::vector<ObjectPose> around(Vec2 centre, double radius) const;

 private:
  static constexpr double kActiveRadius = 260;  ///< m, around the sensor; others stand still

  struct Body {
    Footprint footprint;
    Vec2 velocity;
    const Driver* driver;  ///< null if it is none
    bool person;
  };

  /// Calls `visit(pose, driver)` for everybody within `radius` of `centre`. `driver` is null if it
  /// is none.
  template <class Visitor>
  void visit_around(Vec2 centre, double radius, Visitor&& visit) const {
    const auto add = [&](const ObjectPose& pose, const Driver* driver) {
      if (norm(pose.at.position - centre) < radius) visit(pose, driver);
    };
    for (const Driver& driver : drivers) {
      if (!driver.active) continue;
      add({driver.object, place_of(driver), driver.speed, 1.1 * driver.s}, &driver);
    }
    for (const Walker& walker : walkers) {
      add({walker.object, {walker.position, walker.heading}, norm(walker.velocity), walker.phase},
          nullptr);
    }
    for (const ObjectPose& pose : parked) add(pose, nullptr);
  }

  Kind random_kind(const Flow& flow);
  void enter(Flow& flow, double s);
  void collect_bodies(Vec2 centre, double radius);
  double free_distance(const Driver& driver, double reach, double& speed_ahead) const;
  /// Speed (m/s) on a free road: schedule, gaps in cross traffic, bends.
  double wanted_speed(const Driver& driver) const;
  double wanted_acceleration(const Driver& driver) const;
  /// Velocity (m/s) towards the walker's goal; takes the next goal near the current one.
  static Vec2 wanted_velocity(Walker& walker);
  /// Acceleration (m/s^2): towards the wanted velocity, away from others and from obstacles.
  Vec2 social_force(const Walker& walker, Vec2 wanted) const;
  /// Whether a step to `next` ends too near to an obstacle or a body, and nearer than before it.
  bool is_blocked(const Walker& walker, Vec2 next) const;
  void walk(Walker& walker, double dt);

  Random random_;
  double time_ = 0;
  std::vector<Body> bodies_;
  double last_heading_ = 0;
  double turn_rate_ = 0;
};

}  // namespace dynains::simulation
