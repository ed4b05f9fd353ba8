// The scenes: what lies along the way of the sensor, as numbers that are drawn for each world.
#include <algorithm>
#include <cmath>

#include "simulation/builder.hpp"

namespace dynains::simulation {
namespace {

/// Roof of a place, or barriers at its edges.
enum class Cover {
  kNone,
  kCrowns,  ///< bridges, and avenues whose crowns meet
  kRails,   ///< guard rails, walls, and a bridge now and then
  kHedges,  ///< on some of the sides
  kTube,    ///< walls and a ceiling along the way
  kBorder,  ///< buildings, hedges or fences around all
  kLow,     ///< walls and a ceiling around all, and columns
  kGlass,   ///< the same with one side of glass
};

/// A lane of the main street, `lateral` (m) to the left of its centre line, and who drives there.
struct Stream {
  double lateral;
  Traffic::Flow flow = {0, 0};  ///< nobody with spacing 0
};

/// A place along one main street. Lengths in m.
struct Place {
  double speed = 8.5;   ///< m/s, usual of the sensor
  double before = 140;  ///< of street behind the start and beyond the end
  bool small = false;   ///< the carrier of the sensor
  Route street, way;    ///< way: of the sensor, if not the first lane
  double half_width = 5.8, pavement = 0;
  double side_streets = 0;  ///< from one to the next; 0: none
  TerrainConfig ground;
  std::vector<Stream> lanes;
  double maneuvers = 0, parking_speed = 7;  ///< number per 100 m, m/s
  bool queues = false, lead = false;        ///< on the lanes of the sensor's side; ahead of it
  Frontage look[2];                         ///< right, left
  double plants_from = 0, plants_to = 45, trees = 0, bushes = 0;  ///< numbers per 100 m and side
  Cover cover = Cover::kNone;
  double height = 0;                                    ///< of walls and ceilings
  double things = 0;                                    ///< share of steps with furniture inside
  double walkers = 0, inner = 0, outer = 0, drift = 0;  ///< groups per m, where they walk
  double run = 60, crossers = 0, reach = 0;             ///< of walkers, number, where they start
};

/// How far the sensor drives, m.
double travel(const Config& config, double usual_speed) {
  const double speed = config.ego_speed < 0 ? usual_speed : config.ego_speed;
  return speed * config.scans / config.rate;
}

/// Gentle bends (1/m) and now and then a corner, alternating so that the way never meets itself.
Route winding(Random& random, double length, double gentle, double corner_chance = 0,
              double radius = 20) {
  std::vector<Bend> bends{{60, 0}};
  double done = 60;
  for (int turn = random.chance(0.5) ? 1 : -1; done < length; turn = -turn) {
    const bool corner = random.chance(corner_chance);
    const double r =
        corner ? radius * random.uniform(0.8, 1.2) : 1 / (gentle * random.uniform(0.2, 1.0));
    const double arc = corner ? kPi / 2 * random.uniform(0.85, 1.05) * r : random.uniform(30, 80);
    bends.push_back({random.uniform(50, 110), 0});
    bends.push_back({arc, turn / r});
    done += bends[bends.size() - 2].length + arc;
  }
  bends.push_back({60, 0});
  return route_of_bends(bends);
}

/// Straight parts of a length from `least` to `most`, joined by turns by `angle` that alternate.
Route folded(Random& random, double length, double least, double most, double angle, double radius,
             bool smooth) {
  std::vector<Bend> bends{{random.uniform(least, most), 0}};
  double done = bends[0].length;
  for (int turn = random.chance(0.5) ? 1 : -1; done < length; turn = -turn) {
    bends.push_back({angle * radius, turn / radius});
    bends.push_back({random.uniform(least, most), 0});
    done += angle * radius + bends.back().length;
  }
  return smooth ? route_of_bends(bends) : route_of_bends(bends, 0.25, 1);
}

Route straight(double length) { return Route({{0, 0}, {length / 2, 0}, {length, 0}}); }

/// Rounds on an ellipse in the middle of a room, as long as the sensor drives; at least one.
Route rounds(double length, double half_width, double drive) {
  const double a = 0.2 * length, b = 0.4 * half_width;
  std::vector<Vec2> points;
  double way = 0;
  for (double turn = 0; turn < 2 * kPi || way < drive + 1; turn += 0.2) {
    points.push_back({0.5 * length + a * std::cos(turn), b * std::sin(turn)});
    way += 0.2 * std::min(a, b);
  }
  return Route(std::move(points));
}

Frontage draw_frontage(Random& random, bool any) {
  Frontage look;
  look.buildings = any ? random.uniform(0.1, 1.0) : random.uniform(0.55, 0.95);
  look.gardens = any ? random.uniform(0.3, 1) : 0.85;
  look.setback = random.uniform(0.2, any ? 8 : 5);
  look.height = any ? random.uniform(4, 20) : random.uniform(7, 16);
  look.street_trees = any ? random.uniform(0, 0.8) : random.uniform(0.2, 0.7);
  look.poles = any ? random.uniform(0.2, 0.9) : 0.6;
  look.furniture = any ? random.uniform(0.2, 0.9) : 0.5;
  look.parked = any ? random.uniform(0, 1) : random.uniform(0.35, 0.85);
  return look;
}

/// A street of a town, for a vehicle.
Place town(const Config& config, Random& random, double speed, double gentle, double corners) {
  Place p;
  p.speed = speed;
  p.street = winding(random, 2 * p.before + travel(config, speed) + 30, gentle, corners);
  p.pavement = random.uniform(2.2, 4.0);
  p.ground.hill_slope = random.uniform(0.003, 0.03);
  p.lanes = {{-1.75, {0, 38, speed, 0.08, 0.05, 0.06}}, {1.75, {0, 30, speed, 0.08, 0.05, 0.06}}};
  p.maneuvers = 3;
  p.look[0] = p.look[1] = draw_frontage(random, false);
  p.walkers = 0.16;
  p.crossers = 5;
  return p;
}

/// A street whose every part is drawn.
Place mixed(const Config& config, Random& random) {
  const bool small = config.gait != Gait::kVehicle;
  const double gentle = random.uniform(0.001, 0.015), corners = random.uniform(0, 0.4);
  Place p = town(config, random, small ? 1.2 : 8, gentle, corners);
  p.small = small;
  const double width = random.unit(), rough = random.unit();
  const bool angled = width > 0.65;
  p.half_width = angled         ? random.uniform(8.6, 9.8)
                 : width < 0.25 ? random.uniform(3.4, 4.2)
                                : random.uniform(5.6, 7.2);
  p.pavement = small ? random.uniform(3, 6) : random.uniform(0.5, 5);
  if (random.chance(0.6)) p.side_streets = random.uniform(50, 140);
  p.ground.hill_slope = random.chance(0.3) ? random.uniform(0.03, 0.09) : random.uniform(0, 0.03);
  p.ground.hill_length = random.uniform(50, 400);
  p.ground.roughness = 0.005 + 0.15 * rough * rough;
  p.ground.kerb = random.chance(0.2) ? 0 : random.uniform(0.03, 0.2);
  for (Stream& stream : p.lanes) {
    const double speed = 8 * random.uniform(0.5, 1.4);
    stream.flow = {0, random.uniform(16, 75), speed, random.uniform(0, 0.2)};
    stream.flow.buses = random.uniform(0, 0.1);
    stream.flow.cyclists = random.uniform(0, 0.25);
    stream.flow.stops = random.uniform(0, 0.3);
  }
  p.maneuvers = random.uniform(0, 5);
  p.lead = !small && random.chance(0.4);
  for (Frontage& look : p.look) {
    if (random.chance(0.7)) look = draw_frontage(random, true);
    if (angled && random.chance(0.75)) look.angle = random.uniform(40, 90) * kPi / 180;
  }
  if (random.chance(0.4)) p.trees = random.uniform(2, 40);
  if (random.chance(0.4)) p.bushes = random.uniform(4, 60);
  p.walkers = random.uniform(0.02, 0.25);
  p.crossers = random.uniform(0, 6);
  // A carrier walks on the pavement.
  if (small) {
    const double side = -(p.half_width + 0.6 * p.pavement);
    p.way = p.street.shifted(0, p.street.length(), [side](double) { return side; });
  }
  return p;
}

/// A place between walls or at walking pace: people all over it.
Place walk(const Config& config, Random& random, double speed, double before, double half_width,
           double walkers) {
  Place p;
  p.speed = speed;
  p.before = before;
  p.small = true;
  p.street = straight(2 * before + travel(config, speed) + 20);
  p.half_width = half_width;
  p.ground = {0.0005, 180, 0.003, 0, kClasses.terrain, kClasses.sidewalk};
  p.walkers = walkers;
  p.outer = 0.9 * half_width;
  p.drift = 0.5 * half_width;
  p.run = random.uniform(20, 60);
  return p;
}

/// Rows of parked cars on both sides of aisles.
Place parking(const Config& config, Random& random, bool roofed) {
  Place p;
  p.speed = p.parking_speed = 3;
  p.before = 40;
  const double length = 2 * p.before + travel(config, p.speed) + 60;
  p.street = folded(random, std::max(length, 300.0), 60, 90, kPi, 8.6, true);
  p.half_width = 8.5;
  p.ground = {random.uniform(0.002, 0.03), 180, 0.03, 0, kClasses.parking, kClasses.parking};
  if (roofed) {
    p.ground.hill_slope = 0.002;
    p.ground.roughness = 0.005;
  }
  p.lanes = {{-1.35, {0, 45, 3}}, {1.35, {0, 40, 3}}};
  p.maneuvers = 8;
  p.look[0].angle = p.look[1].angle = kPi / 2;
  p.look[0].parked = p.look[1].parked = random.uniform(0.5, 0.85);
  p.cover = roofed ? Cover::kLow : Cover::kBorder;
  p.height = 2.9;
  p.walkers = 0.1;
  p.inner = 2.7;
  p.outer = 3.2;
  p.run = 40;
  p.crossers = 5;
  p.reach = 3.5;
  return p;
}

Place place_of(const Config& config, Random& random) {
  switch (config.scene) {
    case Scene::kUrban:
    case Scene::kStatic: {
      Place p = town(config, random, 8.5, 0.006, 0.35);
      const double width = random.unit();
      p.half_width = width < 0.25 ? 3.9 : width < 0.7 ? 5.8 : 8.2;
      p.side_streets = 85;
      return p;
    }
    case Scene::kMixed:
      return mixed(config, random);
    case Scene::kHill: {
      Place p = town(config, random, 9, 0.012, 0.15);
      if (random.chance(0.5)) p.half_width = 3.9;
      p.ground = {random.uniform(0.055, 0.08), random.uniform(110, 220), 0.08};
      for (Frontage& look : p.look) look.buildings *= 0.6;
      p.trees = random.uniform(4, 15);
      p.bushes = random.uniform(5, 20);
      return p;
    }
    case Scene::kCanopy: {
      Place p = town(config, random, 6, 0.005, 0);
      for (Frontage& look : p.look) look.street_trees = 0.1;
      p.cover = Cover::kCrowns;
      p.walkers = 0.22;
      return p;
    }
    case Scene::kStopAndGo: {
      Place p = town(config, random, 8, 0.003, 0);
      p.half_width = 9.4;
      p.lanes = {{-1.75}, {-5.2}, {1.75, {0, 25, 8, 0.08, 0.05}}, {5.2, {0, 22, 6.4, 0.08, 0.08}}};
      if (random.chance(0.5)) std::swap(p.lanes[0], p.lanes[1]);
      p.queues = true;
      p.maneuvers = 8;
      return p;
    }
    case Scene::kHighway: {
      Place p;
      p.speed = 25;
      p.street = winding(random, 2 * p.before + travel(config, 25) + 30, 0.0022);
      const double inner = random.uniform(3.2, 4.8), outer = inner + 3.7;
      p.half_width = outer + 4.4;
      p.ground = {random.uniform(0.005, 0.025), 400, 0.1, 0};
      const Traffic::Flow slow{0, 65, 23, 0.35, 0.05}, fast{0, 65, 30, 0.02, 0.02};
      p.lanes = {{-outer, slow}, {-inner, fast}, {inner, fast}, {outer, slow}};
      if (random.chance(0.35)) std::swap(p.lanes[0], p.lanes[1]);
      p.lead = true;
      p.cover = Cover::kRails;
      p.plants_from = 4;
      p.trees = random.uniform(4, 14);
      p.bushes = random.uniform(6, 25);
      return p;
    }
    case Scene::kVegetation: {
      Place p = town(config, random, 6, 0.015, 0);
      p.half_width = 3.4;
      p.pavement = p.maneuvers = 0;
      p.ground = {random.uniform(0.01, 0.05), 90, 0.16, 0};
      p.lanes = {{-1.6, {0, 75, 6, 0.05, 0, 0.15}}, {1.6, {0, 60, 8, 0.05, 0, 0.2}}};
      p.look[0] = p.look[1] = {};
      p.cover = Cover::kHedges;
      p.plants_from = 1;
      p.trees = random.uniform(40, 80);
      p.bushes = random.uniform(50, 100);
      p.walkers = 0.05;
      p.inner = 2.7;
      p.outer = 3.2;
      p.crossers = 0;
      return p;
    }
    case Scene::kForest: {
      Place p = walk(config, random, 1.4, 60, 1.7, 0.12);
      p.street = winding(random, p.street.length(), 0.03);
      p.ground = {random.uniform(0.02, 0.08), 60, 0.18, 0, kClasses.terrain, kClasses.terrain};
      p.lanes = {{-0.4}, {0.5, {0, 35, 4, 0, 0, 1}}};
      p.plants_from = 0.6;
      p.plants_to = 35;
      p.trees = random.uniform(55, 90);
      p.bushes = random.uniform(60, 120);
      p.run = 90;
      p.drift = 0;
      return p;
    }
    case Scene::kCrowd: {
      Place p = walk(config, random, 1.2, 80, random.uniform(6, 11), 0.85);
      p.street = winding(random, p.street.length(), 0.008);
      const double side = random.uniform(-0.3, 0.3) * p.half_width;
      p.way = p.street.shifted(0, p.street.length(),
                               [side](double s) { return side + 0.6 * std::sin(s / 9); });
      const double beside = 0.4 * p.half_width;
      p.lanes = {{-beside, {0, 60, 3, 0, 0, 1}}, {beside, {0, 60, 3, 0, 0, 1}}};
      p.ground = {random.uniform(0.002, 0.02), 180, 0.04, 0};
      p.ground.street_label = kClasses.sidewalk;
      p.look[0].buildings = p.look[1].buildings = 0.95;
      p.things = 0.8;
      p.outer = p.half_width - 0.1;
      return p;
    }
    case Scene::kHall: {
      Place p = walk(config, random, 1.0, 15, random.uniform(9, 18), 0.9);
      p.way =
          p.street.shifted(0, p.street.length(), [](double s) { return 1.2 * std::sin(s / 7); });
      p.cover = Cover::kGlass;
      p.height = random.uniform(3.5, 7);
      p.things = 0.8;
      return p;
    }
    case Scene::kRoom: {
      const double u = random.unit(), v = random.unit();  // small rooms are more frequent
      const double length = 2.2 + 12.8 * u * u, half = 1.1 + 6.4 * v * v;
      Place p = walk(config, random, 0.5, 0, half, 0.04 * half + 0.3 / length);
      p.street = straight(length);
      p.way = rounds(length, half, travel(config, 0.5));
      p.cover = Cover::kLow;
      p.height = random.uniform(2.3, 3.2);
      p.things = 1;
      p.run = 0.6 * length;
      return p;
    }
    case Scene::kCorridor: {
      const double half = random.uniform(0.8, 1.6);
      Place p = walk(config, random, 1.0, 8, half, 0.05);
      p.street = folded(random, p.street.length() - 20, 9, 30, kPi / 2,
                        half + random.uniform(0.6, 1.2), false);
      p.cover = Cover::kTube;
      p.height = random.uniform(2.3, 3.2);
      p.inner = 0.2 * half;
      p.outer = 0.6 * half;
      p.run = 25;
      p.drift = 0;
      return p;
    }
    case Scene::kTunnel: {
      Place p;
      p.speed = 12;
      p.half_width = random.uniform(4.2, 5.5);
      p.street = winding(random, 2 * p.before + travel(config, p.speed) + 30,
                         random.uniform(0.0005, 0.004));
      p.ground = {random.uniform(0, 0.03), 200, 0.005, 0};
      p.lanes = {{-1.75, {0, 50, 12, 0.15, 0.05}}, {1.75, {0, 40, 12, 0.15, 0.05}}};
      p.cover = Cover::kTube;
      p.height = random.uniform(4.6, 7);
      return p;
    }
    case Scene::kCarPark:
    case Scene::kGarage:
      break;
  }
  return parking(config, random, config.scene == Scene::kGarage);
}

/// Straight streets across the main one, where that is straight.
std::vector<Crossing> add_side_streets(Random& random, std::vector<Street>& streets,
                                       double spacing) {
  std::vector<Crossing> crossings;
  const Route main = streets[0].centre;
  for (double s = random.uniform(25, 25 + spacing); s < main.length() - 30; s += 7) {
    if (std::abs(main.at(s + 22).heading - main.at(s - 22).heading) > 0.06) continue;
    const Waypoint middle = main.at(s);
    const double heading = middle.heading + kPi / 2 + random.uniform(-0.2, 0.2);
    std::vector<Vec2> points;
    // Not where it would meet the main street a second time, or another side street.
    bool meets = false;
    for (double d = -110; d <= 110; d += 2) {
      const Vec2 p = middle.position + d * direction(heading);
      points.push_back(p);
      for (const Street& street : streets) {
        const Vec2 near = street.centre.at(street.centre.nearest(p)).position;
        meets = meets || (std::abs(d) >= 25 && norm(near - p) < 16);
      }
    }
    if (meets) continue;
    crossings.push_back({s, streets.size()});
    streets.push_back({Route(std::move(points)), 4.0, 2.5});
    s += spacing * random.uniform(0.7, 1.4);
  }
  return crossings;
}

/// Bridges, and avenues whose crowns meet over the street, all along it.
void cover_street(Builder& builder, Random& random) {
  const Street& street = builder.street();
  const double half = street.half_width, verge = half + street.pavement;
  for (double s = random.uniform(10, 25); s < street.centre.length() - 25;) {
    const Waypoint at = street.centre.at(s);
    if (random.chance(0.5)) {
      const double width = random.uniform(4, 22), clearance = random.uniform(4.2, 5.2);
      builder.place_anyway(bridge_model(2 * verge + 0.6, width, clearance), at);
      for (const int side : {-1, 1}) {
        builder.traffic().fixed.add(
            {street.centre.beside(s, side * (verge + 6.3)).position, at.heading, width / 2, 6});
      }
      s += width + random.uniform(12, 30);
      continue;
    }
    for (auto pairs = 2 + random.index(4); pairs > 0; --pairs) {
      for (const int side : {-1, 1}) {
        const double along = s + random.uniform(-1, 1);
        const double crown = random.uniform(3.8, 5.5), high = random.uniform(8, 12);
        builder.tree(street.centre.beside(along, side * (half + 0.7)).position, high, crown,
                     random.uniform(3.6, 4.2));
      }
      s += random.uniform(7, 10);
    }
    s += random.uniform(3, 15);
  }
}

/// Rails, walls, bridges, signs and thin marker posts of a road.
void add_road_furniture(Builder& builder, Random& random) {
  const double edge = builder.street().half_width;
  for (const double lateral : {0.0, edge + 0.4, -edge - 0.4}) {
    builder.row(lateral, 8, [](Random& r) { return fence_model(Fence::kGuardRail, 8, 0.78, r); });
  }
  for (const int side : {-1, 1}) {
    builder.row(side * (edge + 1.2), 50, [](Random& r) {
      const bool sign = r.chance(0.3);
      return pole_model(sign ? r.uniform(2, 5) : 1.1, false, sign, r);
    });
    const double height = random.uniform(2.5, 4);
    if (!random.chance(0.15)) continue;
    builder.row(side * (edge + 3.5), 5,
                [height](Random& r) { return fence_model(Fence::kWood, 5, height, r); });
  }
  const Route& road = builder.street().centre;
  for (double s = random.uniform(60, 160); s < road.length() - 20; s += random.uniform(150, 320)) {
    builder.place_anyway(bridge_model(2 * edge + 4, random.uniform(0.5, 12), 5.5), road.at(s));
  }
}

/// Walls and a ceiling along the way; a corridor has frames of doors.
void enclose(Builder& builder, Random& random, double height) {
  const double half = builder.street().half_width, piece = half < 3 ? 1 : 4, l = piece / 2 + 0.05;
  const bool doors = half < 3 && random.chance(0.7);
  for (const double side : {1.0, -1.0}) {
    builder.row(side * half, piece, [&](Random& r) {
      Model model;
      model.block(kMaterials.wall, -l, l, std::min(0.0, 0.2 * side), std::max(0.0, 0.2 * side),
                  -0.2, height);
      const double depth = r.uniform(0.02, 0.08), y = -0.5 * depth * side;  // of frames
      for (const double x : {-0.45, 0.45}) {
        if (!doors || r.chance(0.7)) break;
        model.block(kMaterials.wood_fence, x - 0.04, x + 0.04, y - depth / 2, y + depth / 2, 0, 2);
      }
      return model;
    });
  }
  const Route& way = builder.street().centre;
  for (double s = piece / 2; s < way.length(); s += piece) {
    builder.place_anyway(slab_model(piece + 0.3, 2 * half + 0.4, height, height + 0.2), way.at(s));
  }
  for (const double end : {0.0, way.length()}) {
    const Waypoint at = way.at(end);
    builder.place_anyway(wall_model(2 * half, height), {at.position, at.heading + kPi / 2});
  }
}

/// Edges around the whole street, a ceiling, and columns beside the way of the sensor.
void surround(Builder& builder, Random& random, const Place& place) {
  const Route& street = builder.street().centre;
  const bool border = place.cover == Cover::kBorder, glass = place.cover == Cover::kGlass;
  const double half = place.half_width, margin = border ? half + random.uniform(2, 5) : half;
  // Straight places end where their street does, others beyond their turns.
  const bool is_straight = place.lanes.empty();
  Vec2 low{1e9, 1e9}, high{-1e9, -1e9};
  for (const Vec2 p : street.points()) {
    const double mx = is_straight ? 0 : margin;
    low = {std::min(low.x, p.x - mx), std::min(low.y, p.y - margin)};
    high = {std::max(high.x, p.x + mx), std::max(high.y, p.y + margin)};
  }
  const double borders[] = {high.y, high.x, low.y, low.x}, turns[] = {0, -kPi / 2, kPi, kPi / 2};
  for (std::size_t edge = 0; edge < 4; ++edge) {
    const bool along_x = edge % 2 == 0;
    const double begin = along_x ? low.x : low.y, length = (along_x ? high.x : high.y) - begin;
    const double pieces = std::ceil(length / 8), piece = length / pieces, kind = random.unit();
    for (double d = begin + piece / 2; d < begin + length; d += piece) {
      const Waypoint at{along_x ? Vec2{d, borders[edge]} : Vec2{borders[edge], d}, turns[edge]};
      const Fence fence = kind < 0.75 ? Fence::kWire : Fence::kPales;
      builder.place_anyway(!border ? glass && edge == 2 ? glass_front_model(piece, place.height)
                                                        : wall_model(piece + 0.2, place.height)
                           : kind < 0.3 ? building_model(piece, 10, random.uniform(5, 9), random)
                           : kind < 0.6 ? builder.hedge(piece, 0.8, 1.6, random)
                                        : fence_model(fence, piece, 1.6, random),
                           at);
      builder.traffic().fixed.add({at.position, at.heading, piece / 2, 0.02});
    }
  }
  if (border) return;
  const double z = place.height, panel = std::min(10.0, high.x - low.x + 0.4);
  for (double x = low.x - 0.2; x < high.x; x += panel) {
    for (double y = low.y - 0.2; y < high.y; y += panel) {
      const Waypoint middle{{x + panel / 2, y + panel / 2}, 0};
      builder.place_anyway(slab_model(panel, panel, z, z + 0.3), middle);
      if (panel >= 10) builder.place_anyway(slab_model(panel, 0.4, z - 0.4, z), middle);
    }
  }
  const double beside = glass ? 0.55 * half : half + 0.1;
  for (double s = 7.3; s < street.length() - 4 && half > 8; s += 7.8) {
    for (const double side : {-beside, beside}) {
      const Waypoint at = street.beside(s, side);
      builder.place(slab_model(0.5, 0.5, -0.2, z), {at.position, at.heading, 0.25, 0.25}, 0.02);
    }
  }
}

/// Furniture, cupboards and tables, and trees outdoors, on the area where people walk.
void furnish_inside(Builder& builder, Random& random, const Place& place) {
  const Street& street = builder.street();
  const bool room = street.half_width < 8 && place.cover == Cover::kLow;
  const double step = room ? 3 / street.half_width : 5.5, length = street.centre.length();
  const Route& way = builder.traffic().lanes[builder.traffic().drivers[0].lane].route;
  for (double s = 0.4; s < length - 0.4; s += step * random.uniform(0.5, 1.5)) {
    const double deep = random.uniform(0.15, 0.35), half = random.uniform(0.2, 0.8);
    const double lateral = room ? random.either_sign(1, 1) * (street.half_width - deep - 0.05)
                                : random.either_sign(0.3, 0.9) * street.half_width;
    const Waypoint at = street.centre.beside(s, lateral);
    const double kind = random.unit(), tall = random.uniform(0.4, 2.0);
    const Footprint thing{at.position, at.heading, room ? half : 0.8, deep};
    const double gap = distance(thing, way.at(way.nearest(at.position)).position);
    if (!random.chance(place.things) || gap < (room ? 0.4 : 1.6)) continue;
    if (place.cover == Cover::kNone && kind < 0.5) {
      builder.tree(at.position, random.uniform(5, 9), random.uniform(1.5, 2.8), 2.3);
    } else if (room) {
      const bool table = kind < 0.4 && tall < 1;
      Model model = slab_model(2 * half, 2 * deep, table ? tall - 0.04 : 0, tall);
      if (table) model.post(kMaterials.steel_pole, 0, 0, 0, tall, 0.025);
      if (s > half && s < length - half) builder.place(model, thing, 0.02);
    } else {
      builder.place(furniture_model(random), thing);
    }
  }
}

void add_cover(Builder& builder, Random& random, const Place& place) {
  switch (place.cover) {
    case Cover::kNone:
      return;
    case Cover::kCrowns:
      return cover_street(builder, random);
    case Cover::kRails:
      return add_road_furniture(builder, random);
    case Cover::kHedges:
      for (const double side : {-1.0, 1.0}) {
        if (!random.chance(0.5)) continue;
        builder.row(side * (place.half_width + 1.2), 6, [&builder](Random& r) {
          return r.chance(0.6) ? builder.hedge(6, 1.0, r.uniform(0.8, 2.2), r)
                               : fence_model(Fence::kWire, 6, 1.1, r);
        });
      }
      return;
    case Cover::kTube:
      return enclose(builder, random, place.height);
    case Cover::kBorder:
    case Cover::kLow:
    case Cover::kGlass:
      surround(builder, random, place);
  }
}

/// Lanes, the sensor, and all other vehicles.
void add_traffic(Builder& builder, Random& random, const Place& place,
                 const std::vector<Crossing>& crossings, double end) {
  Traffic& traffic = builder.traffic();
  builder.add_lights(crossings);
  std::vector<std::size_t> lanes;
  for (const Stream& stream : place.lanes) lanes.push_back(builder.main_lane(stream.lateral));
  const std::size_t way = place.way.length() > 0 ? traffic.add_lane(place.way)
                          : lanes.empty()        ? traffic.add_lane(place.street)
                                                 : lanes[0];
  builder.ego(way, place.before, place.speed, place.small);
  if (!builder.lively()) return;
  if (place.lead) {
    const std::size_t object = traffic.add_object(random.chance(0.8) ? Kind::kCar : Kind::kTruck);
    traffic.add_driver(object, way, place.before + random.uniform(1, 2) * (8 + place.speed),
                       traffic.drivers[0].cruise);
  }
  if (place.queues) traffic.drivers[0].speed = 0;
  for (std::size_t i = 0; i < lanes.size() && place.queues; ++i) {
    if (place.lanes[i].flow.spacing <= 0) builder.queue(lanes[i], place.speed);
  }
  builder.cross_traffic(crossings, place.speed);
  if (place.half_width > 5) {
    builder.maneuvers(place.before - 20, end,
                      builder.count(place.maneuvers * (end + 20 - place.before) / 100),
                      place.look[0].angle, place.parking_speed);
  }
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    Traffic::Flow flow = place.lanes[i].flow;
    flow.lane = lanes[i];
    if (flow.spacing > 0) builder.fill_lane(flow);
  }
}

}  // namespace

World build_scene(const Config& config) {
  Random random(mix(config.seed, 77));
  const Place place = place_of(config, random);
  std::vector<Street> streets{{place.street, place.half_width, place.pavement}};
  std::vector<Crossing> crossings;
  if (place.side_streets > 0) {
    crossings = add_side_streets(random, streets, place.side_streets);
  }
  Builder builder(config, place.ground, std::move(streets));
  const double length = place.street.length();
  const double end = std::min(place.before + travel(config, place.speed) + 40, length);
  add_traffic(builder, random, place, crossings, end);
  add_cover(builder, random, place);
  for (const std::size_t side : {0U, 1U}) {
    builder.furnish(builder.street(), side == 0 ? -1 : 1, place.look[side]);
    for (const Crossing& crossing : crossings) {
      builder.furnish(builder.street(crossing.street), side == 0 ? -1 : 1, place.look[side]);
    }
  }
  const double back = place.half_width + place.pavement;
  builder.plant(back + place.plants_from, back + place.plants_to, place.trees, place.bushes);
  if (place.things > 0) furnish_inside(builder, random, place);
  if (place.cover != Cover::kTube && place.cover != Cover::kGlass && !(length < 20)) {
    builder.clutter(config.clutter);
  }
  const double from = std::max(0.0, place.before - 40), to = std::min(end + 20, length);
  const bool on_pavement = place.outer <= 0;
  const double inner = on_pavement ? place.half_width + 1.2 : place.inner;
  const double outer = on_pavement ? back - 0.4 : place.outer;
  builder.stroll({from, to, builder.count(std::min(place.walkers * (to - from), 2000.0)), inner,
                  std::max(inner, outer), place.run, place.drift});
  builder.cross(from, to, builder.count(place.crossers),
                place.reach > 0 ? place.reach : place.half_width + 1.4);
  return builder.finish();
}

}  // namespace dynains::simulation
