// Lines along which streets run and objects move.
#pragma once

#include <functional>
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

}  // namespace dynains::simulation
