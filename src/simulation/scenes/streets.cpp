// Scenes along one street that a vehicle drives.
#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {
namespace {

/// Vehicles ahead of the ego vehicle on one lane; the head waits, goes and waits again.
void add_queue_ahead(Traffic& traffic, Random& random, std::size_t lane, bool ego_lane,
                     double cruise, double end) {
  const auto ahead = static_cast<int>(3 + random.index(4));
  double s = kBefore + (ego_lane ? 9 : random.uniform(-4, 4));
  for (int i = 0; i < ahead; ++i) {
    const double kind = random.unit();
    const std::size_t object = traffic.add_object(kind < 0.75  ? Kind::kCar
                                                  : kind < 0.9 ? Kind::kVan
                                                               : Kind::kTruck);
    s += traffic.objects[object].size.length / 2;
    traffic.add_driver(object, lane, s, cruise).speed = 0;
    s += traffic.objects[object].size.length / 2 + random.uniform(1.8, 3.5);
    if (i == 0) s += 0.5;
  }
  Traffic::Driver& head = traffic.drivers.back();
  double t = random.uniform(1, 4);
  head.schedule = {{0, 0}};
  while (t < end) {
    head.schedule.push_back({t, random.uniform(5, 9)});
    t += random.uniform(4, 9);
    head.schedule.push_back({t, 0});
    t += random.uniform(3, 6);
  }
}

/// Vehicles behind the ego vehicle, or behind the head of the queue beside it.
void add_queue_behind(Traffic& traffic, Random& random, std::size_t lane, bool ego_lane,
                      double cruise) {
  double behind = kBefore - (ego_lane ? 2.2 : 6.0);
  for (int i = 0; i < 4; ++i) {
    const std::size_t object = traffic.add_object(random.chance(0.8) ? Kind::kCar : Kind::kVan);
    behind -= traffic.objects[object].size.length / 2 + random.uniform(2, 4);
    traffic.add_driver(object, lane, behind, cruise).speed = 0;
    behind -= traffic.objects[object].size.length / 2;
  }
}

/// A bridge over the street; returns its width along the street (m).
double add_bridge(Builder& builder, Random& random, const Street& street, double s) {
  const double verge = street.half_width + street.pavement;
  const Waypoint at = street.centre.at(s);
  const double width = random.uniform(8, 22), clearance = random.uniform(4.3, 5.2);
  builder.place_anyway(bridge_model(2 * verge + 0.6, width, clearance), at);
  for (const int side : {-1, 1}) {
    builder.traffic().fixed.add(
        {street.centre.beside(s, side * (verge + 6.3)).position, at.heading, width / 2, 6});
  }
  return width;
}

/// A roof over the street; returns its length along the street (m).
double add_roof(Builder& builder, Random& random, const Street& street, double s) {
  const double half = street.half_width;
  const Waypoint at = street.centre.at(s);
  const double run = random.uniform(10, 24), height = random.uniform(4.2, 5);
  builder.place_anyway(shelter_model(run, 2 * (half + 1.2), height), at);
  for (double x = -run / 2; x < run / 2; x += 0.8) {
    for (const int side : {-1, 1}) {
      builder.traffic().fixed.add(
          {street.centre.beside(s + x, side * (half + 1.0)).position, at.heading, 0.4, 0.15});
    }
  }
  return run;
}

/// Pairs of trees whose crowns meet over the street, from arc length `s` (m) on; returns their end.
double add_avenue(Builder& builder, Random& random, const Street& street, double s) {
  const int pairs = static_cast<int>(2 + random.index(4));
  for (int i = 0; i < pairs; ++i) {
    for (const int side : {-1, 1}) {
      const Vec2 p =
          street.centre.beside(s + random.uniform(-1, 1), side * (street.half_width + 0.7))
              .position;
      const double radius = random.uniform(3.8, 5.5), high = random.uniform(8, 12);
      builder.tree(p, high, radius, random.uniform(3.6, 4.2));
    }
    s += random.uniform(7, 10);
  }
  return s;
}

/// Bridges, roofs and avenues all along the street.
void cover_street(Builder& builder, Random& random, const Street& street) {
  for (double s = random.uniform(10, 25); s < street.centre.length() - 25;) {
    const double kind = random.unit();
    if (kind < 0.35) {
      const double width = add_bridge(builder, random, street, s);
      s += width + random.uniform(15, 35);
    } else if (kind < 0.6) {
      const double run = add_roof(builder, random, street, s);
      s += run + random.uniform(8, 25);
    } else {
      s = add_avenue(builder, random, street, s);
      s += random.uniform(3, 15);
    }
  }
}

/// Arcades over the pavements.
void add_arcades(Builder& builder, Random& random, const Street& street) {
  const double verge = street.half_width + street.pavement;
  for (double s = random.uniform(5, 40); s < street.centre.length() - 20;
       s += random.uniform(30, 70)) {
    const int side = random.chance(0.5) ? 1 : -1;
    const double run = random.uniform(8, 16), height = random.uniform(2.6, 3.2);
    const Waypoint at = street.centre.beside(s, side * (verge - 0.6));
    builder.place_anyway(shelter_model(run, 2.4, height), at);
    for (double x = -run / 2 + 0.3; x <= run / 2; x += std::max(3.0, run / 4)) {
      for (const double y : {-1.0, 1.0}) {
        builder.traffic().fixed.add(
            {at.position + x * direction(at.heading) + y * left_of(direction(at.heading)),
             at.heading, 0.12, 0.12});
      }
    }
  }
}

Model gantry_model(double edge) {
  Model gantry{
      make_primitive(Shape::kBox, kMaterials.steel_pole, {0, 0, 6.2F},
                     {0.15F, static_cast<float>(edge + 1), 0.15F}),
      make_primitive(Shape::kBox, kMaterials.sign_plate, {0.2F, -6, 6.6F}, {0.05F, 2.5F, 1.2F})};
  for (const float side : {-1.0F, 1.0F}) {
    gantry.push_back(make_primitive(Shape::kCylinder, kMaterials.steel_pole,
                                    {0, side * static_cast<float>(edge + 1), 3},
                                    {0.15F, 0.15F, 3.3F}));
  }
  return gantry;
}

/// Gantries and bridges over both carriageways; `edge` (m) is their outer border.
void add_overpasses(Builder& builder, Random& random, const Street& street, double edge) {
  for (double s = random.uniform(60, 160); s < street.centre.length() - 20;
       s += random.uniform(150, 320)) {
    if (random.chance(0.4)) {
      builder.place_anyway(bridge_model(2 * edge + 4, 10, 5.5), street.centre.at(s));
    } else {
      builder.place_anyway(gantry_model(edge), street.centre.at(s));
    }
  }
}

}  // namespace

World urban(const Config& config, Random random) {
  const double speed = 8.5;
  const double length = 2 * kBefore + travel(config, speed) + 30;
  const double width = random.unit();
  const double half_width = width < 0.25 ? 3.9 : width < 0.7 ? 5.8 : 8.2;
  std::vector<Street> streets{
      {winding(random, length, 0.006, 0.35), half_width, random.uniform(2.4, 4.0)}};
  const auto crossings = add_side_streets(random, streets, 85, 4.0);
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.005, 0.03);
  Builder builder(config, ground, std::move(streets));

  const StreetLanes lanes = add_crossing_traffic(builder, crossings, speed, kBefore);
  const double end = kBefore + travel(config, speed) + 40;
  if (builder.lively()) {
    if (half_width > 5) add_parking_moves(builder, kBefore - 20, end, builder.count(8), 7);
    fill_lane(builder, {lanes.forward, 38, speed, 0.08, 0.05, 0.06});
    fill_lane(builder, {lanes.backward, 30, speed, 0.08, 0.05, 0.06});
  }
  Frontage look;
  look.buildings = random.uniform(0.55, 0.95);
  look.street_trees = random.uniform(0.2, 0.7);
  look.parked = random.uniform(0.35, 0.85);
  look.height = random.uniform(7, 16);
  look.setback = random.uniform(0.2, 5);
  for (std::size_t i = 0; i < builder.terrain().streets().size(); ++i) {
    Frontage side = look;
    side.buildings = i == 0 ? look.buildings : 0.8 * look.buildings;
    builder.furnish(builder.street(i), 1, side);
    builder.furnish(builder.street(i), -1, side);
  }
  const double walk_from = kBefore - 50, walk_to = end + 30;
  builder.pavement_walkers(builder.street(0), walk_from, walk_to,
                           builder.count(0.16 * (walk_to - walk_from)));
  builder.crossing_walkers(builder.street(0), walk_from, walk_to, builder.count(5));
  return builder.finish();
}

World hill(const Config& config, Random random) {
  const double speed = 9;
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets{
      {winding(random, length, 0.012, 0.15, 20), random.chance(0.5) ? 5.8 : 3.9, 2.2}};
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.055, 0.08);
  ground.hill_length = random.uniform(110, 220);
  ground.roughness = 0.08;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const StreetLanes lanes = add_crossing_traffic(builder, {}, speed, kBefore);
  const double end = kBefore + travel(config, speed) + 40;
  if (builder.lively()) {
    if (street.half_width > 5) add_parking_moves(builder, kBefore - 20, end, builder.count(4), 7);
    fill_lane(builder, {lanes.forward, 40, speed, 0.1, 0.05, 0.05});
    fill_lane(builder, {lanes.backward, 32, speed, 0.1, 0.05, 0.05});
  }
  Frontage look;
  look.buildings = random.uniform(0.3, 0.65);
  look.height = 7;
  look.setback = 5;
  look.street_trees = 0.25;
  look.parked = random.uniform(0.2, 0.6);
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  const double trees = random.uniform(4, 15), bushes = random.uniform(5, 20);
  builder.plant(street, street.half_width + street.pavement + 1, 50, trees, bushes);
  builder.pavement_walkers(street, kBefore - 40, end + 20, builder.count(20));
  builder.crossing_walkers(street, kBefore, end, builder.count(3));
  return builder.finish();
}

World vegetation(const Config& config, Random random) {
  const double speed = 6;
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets{{winding(random, length, 0.015, 0), 3.4, 0}};
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.01, 0.05);
  ground.hill_length = 90;
  ground.roughness = 0.16;
  ground.kerb = 0;
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const std::size_t forward = builder.lane(street, -1.6), backward = builder.lane(street, 1.6);
  builder.ego(forward, kBefore, speed);
  fill_lane(builder, {forward, 75, speed, 0.05, 0, 0.15});
  fill_lane(builder, {backward, 60, 1.3 * speed, 0.05, 0, 0.2});
  const double trees = random.uniform(40, 80), bushes = random.uniform(50, 100);
  builder.plant(street, 4.4, 45, trees, bushes);
  for (const int side : {-1, 1}) {
    if (!random.chance(0.4)) continue;
    add_barrier(builder, street, side * 4.6, 6, [&builder](Random& r) {
      return r.chance(0.6) ? builder.hedge(6, 1.0, r.uniform(0.8, 2.2), r)
                           : fence_model(6, 1.1, true);
    });
  }
  for (int i = 0; i < builder.count(8); ++i) {
    const double s = kBefore + random.uniform(-30, 90), pace = random.uniform(1, 1.8);
    const double lateral = random.either_sign(2.7, 3.2);
    const double run = random.chance(0.5) ? 40 : -40;
    const double start = random.chance(0.2) ? random.uniform(2, 8) : 0;
    builder.walker({street.centre.beside(s, lateral).position,
                    street.centre.beside(s + run / 2, lateral).position,
                    street.centre.beside(s + run, lateral).position},
                   pace, start);
  }
  return builder.finish();
}

World stop_and_go(const Config& config, Random random) {
  const double speed = 8;
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets{{winding(random, length, 0.003, 0), 9.4, 3.2}};
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.005, 0.03);
  Builder builder(config, ground, std::move(streets));
  Traffic& traffic = builder.traffic();
  const Street& street = builder.street(0);
  const double inner = -1.75, outer = -5.2;
  const std::size_t lanes[] = {builder.lane(street, inner), builder.lane(street, outer)};
  const std::size_t back_inner = builder.lane(street, -inner);
  const std::size_t back_outer = builder.lane(street, -outer);
  const std::size_t mine = random.index(2);
  builder.ego(lanes[mine], kBefore, speed);
  if (builder.lively()) {
    traffic.drivers[0].speed = 0;
    const double end = config.scans / config.rate + 5;
    for (std::size_t lane = 0; lane < 2; ++lane) {
      add_queue_ahead(traffic, random, lanes[lane], lane == mine, speed, end);
      add_queue_behind(traffic, random, lanes[lane], lane == mine, speed);
    }
    for (int i = 0; i < builder.count(9); ++i) {
      const int side = random.chance(0.5) ? 1 : -1;
      const double s = kBefore + random.uniform(-25, 80), start = random.uniform(1, 10);
      builder.leaving_car(street, s, side * 8.28, side * 5.2, start, 7);
    }
    fill_lane(builder, {back_inner, 25, speed, 0.08, 0.05});
    fill_lane(builder, {back_outer, 22, 0.8 * speed, 0.08, 0.08, 0.05});
  }
  Frontage look;
  look.buildings = random.uniform(0.6, 0.95);
  look.parked = random.uniform(0.4, 0.8);
  look.height = random.uniform(8, 18);
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  builder.pavement_walkers(street, kBefore - 40, kBefore + 90, builder.count(22));
  builder.crossing_walkers(street, kBefore - 20, kBefore + 60, builder.count(3));
  return builder.finish();
}

World canopy(const Config& config, Random random) {
  const double speed = 6;
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets{{winding(random, length, 0.005, 0), 5.8, 3.4}};
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.002, 0.015);
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street(0);
  const StreetLanes lanes = add_crossing_traffic(builder, {}, speed, kBefore);
  const double end = kBefore + travel(config, speed) + 40;
  if (builder.lively()) {
    add_parking_moves(builder, kBefore - 20, end, builder.count(5), 6);
    fill_lane(builder, {lanes.forward, 30, speed, 0.1, 0.05, 0.06});
    fill_lane(builder, {lanes.backward, 24, 1.2 * speed, 0.1, 0.05, 0.06});
  }
  cover_street(builder, random, street);
  add_arcades(builder, random, street);
  Frontage look;
  look.buildings = 0.7;
  look.street_trees = 0.1;
  look.parked = 0.5;
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  builder.pavement_walkers(street, kBefore - 40, end + 20,
                           builder.count(0.22 * (end - kBefore + 60)));
  builder.crossing_walkers(street, kBefore - 10, end, builder.count(4));
  return builder.finish();
}

World highway(const Config& config, Random random) {
  const double speed = 25;
  const double length = 2 * kBefore + travel(config, speed) + 30;
  const double median = random.uniform(0.9, 2.5), lane_width = 3.7;
  const double inner = median + 0.5 + lane_width / 2, outer = inner + lane_width;
  const double edge = outer + lane_width / 2 + 2.6;
  std::vector<Street> streets{{winding(random, length, 0.0022, 0), edge, 0}};
  TerrainConfig ground;
  ground.hill_slope = random.uniform(0.005, 0.025);
  ground.hill_length = 400;
  ground.kerb = 0;
  ground.roughness = 0.1;
  Builder builder(config, ground, std::move(streets));
  Traffic& traffic = builder.traffic();
  const Street& street = builder.street(0);

  const std::size_t right = builder.lane(street, -outer), left = builder.lane(street, -inner);
  const std::size_t far_left = builder.lane(street, inner), far_right = builder.lane(street, outer);
  const bool ego_right = random.chance(0.65);
  builder.ego(ego_right ? right : left, kBefore, speed);
  if (builder.lively()) {
    const double cruise = traffic.drivers[0].cruise;
    const auto lead_kind = random.chance(0.3) ? Kind::kTruck : Kind::kCar;
    const std::size_t lead = traffic.add_object(lead_kind);
    traffic.add_driver(lead, ego_right ? right : left, kBefore + random.uniform(32, 48), cruise);
    fill_lane(builder, {right, 70, 0.93 * speed, 0.35, 0.05});
    fill_lane(builder, {left, 65, 1.2 * speed, 0.02, 0.02});
    fill_lane(builder, {far_left, 65, 1.2 * speed, 0.02, 0.02});
    fill_lane(builder, {far_right, 60, 0.93 * speed, 0.35, 0.05});
  }
  auto rail = [](Random&) { return guard_rail_model(8); };
  add_barrier(builder, street, 0, 8, rail);
  add_barrier(builder, street, edge + 0.4, 8, rail);
  add_barrier(builder, street, -edge - 0.4, 8, rail);
  for (const int side : {-1, 1}) {
    if (random.chance(0.3)) {
      const double wall_height = random.uniform(2.5, 4);
      add_barrier(builder, street, side * (edge + 3.5), 5,
                  [wall_height](Random&) { return fence_model(5, wall_height, false); });
    }
  }
  add_overpasses(builder, random, street, edge);
  const double trees = random.uniform(4, 14), bushes = random.uniform(6, 25);
  builder.plant(street, edge + 4.5, edge + 45, trees, bushes);
  for (double s = random.uniform(5, 20); s < street.centre.length(); s += 50) {
    Random model_random = random.fork(random.bits());
    for (const int side : {-1, 1}) {
      const Waypoint at = street.centre.beside(s, side * (edge + 1.2));
      builder.place_anyway(pole_model(1.1, false, false, model_random), at);
    }
  }
  return builder.finish();
}

}  // namespace dynains::simulation
