#include "simulation/scenes/layout.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dynains::simulation {

Route route_of_bends(const std::vector<Bend>& bends, double step, double swerve) {
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

Route straight_route(double length) { return Route({{0, 0}, {length / 2, 0}, {length, 0}}); }

double travel(const Config& config, double usual_speed) {
  const double speed = config.ego_speed < 0 ? usual_speed : config.ego_speed;
  return speed * config.scans / config.rate;
}

Route winding(Random& random, double length, double gentle, double corner_chance,
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
  return route_of_bends(bends);
}

std::vector<Crossing> add_side_streets(Random& random, std::vector<Street>& streets, double spacing,
                                       double half_width) {
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
      for (const Street& street : streets) {
        const Waypoint near = street.centre.at(street.centre.nearest(p));
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

}  // namespace dynains::simulation
