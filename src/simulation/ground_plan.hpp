// Lines along which streets run and objects move, and rectangles that objects occupy.
#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

#include "simulation/vector.hpp"

namespace dynains::simulation {

/// Position on a route.
struct Waypoint {
  Vec2 position;
  double heading = 0;  ///< rad, counter-clockwise from +x
};

/// A smooth line with arc length: cubic pieces through its points.
class Route {
 public:
  Route() = default;
  /// At least two points, consecutive ones apart.
  explicit Route(std::vector<Vec2> points);

  double length() const { return arc_.empty() ? 0 : arc_.back(); }
  const std::vector<Vec2>& points() const { return points_; }
  /// `s` is clamped to [0, length()].
  Waypoint at(double s) const;
  /// The point `lateral` metres to the left of `at(s)`, with the heading of the line.
  Waypoint beside(double s, double lateral) const;
  /// Arc length of the nearest vertex.
  double nearest(Vec2 p) const;

  /// A route of points a metre apart along this one from `begin` to `end` (backwards if end <
  /// begin), `lateral(s)` metres to the left of this line's own direction.
  Route shifted(double begin, double end, const std::function<double(double)>& lateral) const;

 private:
  std::vector<Vec2> points_;
  std::vector<Vec2> tangents_;
  std::vector<double> arc_;
};

/// A cubic curve from one waypoint into the direction of another, as a vehicle turns or changes its
/// lane.
std::vector<Vec2> curve(const Waypoint& from, const Waypoint& to);

/// Constant curvature (1/m) over a length (m).
struct Bend {
  double length, curvature;
};
/// Points `step` (m) apart. The curvature changes by at most `swerve` (1/m) from one to the next:
/// no driver turns the wheel at once.
Route route_of_bends(const std::vector<Bend>& bends, double step = 1, double swerve = 0.006);

/// A carriageway with pavements on both sides.
struct Street {
  Route centre;
  double half_width = 4;  ///< m, of the carriageway, parking strips included
  double pavement = 3;    ///< m, width on each side, 0 for none
};

/// Oriented rectangle on the ground.
struct Footprint {
  Vec2 centre;
  double heading = 0;
  double half_length = 0, half_width = 0;
};

/// Distance from a point to the rectangle, 0 inside.
double distance(const Footprint& footprint, Vec2 p);
bool overlap(const Footprint& a, const Footprint& b);

/// Rectangles that are found by place.
class FootprintSet {
 public:
  void add(const Footprint& footprint);
  /// True if the rectangle, grown by `margin` (m), touches no rectangle of the set.
  bool is_free(const Footprint& footprint, double margin = 0.1) const;
  /// Rectangles whose surroundings contain `p`; the nearest 12 m at least.
  template <class Visitor>
  void visit_near(Vec2 p, Visitor&& visitor) const {
    const auto found = cells_.find(key(p));
    if (found == cells_.end()) return;
    for (const Footprint& footprint : found->second) visitor(footprint);
  }

 private:
  static constexpr double kCell = 24.0;
  static std::uint64_t key(Vec2 p);

  std::unordered_map<std::uint64_t, std::vector<Footprint>> cells_;
};

}  // namespace dynains::simulation
