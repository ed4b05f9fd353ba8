// Builds a scene from static and moving objects that keep their distance.
#pragma once

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "simulation/world.hpp"

namespace dynains::simulation {

/// How one side of a street looks.
struct Frontage {
  double buildings = 0.8;  ///< share of plots that are built on
  double setback = 1.0;    ///< m between pavement and facade, at most
  double height = 12;      ///< m, about
  double street_trees = 0.6;
  double poles = 0.6;
  double gardens = 0.85;  ///< hedges, fences, bushes and trees on open plots
  double parked = 0.6;    ///< share of parking places in use
  double furniture = 0.5;
};

class Builder {
 public:
  Builder(const Config& config, const TerrainConfig& ground, std::vector<Street> streets)
      : config_(config),
        random_(seed_of(config)),
        world_{Terrain(ground, std::move(streets), random_.fork(1)), {}, Traffic(random_.fork(2))} {
  }

  Random& random() { return random_; }
  Traffic& traffic() { return world_.traffic; }
  Terrain& terrain() { return world_.terrain; }
  const Street& street(std::size_t i) const { return world_.terrain.streets()[i]; }
  World finish();
  const Config& config() const { return config_; }
  bool lively() const { return config_.scene != Scene::kStatic && config_.traffic > 0; }
  int count(double usual) const;

  /// Puts a model on the ground unless its footprint is taken.
  bool place(const Model& model, const Footprint& footprint, double margin = 0.1);

  void place_anyway(const Model& model, const Waypoint& at);

  /// Distance from every corner and the middle of the edges to the streets.
  double clearance(const Footprint& f) const;

  void tree(Vec2 at, double height, double radius, double clear);

  void bush(Vec2 at, double radius, double height);

  Model hedge(double length, double width, double height, Random& random) const;

  void park(const Waypoint& at, Kind kind);

  Kind parked_kind();

  /// Whether another street than `street` is nearer to `p` than `margin` (m).
  bool is_near_crossing(const Street& street, Vec2 p, double margin) const;

  /// Buildings, gardens, trees, poles and parked cars on one side (+1 left, -1 right).
  void furnish(const Street& street, int side, const Frontage& look);

  /// Woods and meadows beside a street.
  void plant(const Street& street, double from, double to, double trees_per_100_m,
             double bushes_per_100_m);

  /// A lane of a street: `lateral` to the left of the centre line; negative runs with it.
  std::size_t lane(const Street& street, double lateral, std::vector<StopLine> lines = {}) {
    const double length = street.centre.length();
    const bool with = lateral < 0;
    return world_.traffic.add_lane(street.centre.shifted(with ? 0 : length, with ? length : 0,
                                                         [lateral](double) { return lateral; }),
                                   std::move(lines));
  }

  /// The ego vehicle on a lane, `kBefore` metres from its start.
  void ego(std::size_t lane, double s, double usual_speed);

  /// A person who walks along `goals`, from `goals[0]`.
  void walker(std::vector<Vec2> goals, double pace, double start = 0, double stop = 1e9);

  /// People on the pavements of a street between arc lengths.
  void pavement_walkers(const Street& street, double from, double to, int number);

  /// People who cross the carriageway.
  void crossing_walkers(const Street& street, double from, double to, int number);

  /// A parked vehicle that pulls out into the lane at `start` seconds.
  void leaving_car(const Street& street, double s, double lateral_place, double lateral_lane,
                   double start, double cruise);

  /// A moving vehicle that leaves its lane and parks at arc length `s`.
  void arriving_car(const Street& street, double from, double s, double lateral_place,
                    double lateral_lane, double cruise);

  /// Lights of the main street along it and against it, from the start of those lanes.
  std::vector<StopLine> main_lines[2];

  /// As above, for a route that begins at arc length `begin` (m) of the main street.
  std::vector<StopLine> lines_from(const Street& street, double begin, bool with) const;

  bool is_free_of_drivers(const Waypoint& at, double half_length) const {
    return world_.traffic.is_free_of_drivers({at.position, at.heading, half_length, 1.2});
  }

 private:
  static std::uint64_t seed_of(const Config& config) {
    const std::uint64_t seed = mix(config.seed, 1000 + static_cast<std::uint64_t>(config.scene));
    return config.day == 0 ? seed : mix(seed, static_cast<std::uint64_t>(config.day));
  }

  /// Waypoint at arc length s (m), `lateral` (m) beside the street, turned by `turn` (rad).
  using PlaceBeside = std::function<Waypoint(double s, double lateral, double turn)>;

  void build_plots(const PlaceBeside& at, const Street& street, const Frontage& look);
  /// Hedges, fences, bushes and trees on an open plot.
  void garden(const PlaceBeside& at, double s, double front, double back, const Frontage& look);
  /// Trees, poles and furniture along the kerb.
  void furnish_kerb(const PlaceBeside& at, const Street& street, const Frontage& look);
  void park_along(const PlaceBeside& at, const Street& street, const Frontage& look);

  Config config_;
  Random random_;
  World world_;
};

/// Signs, bicycles, railings, palings, wires and trolleys beside street 0, people who linger, and
/// groups with prams. `amount` is the ratio to the usual number.
void add_clutter(Builder& builder, double amount);

}  // namespace dynains::simulation
