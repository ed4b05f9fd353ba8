// Builds a scene from static and moving objects that keep their distance.
#pragma once

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "simulation/scenes/layout.hpp"
#include "simulation/world.hpp"

namespace dynains::simulation {

/// How one side of a street looks: shares of plots and places that are in use, sizes in m.
struct Frontage {
  double buildings = 0.8;
  double setback = 1.0;  ///< between pavement and facade, at most
  double height = 12;    ///< about
  double street_trees = 0.6;
  double poles = 0.6;
  double gardens = 0.85;  ///< hedges, fences, bushes and trees on open plots
  double parked = 0.6;
  double furniture = 0.5;
};

/// When a walker stands: before `start` and from `stop` on, s.
struct Pause {
  double start = 0, stop = 1e9;
};

/// By `mood` in [0, 1): below `standing` stands all the time, below `starting` until `when` (s),
/// above `stopping` from then on.
inline Pause pause_of(double mood, double standing, double starting, double stopping, double when) {
  return {mood < standing ? 1e9 : mood < starting ? when : 0, mood > stopping ? when : 1e9};
}

/// The lanes of a street with two.
struct StreetLanes {
  std::size_t forward, backward;
};

/// Random numbers of a builder are a stream of their own, beside that of the scene.
class Builder {
 public:
  Builder(const Config& config, const TerrainConfig& ground, std::vector<Street> streets);

  Random& random() { return random_; }
  Traffic& traffic() { return world_.traffic; }
  Terrain& terrain() { return world_.terrain; }
  const Street& street(std::size_t i = 0) const { return world_.terrain.streets()[i]; }
  const Config& config() const { return config_; }
  bool lively() const { return config_.scene != Scene::kStatic && config_.traffic > 0; }
  /// As many as the configuration asks for.
  int count(double usual) const;
  World finish();

  // Static things.

  /// Puts a model on the ground unless its footprint is taken.
  bool place(const Model& model, const Footprint& footprint, double margin = 0.1);
  void place_anyway(const Model& model, const Waypoint& at);
  /// Distance from every corner and the middle of the edges to the streets.
  double clearance(const Footprint& f) const;
  void tree(Vec2 at, double height, double radius, double clear);
  void bush(Vec2 at, double radius, double height);
  Model hedge(double length, double width, double height, Random& random) const {
    return hedge_model(is_open(), length, width, height, random);
  }
  /// Buildings, gardens, trees, poles and parked cars on one side (+1 left, -1 right).
  void furnish(const Street& street, int side, const Frontage& look);
  void furnish(const Street& street, const Frontage& look) {
    for (const int side : {1, -1}) furnish(street, side, look);
  }
  /// Woods and meadows beside a street.
  void plant(const Street& street, double from, double to, double trees_per_100_m,
             double bushes_per_100_m);
  /// Rails, walls or hedges along the main street at a fixed distance from its centre line.
  void barrier(double lateral, double piece, const std::function<Model(Random&)>& model);

  // Vehicles.

  void park(const Waypoint& at, Kind kind);
  Kind parked_kind();
  /// Whether another street than `street` is nearer to `p` than `margin` (m).
  bool is_near_crossing(const Street& street, Vec2 p, double margin) const;
  /// A lane of a street: `lateral` to the left of the centre line; negative runs with it.
  std::size_t lane(const Street& street, double lateral, std::vector<StopLine> lines = {});
  /// The ego vehicle on a lane. `robot`: it is small and keeps less distance than a car.
  void ego(std::size_t lane, double s, double usual_speed, bool robot = false);
  /// Vehicles all along a lane, as many as the configuration asks for.
  void fill_lane(Traffic::Flow flow);
  /// Two-way traffic with lights at the crossings, and vehicles that turn there; the ego vehicle.
  StreetLanes two_way(const std::vector<Crossing>& crossings, double speed);
  /// Cars that leave their places and cars that park, along the stretch that is driven.
  void parking_moves(double from, double to, int number, double speed);
  /// A parked vehicle that pulls out into the lane at `start` seconds.
  void leaving_car(double s, double lateral_place, double lateral_lane, double start,
                   double cruise);
  bool is_free_of_drivers(const Waypoint& at, double half_length) const {
    return world_.traffic.is_free_of_drivers({at.position, at.heading, half_length, 1.2});
  }

  // People.

  /// A person who walks along `goals`, from `goals[0]`, unless that is taken.
  bool walker(std::vector<Vec2> goals, double pace, const Pause& pause = {});
  /// `parts` + 1 points along the main street from arc length s on.
  std::vector<Vec2> way_along(double s, double run, int parts, double lateral) const;
  /// People on the pavements of the main street between arc lengths.
  void pavement_walkers(double from, double to, int number);
  /// People who cross the carriageway.
  void crossing_walkers(double from, double to, int number);

 private:
  /// Waypoint at arc length s (m), `lateral` (m) beside the street, turned by `turn` (rad).
  using PlaceBeside = std::function<Waypoint(double s, double lateral, double turn)>;

  bool is_open() const { return config_.foliage == Foliage::kOpen; }
  void build_plots(const PlaceBeside& at, const Street& street, const Frontage& look);
  /// Hedges, fences, bushes and trees on an open plot.
  void garden(const PlaceBeside& at, double s, double front, double back, const Frontage& look);
  /// Trees, poles and furniture along the kerb.
  void furnish_kerb(const PlaceBeside& at, const Street& street, const Frontage& look);
  void park_along(const PlaceBeside& at, const Street& street, const Frontage& look);
  /// A vehicle that turns from the side street into the main street at a crossing.
  void turning_car(const Crossing& crossing, std::size_t signal, double speed);
  /// A moving vehicle that leaves its lane and parks at arc length `s`.
  void arriving_car(double from, double s, double lateral_place, double lateral_lane,
                    double cruise);
  /// Lights of the main street for a route that begins at arc length `begin` (m).
  std::vector<StopLine> lines_from(double begin, bool with) const;

  Config config_;
  Random random_;
  World world_;
  std::vector<StopLine> main_lines_[2];  ///< lights along the main street and against it
};

/// Signs, bicycles, railings, palings, wires and trolleys beside street 0, people who linger, and
/// groups with prams. `amount` is the ratio to the usual number.
void add_clutter(Builder& builder, double amount);

}  // namespace dynains::simulation
