// Lines along which streets run and objects move, and rectangles that objects occupy.
#pragma once

#include <algorithm>
#include <cmath>
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
  explicit Route(std::vector<Vec2> points) : points_(std::move(points)) {
    const std::size_t n = points_.size();
    arc_.assign(n, 0);
    for (std::size_t i = 1; i < n; ++i) arc_[i] = arc_[i - 1] + norm(points_[i] - points_[i - 1]);
    tangents_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, n - 1);
      const Vec2 chord = points_[after] - points_[before];
      tangents_[i] = (1 / norm(chord)) * chord;
    }
  }

  double length() const { return arc_.empty() ? 0 : arc_.back(); }
  const std::vector<Vec2>& points() const { return points_; }
  /// `s` is clamped to [0, length()].
  Waypoint at(double s) const {
    s = std::clamp(s, 0.0, length());
    const auto upper = std::upper_bound(arc_.begin() + 1, arc_.end() - 1, s);
    const auto i = static_cast<std::size_t>(upper - arc_.begin());
    const double span = arc_[i] - arc_[i - 1];
    const double u = (s - arc_[i - 1]) / span;
    const double u2 = u * u, u3 = u2 * u;
    const Vec2 position = (2 * u3 - 3 * u2 + 1) * points_[i - 1] +
                          (span * (u3 - 2 * u2 + u)) * tangents_[i - 1] +
                          (3 * u2 - 2 * u3) * points_[i] + (span * (u3 - u2)) * tangents_[i];
    const Vec2 slope = (6 * (u2 - u) / span) * (points_[i - 1] - points_[i]) +
                       (3 * u2 - 4 * u + 1) * tangents_[i - 1] + (3 * u2 - 2 * u) * tangents_[i];
    return {position, std::atan2(slope.y, slope.x)};
  }

  /// The point `lateral` metres to the left of `at(s)`, with the heading of the line.
  Waypoint beside(double s, double lateral) const {
    Waypoint result = at(s);
    result.position = result.position + lateral * left_of(direction(result.heading));
    return result;
  }

  /// Arc length of the nearest vertex.
  double nearest(Vec2 p) const {
    std::size_t best = 0;
    double best_square = 1e300;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vec2 difference = points_[i] - p;
      const double square = dot(difference, difference);
      if (square < best_square) {
        best_square = square;
        best = i;
      }
    }
    return arc_[best];
  }

  /// A route of points a metre apart along this one from `begin` to `end` (backwards if end <
  /// begin), `lateral(s)` metres to the left of this line's own direction.
  Route shifted(double begin, double end, const std::function<double(double)>& lateral) const {
    const auto count = static_cast<std::size_t>(std::max(1.0, std::abs(end - begin)));
    std::vector<Vec2> result;
    for (std::size_t i = 0; i <= count; ++i) {
      const double s = begin + (end - begin) * static_cast<double>(i) / static_cast<double>(count);
      const Vec2 p = beside(s, lateral(s)).position;
      // Inside a tight bend the shifted line may fold back; leave those points out.
      if (!result.empty()) {
        const double heading = at(s).heading;
        const double forward = dot(p - result.back(), direction(heading)) * (end < begin ? -1 : 1);
        if (forward < 0.05) continue;
      }
      result.push_back(p);
    }
    while (result.size() < 2) result.push_back(beside(end, lateral(end)).position);
    return Route(std::move(result));
  }

 private:
  std::vector<Vec2> points_;
  std::vector<Vec2> tangents_;
  std::vector<double> arc_;
};

/// Adds a cubic curve from one waypoint into the direction of another, as a vehicle turns or
/// changes its lane.
inline void add_curve(const Waypoint& from, const Waypoint& to, std::vector<Vec2>& points) {
  const Vec2 between = to.position - from.position;
  const double size = norm(between);
  const auto count = static_cast<int>(std::max(6.0, size / 0.8));
  for (int i = 0; i <= count; ++i) {
    const double u = static_cast<double>(i) / count, u2 = u * u, u3 = u2 * u;
    points.push_back(from.position + (3 * u2 - 2 * u3) * between +
                     (size * (u3 - 2 * u2 + u)) * direction(from.heading) +
                     (size * (u3 - u2)) * direction(to.heading));
  }
}

/// Constant curvature (1/m) over a length (m).
struct Bend {
  double length, curvature;
};
/// Points `step` (m) apart. The curvature changes by at most `swerve` (1/m) from one to the next:
/// no driver turns the wheel at once.
inline Route route_of_bends(const std::vector<Bend>& bends, double step = 1,
                            double swerve = 0.006) {
  std::vector<Vec2> points{{0, 0}};
  double heading = 0, curvature = 0;
  for (const Bend& bend : bends) {
    for (double s = 0; s < bend.length; s += step) {
      curvature += std::clamp(bend.curvature - curvature, -swerve, swerve);
      heading += step * curvature;
      points.push_back(points.back() + step * direction(heading));
    }
  }
  return Route(std::move(points));
}

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

inline Vec2 local(const Footprint& footprint, Vec2 p) {
  const Vec2 u = direction(footprint.heading), d = p - footprint.centre;
  return {dot(d, u), dot(d, left_of(u))};
}

/// True if no axis of `a` separates the two rectangles.
inline bool axes_overlap(const Footprint& a, const Footprint& b) {
  const Vec2 centre = local(a, b.centre);
  const double c = std::abs(std::cos(b.heading - a.heading));
  const double s = std::abs(std::sin(b.heading - a.heading));
  return std::abs(centre.x) <= a.half_length + c * b.half_length + s * b.half_width &&
         std::abs(centre.y) <= a.half_width + s * b.half_length + c * b.half_width;
}

/// Distance from a point to the rectangle, 0 inside.
inline double distance(const Footprint& footprint, Vec2 p) {
  const Vec2 q = local(footprint, p);
  return norm(Vec2{std::max(std::abs(q.x) - footprint.half_length, 0.0),
                   std::max(std::abs(q.y) - footprint.half_width, 0.0)});
}

inline bool overlap(const Footprint& a, const Footprint& b) {
  return axes_overlap(a, b) && axes_overlap(b, a);
}

/// Rectangles that are found by place.
class FootprintSet {
 public:
  void add(const Footprint& footprint) {
    // Every cell within reach of the rectangle's surroundings lists it.
    const double reach = norm(Vec2{footprint.half_length, footprint.half_width}) + kCell / 2;
    const Vec2 c = footprint.centre;
    for (double x = std::floor((c.x - reach) / kCell); x * kCell <= c.x + reach; ++x) {
      for (double y = std::floor((c.y - reach) / kCell); y * kCell <= c.y + reach; ++y) {
        cells_[key({(x + 0.5) * kCell, (y + 0.5) * kCell})].push_back(footprint);
      }
    }
  }

  /// True if the rectangle, grown by `margin` (m), touches no rectangle of the set.
  bool is_free(const Footprint& footprint, double margin = 0.1) const {
    Footprint grown = footprint;
    grown.half_length += margin;
    grown.half_width += margin;
    // Long rectangles are asked piece by piece, so that the cells of their middle suffice.
    const Vec2 u = direction(grown.heading);
    bool free = true;
    const auto pieces = static_cast<int>(std::ceil(grown.half_length / 10.0));
    for (int i = 0; i < pieces && free; ++i) {
      const double offset = grown.half_length * ((2 * i + 1.0) / pieces - 1);
      visit_near(grown.centre + offset * u,
                 [&](const Footprint& other) { free = free && !overlap(grown, other); });
    }
    return free;
  }

  /// Rectangles whose surroundings contain `p`; the nearest 12 m at least.
  template <class Visitor>
  void visit_near(Vec2 p, Visitor&& visitor) const {
    const auto found = cells_.find(key(p));
    if (found == cells_.end()) return;
    for (const Footprint& footprint : found->second) visitor(footprint);
  }

 private:
  static constexpr double kCell = 24.0;

  static std::uint64_t key(Vec2 p) {
    return cell_key(static_cast<int>(std::floor(p.x / kCell)),
                    static_cast<int>(std::floor(p.y / kCell)));
  }

  std::unordered_map<std::uint64_t, std::vector<Footprint>> cells_;
};

}  // namespace dynains::simulation
