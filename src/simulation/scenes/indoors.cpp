// Scenes between walls and below a ceiling.
#include <algorithm>
#include <cmath>

#include "simulation/scenes/builder.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {
namespace {

constexpr double kPanel = 8.0;  // m, of walls and of the ceiling

/// The hall extends along x from 0, and to both sides of y = 0.
struct Hall {
  double length, half_width, height;  // m
};

/// Ceiling with beams, end walls, a side wall, and a glass front on the other side.
void build_shell(Builder& builder, const Hall& hall) {
  for (double x = kPanel / 2; x < hall.length; x += kPanel) {
    for (double y = -hall.half_width; y < hall.half_width; y += kPanel) {
      builder.place_anyway(slab_model(kPanel, kPanel, hall.height, hall.height + 0.3),
                           {{x, y + kPanel / 2}, 0});
    }
    builder.place_anyway(slab_model(0.3, 2 * hall.half_width, hall.height - 0.6, hall.height),
                         {{x, 0}, 0});
    builder.place_anyway(wall_model(kPanel, hall.height), {{x, hall.half_width}, 0});
    builder.place_anyway(glass_front_model(kPanel, hall.height), {{x, -hall.half_width}, kPi});
  }
  for (double y = -hall.half_width + kPanel / 2; y < hall.half_width; y += kPanel) {
    builder.place_anyway(wall_model(kPanel, hall.height), {{0, y}, kPi / 2});
    builder.place_anyway(wall_model(kPanel, hall.height), {{hall.length, y}, -kPi / 2});
  }
}

/// Columns, stalls and furniture beside the way of the sensor.
void furnish(Builder& builder, Random& random, const Hall& hall) {
  for (double x = 8; x < hall.length - 4; x += 8) {
    for (const double side : {-0.55, 0.55}) {
      builder.place(column_model(0.6, hall.height), {{x, side * hall.half_width}, 0, 0.3, 0.3});
    }
  }
  for (double x = 4; x < hall.length - 4; x += random.uniform(3, 6)) {
    const double y = random.either_sign(0.3, 0.95) * hall.half_width;
    Random model_random = random.fork(random.bits());
    const double heading = random.uniform(-0.2, 0.2), kind = random.unit();
    if (std::abs(y) < 2.5) continue;
    if (kind < 0.5) {
      const double length = model_random.uniform(2, 4), depth = model_random.uniform(1.5, 2.5);
      builder.place(stall_model(length, depth, model_random),
                    {{x, y}, heading, length / 2, depth / 2});
    } else {
      builder.place(furniture_model(model_random), {{x, y}, heading, 0.8, 0.35});
    }
  }
}

/// People who walk from place to place, or stand at stalls for some time; passers-by outside, seen
/// through the glass.
void add_people(Builder& builder, Random& random, const Hall& hall, double from, double to) {
  const int people = builder.count(std::min(0.9 * (to - from), 1000.0));
  for (int i = 0; i < people; ++i) {
    std::vector<Vec2> goals{
        {random.uniform(from, to), random.uniform(-0.9, 0.9) * hall.half_width}};
    for (int step = 0; step < 4; ++step) {
      const double x = std::clamp(goals.back().x + random.either_sign(4, 20), 2.0, hall.length - 2);
      goals.push_back({x, random.uniform(-0.9, 0.9) * hall.half_width});
    }
    const double pace = random.uniform(0.6, 1.5), mood = random.unit();
    const double when = random.uniform(2, 12);
    builder.walker(std::move(goals), pace, pause_of(mood, 0.15, 0.3, 0.85, when));
  }
  for (int i = 0; i < builder.count(8); ++i) {
    const double x = random.uniform(from, to), y = -hall.half_width - random.uniform(1.5, 4);
    const double run = random.either_sign(20, 60);
    builder.walker({{x, y}, {x + run / 2, y}, {x + run, y}}, random.uniform(1.0, 1.7));
  }
}

TerrainConfig indoor_ground() {
  TerrainConfig ground{0.0005, 180, 0.003, 0};
  ground.street_label = semantic::kSidewalk;
  return ground;
}

/// Rounds on an ellipse in the middle of a room, as long as the sensor drives; at least one.
Route rounds(const Hall& room, double length) {
  const double a = 0.2 * room.length, b = 0.4 * room.half_width;
  std::vector<Vec2> points;
  double way = 0;
  for (double turn = 0; turn < 2 * kPi || way < length + 1; turn += 0.2) {
    points.push_back({0.5 * room.length + a * std::cos(turn), b * std::sin(turn)});
    way += 0.2 * std::min(a, b);
  }
  return Route(std::move(points));
}

/// Cupboards, tables, shelves and boxes along the walls of a room.
void furnish_room(Builder& builder, Random& random, const Hall& room) {
  const double area = 2 * room.half_width * room.length;
  for (int i = 0; i < 2 + static_cast<int>(area / 8); ++i) {
    const double length = random.uniform(0.4, 1.6), depth = random.uniform(0.3, 0.7);
    const double height = random.chance(0.5) ? random.uniform(0.4, 1.0) : random.uniform(1.2, 2.0);
    const bool table = height < 1 && random.chance(0.5);
    const double x = random.uniform(length / 2, room.length - length / 2);
    const double side = random.chance(0.5) ? 1 : -1;
    const Footprint place{
        {x, side * (room.half_width - depth / 2 - 0.05)}, 0, length / 2, depth / 2};
    const Vec2 near = {0.5 * room.length, 0};
    if (distance(place, near) < 0.45 * room.half_width + 0.35) continue;
    Model model = slab_model(length, depth, table ? height - 0.04 : 0, height);
    for (const double leg : {-0.45, 0.45}) {
      if (table) model.post(kMaterials.steel_pole, leg * length, 0, 0, height, 0.025);
    }
    builder.place(model, place, 0.02);
  }
}

/// Walls and ceiling along street 0, and doors on the walls of a corridor.
void enclose(Builder& builder, double height, double piece, bool doors) {
  const double half = builder.street().half_width, l = piece / 2 + 0.05;
  for (const double side : {1.0, -1.0}) {
    builder.barrier(side * half, piece, [&](Random& r) {
      Model model;
      model.block(kMaterials.wall, -l, l, std::min(0.0, 0.2 * side), std::max(0.0, 0.2 * side),
                  -0.2, height);
      if (!doors || !r.chance(0.3)) return model;
      const double depth = r.uniform(0.02, 0.08);  // of frames, m
      for (const double x : {-0.45, 0.45}) {
        const double y = -0.5 * depth * side;
        model.block(kMaterials.wood_fence, x - 0.04, x + 0.04, y - depth / 2, y + depth / 2, 0, 2);
      }
      return model;
    });
  }
  const Route& way = builder.street().centre;
  for (double s = piece / 2; s < way.length(); s += piece) {
    builder.place_anyway(slab_model(piece + 0.3, 2 * half + 0.4, height, height + 0.2), way.at(s));
  }
  // The ends are closed.
  for (const double end : {0.0, way.length()}) {
    const Waypoint at = way.at(end);
    builder.place_anyway(wall_model(2 * half, height), {at.position, at.heading + kPi / 2});
  }
}

}  // namespace

World hall(const Config& config, Random random) {
  const double speed = 1.0, drive = travel(config, speed), start = 15;
  const Hall hall{2 * start + drive + 20, random.uniform(9, 18), random.uniform(3.5, 7)};
  Builder builder(config, indoor_ground(), {{straight_route(hall.length), hall.half_width, 0}});
  const std::size_t way = builder.traffic().add_lane(builder.street().centre.shifted(
      0, hall.length, [](double s) { return 1.2 * std::sin(s / 7); }));
  builder.ego(way, start, speed);
  builder.traffic().objects[0].size = {0.8, 0.6, 0.9};
  build_shell(builder, hall);
  furnish(builder, random, hall);
  add_people(builder, random, hall, start - 12, start + drive + 20);
  return builder.finish();
}

World room(const Config& config, Random random) {
  const double speed = 0.5, drive = travel(config, speed);
  const double u = random.unit(), v = random.unit();  // small rooms are more frequent
  const Hall room{2.2 + 12.8 * u * u, 1.1 + 6.4 * v * v, random.uniform(2.3, 3.2)};
  Builder builder(config, indoor_ground(), {{straight_route(room.length), room.half_width, 0}});
  builder.ego(builder.traffic().add_lane(rounds(room, drive)), 0, speed, true);
  const double l = room.length, w = room.half_width, h = room.height;
  const Waypoint walls[] = {
      {{l / 2, w}, 0}, {{l / 2, -w}, kPi}, {{0, 0}, kPi / 2}, {{l, 0}, -kPi / 2}};
  for (std::size_t i = 0; i < 4; ++i) {
    builder.place_anyway(wall_model((i < 2 ? l : 2 * w) + 0.4, h), walls[i]);
    builder.traffic().fixed.add({walls[i].position, walls[i].heading, i < 2 ? l / 2 : w, 0.02});
  }
  builder.place_anyway(slab_model(l + 0.4, 2 * w + 0.4, h, h + 0.2), {{l / 2, 0}, 0});
  furnish_room(builder, random, room);
  for (int i = 0; i < builder.count(0.04 * l * w + 0.3); ++i) {
    std::vector<Vec2> goals(3);
    for (Vec2& goal : goals) goal = {random.uniform(0.15, 0.85) * l, random.uniform(-0.7, 0.7) * w};
    const double pace = random.uniform(0.4, 1.1), mood = random.unit();
    builder.walker(std::move(goals), pace, pause_of(mood, 0.2, 0.4, 0.8, random.uniform(1, 8)));
  }
  return builder.finish();
}

World corridor(const Config& config, Random random) {
  const double speed = 1.0, drive = travel(config, speed), start = 8;
  const double half = random.uniform(0.8, 1.6), height = random.uniform(2.3, 3.2);
  std::vector<Bend> bends{{start + random.uniform(4, 20), 0}};
  double length = bends[0].length;
  for (int turn = random.chance(0.5) ? 1 : -1; length < 2 * start + drive; turn = -turn) {
    const double radius = half + random.uniform(0.6, 1.2);
    bends.push_back({kPi / 2 * radius, turn / radius});
    bends.push_back({random.uniform(5, 30), 0});
    length += bends[bends.size() - 2].length + bends.back().length;
  }
  Builder builder(config, indoor_ground(), {{route_of_bends(bends, 0.25, 1), half, 0}});
  builder.ego(builder.traffic().add_lane(builder.street().centre), start, speed, true);
  enclose(builder, height, 1.0, random.chance(0.7));
  for (int i = 0; i < builder.count(2 + drive / 8); ++i) {
    const double s = random.uniform(start + 3, start + drive + 15);
    const double run = random.either_sign(5, 25), lateral = random.either_sign(0.2, 0.5) * half;
    const double pace = random.uniform(0.6, 1.5), mood = random.unit();
    builder.walker(builder.way_along(s, run, 12, lateral), pace,
                   pause_of(mood, 0.1, 0.3, 0.85, random.uniform(1, 8)));
  }
  return builder.finish();
}

World tunnel(const Config& config, Random random) {
  const double speed = 12, length = 2 * kBefore + travel(config, speed) + 30;
  const double height = random.uniform(4.6, 7), half = random.uniform(4.2, 5.5);
  TerrainConfig ground{random.uniform(0, 0.03), 200, 0.005, 0};
  std::vector<Street> streets{{winding(random, length, random.uniform(0.0005, 0.004)), half, 0}};
  Builder builder(config, ground, std::move(streets));
  const std::size_t forward = builder.lane(builder.street(), -kLaneHalf);
  const std::size_t backward = builder.lane(builder.street(), kLaneHalf);
  builder.ego(forward, kBefore, speed);
  builder.fill_lane({forward, 50, speed, 0.15, 0.05});
  builder.fill_lane({backward, 40, speed, 0.15, 0.05});
  enclose(builder, height, 4.0, false);
  return builder.finish();
}

}  // namespace dynains::simulation
