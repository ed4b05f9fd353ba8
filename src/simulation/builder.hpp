// Builds a scene from static and moving objects that keep their distance.
#pragma once

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

/// Random numbers of a builder are a stream of their own, beside that of the scene.
class Builder {
 public:
  Builder(const Config& config, const TerrainConfig& ground, std::vector<Street> streets);

  Traffic& traffic() { return world_.traffic; }
  Terrain& terrain() { return world_.terrain; }
  const Street& street(std::size_t i = 0) const { return world_.terrain.streets()[i]; }
  bool lively() const { return config_.scene != Scene::kStatic && config_.traffic > 0; }
  /// As many as the configuration asks for.
  int count(double usual) const;
  World finish() { return std::move(world_); }

  // Static things.

  /// Puts a model on the ground unless its footprint is taken.
  bool place(const Model& model, const Footprint& footprint, double margin = 0.1);
  void place_anyway(const Model& model, const Waypoint& at);
  void tree(Vec2 at, double height, double crown, double clear);
  Model hedge(double length, double width, double height, Random& random) const {
    return hedge_model(is_open(), length, width, height, random);
  }
  /// Buildings, gardens, trees, poles and parked cars on one side (+1 left, -1 right).
  void furnish(const Street& street, int side, const Frontage& look);
  /// Trees and bushes beside the main street, numbers per 100 m and side.
  void plant(double from, double to, double trees, double bushes);
  /// A model each `step` (m) along the main street, `lateral` (m) beside its centre line.
  void row(double lateral, double step, const std::function<Model(Random&)>& model);
  /// Thin things along the kerbs of the main street; `amount` is the ratio to their usual number.
  void clutter(double amount);

  // Vehicles.

  /// Lights; before the lanes of the main street.
  void add_lights(const std::vector<Crossing>& crossings);
  /// A lane of a street: `lateral` to the left of the centre line; negative runs with it.
  std::size_t lane(const Street& street, double lateral, std::vector<StopLine> lines = {});
  std::size_t main_lane(double lateral);
  /// The sensor on a lane. `small`: a robot or a person, who keep less distance than a car.
  void ego(std::size_t lane, double s, double usual_speed, bool small);
  /// Vehicles all along a lane, as many as the configuration asks for.
  void fill_lane(Traffic::Flow flow);
  /// Traffic on side streets, and a vehicle that turns into the main street at each.
  void cross_traffic(const std::vector<Crossing>& crossings, double speed);
  /// Vehicles that leave their places beside the main street, or park there, about when the sensor
  /// passes. `angle` as of Frontage.
  void maneuvers(double from, double to, int number, double angle, double speed);
  /// Vehicles ahead of the sensor and behind it on a lane; the first waits, goes and waits again.
  void queue(std::size_t lane, double cruise);
  bool is_free_of_drivers(const Waypoint& at, double half_length) const {
    return world_.traffic.is_free_of_drivers({at.position, at.heading, half_length, 1.2});
  }

  // People.

  void stroll(const Strollers& strollers);
  /// People who cross from `reach` (m) on one side to the other.
  void cross(double from, double to, int number, double reach);

 private:
  /// Waypoint at arc length s (m), `lateral` (m) beside the street, turned by `turn` (rad).
  using PlaceBeside = std::function<Waypoint(double s, double lateral, double turn)>;

  bool is_open() const { return config_.foliage == Foliage::kOpen; }
  /// Smallest distance (m) of the corners and edges to the streets.
  double clearance(const Footprint& f) const;
  void bush(Vec2 at, double radius, double height);
  void build_plots(const PlaceBeside& at, const Street& street, const Frontage& look);
  /// Hedges, fences, bushes and trees on an open plot.
  void garden(const PlaceBeside& at, double s, double front, double back);
  void furnish_kerb(const PlaceBeside& at, const Street& street, const Frontage& look);
  void park_along(const PlaceBeside& at, const Street& street, const Frontage& look);
  void park(const Waypoint& at, Kind kind);
  /// Whether another street than `street` is nearer to `p` than `margin` (m).
  bool is_near_crossing(const Street& street, Vec2 p, double margin) const;
  void turning_car(const Crossing& crossing, std::size_t signal, double speed);
  void maneuver(double s, int side, double angle, bool leaving, double start, double speed);
  bool walker(std::vector<Vec2> goals, double pace, double start, double stop);
  void add_thing(double s, int side);
  void add_wires(int side);
  /// Adds an object unless it overlaps a street or the path of the sensor.
  void put(const Model& model, const Waypoint& at, double half_length, double half_width);

  Config config_;
  Random random_;
  World world_;
  std::vector<StopLine> main_lines_[2];      ///< lights along the main street and against it
  std::pair<double, std::size_t> outer_[2];  ///< lateral and number of its outer lanes
};

}  // namespace dynains::simulation
