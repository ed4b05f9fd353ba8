// Scenes along one street that a vehicle drives.
#include <algorithm>
#include <cmath>

#include "simulation/scenes/builder.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {
namespace {

/// Length of a street that the ego vehicle drives at this usual speed (m/s), with its surroundings.
double length_for(const Config& config, double speed) {
  return 2 * kBefore + travel(config, speed) + 30;
}

TerrainConfig ground_of(double hill_slope, double hill_length = 180, double roughness = 0.04,
                        double kerb = 0.12) {
  return {hill_slope, hill_length, roughness, kerb};
}

/// Traffic both ways on a street of a town; returns the end of its busy part (m).
double add_town_traffic(Builder& builder, const std::vector<Crossing>& crossings, double speed,
                        double parking_moves, Traffic::Flow forward, Traffic::Flow backward) {
  const StreetLanes lanes = builder.two_way(crossings, speed);
  const double end = kBefore + travel(builder.config(), speed) + 40;
  if (builder.street().half_width > 5) {
    builder.parking_moves(kBefore - 20, end, builder.count(parking_moves), std::min(speed, 7.0));
  }
  forward.lane = lanes.forward;
  backward.lane = lanes.backward;
  builder.fill_lane(forward);
  builder.fill_lane(backward);
  return end;
}

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
    const double half = traffic.objects[object].size.length / 2;
    s += half;
    traffic.add_driver(object, lane, s, cruise).speed = 0;
    s += half + random.uniform(1.8, 3.5);
    if (i == 0) s += 0.5;
  }
  Traffic::Driver& head = traffic.drivers.back();
  head.schedule = {{0, 0}};
  for (double t = random.uniform(1, 4); t < end; t += random.uniform(3, 6)) {
    head.schedule.push_back({t, random.uniform(5, 9)});
    t += random.uniform(4, 9);
    head.schedule.push_back({t, 0});
  }
}

/// Vehicles behind the ego vehicle, or behind the head of the queue beside it.
void add_queue_behind(Traffic& traffic, Random& random, std::size_t lane, bool ego_lane,
                      double cruise) {
  double behind = kBefore - (ego_lane ? 2.2 : 6.0);
  for (int i = 0; i < 4; ++i) {
    const std::size_t object = traffic.add_object(random.chance(0.8) ? Kind::kCar : Kind::kVan);
    const double half = traffic.objects[object].size.length / 2;
    behind -= half + random.uniform(2, 4);
    traffic.add_driver(object, lane, behind, cruise).speed = 0;
    behind -= half;
  }
}

/// Bridges, roofs and avenues, whose crowns meet over the street, all along it.
void cover_street(Builder& builder, Random& random) {
  const Street& street = builder.street();
  const double half = street.half_width, verge = half + street.pavement;
  for (double s = random.uniform(10, 25); s < street.centre.length() - 25;) {
    const Waypoint at = street.centre.at(s);
    const double kind = random.unit();
    if (kind < 0.35) {
      const double width = random.uniform(8, 22), clearance = random.uniform(4.3, 5.2);
      builder.place_anyway(bridge_model(2 * verge + 0.6, width, clearance), at);
      for (const int side : {-1, 1}) {
        builder.traffic().fixed.add(
            {street.centre.beside(s, side * (verge + 6.3)).position, at.heading, width / 2, 6});
      }
      s += width + random.uniform(15, 35);
    } else if (kind < 0.6) {
      const double run = random.uniform(10, 24), height = random.uniform(4.2, 5);
      builder.place_anyway(shelter_model(run, 2 * (half + 1.2), height), at);
      for (double x = -run / 2; x < run / 2; x += 0.8) {
        for (const int side : {-1, 1}) {
          const Vec2 post = street.centre.beside(s + x, side * (half + 1.0)).position;
          builder.traffic().fixed.add({post, at.heading, 0.4, 0.15});
        }
      }
      s += run + random.uniform(8, 25);
    } else {
      const int pairs = static_cast<int>(2 + random.index(4));
      for (int i = 0; i < pairs; ++i) {
        for (const int side : {-1, 1}) {
          const double along = s + random.uniform(-1, 1);
          const Vec2 p = street.centre.beside(along, side * (half + 0.7)).position;
          const double radius = random.uniform(3.8, 5.5), high = random.uniform(8, 12);
          builder.tree(p, high, radius, random.uniform(3.6, 4.2));
        }
        s += random.uniform(7, 10);
      }
      s += random.uniform(3, 15);
    }
  }
  // Arcades over the pavements.
  for (double s = random.uniform(5, 40); s < street.centre.length() - 20;
       s += random.uniform(30, 70)) {
    const int side = random.chance(0.5) ? 1 : -1;
    const double run = random.uniform(8, 16), height = random.uniform(2.6, 3.2);
    const Waypoint at = street.centre.beside(s, side * (verge - 0.6));
    builder.place_anyway(shelter_model(run, 2.4, height), at);
    const Vec2 ahead = direction(at.heading);
    for (double x = -run / 2 + 0.3; x <= run / 2; x += std::max(3.0, run / 4)) {
      for (const double y : {-1.0, 1.0}) {
        builder.traffic().fixed.add(
            {at.position + x * ahead + y * left_of(ahead), at.heading, 0.12, 0.12});
      }
    }
  }
}

/// Rails, walls, gantries, bridges and marker posts of a road whose outer border is `edge` (m).
void add_road_furniture(Builder& builder, Random& random, double edge) {
  const Route& road = builder.street().centre;
  for (const double lateral : {0.0, edge + 0.4, -edge - 0.4}) {
    builder.barrier(lateral, 8, [](Random&) { return guard_rail_model(8); });
  }
  for (const int side : {-1, 1}) {
    if (!random.chance(0.3)) continue;
    const double height = random.uniform(2.5, 4);
    builder.barrier(side * (edge + 3.5), 5,
                    [height](Random&) { return fence_model(5, height, false); });
  }
  for (double s = random.uniform(60, 160); s < road.length() - 20; s += random.uniform(150, 320)) {
    const bool bridge = random.chance(0.4);
    builder.place_anyway(bridge ? bridge_model(2 * edge + 4, 10, 5.5) : gantry_model(edge),
                         road.at(s));
  }
  const double trees = random.uniform(4, 14), bushes = random.uniform(6, 25);
  builder.plant(builder.street(), edge + 4.5, edge + 45, trees, bushes);
  for (double s = random.uniform(5, 20); s < road.length(); s += 50) {
    Random model_random = random.fork(random.bits());
    for (const int side : {-1, 1}) {
      builder.place_anyway(pole_model(1.1, false, false, model_random),
                           road.beside(s, side * (edge + 1.2)));
    }
  }
}

}  // namespace

World urban(const Config& config, Random random) {
  const double speed = 8.5, width = random.unit();
  const double half_width = width < 0.25 ? 3.9 : width < 0.7 ? 5.8 : 8.2;
  std::vector<Street> streets{{winding(random, length_for(config, speed), 0.006, 0.35), half_width,
                               random.uniform(2.4, 4.0)}};
  const auto crossings = add_side_streets(random, streets, 85, 4.0);
  Builder builder(config, ground_of(random.uniform(0.005, 0.03)), std::move(streets));
  const double end =
      add_town_traffic(builder, crossings, speed, 8, {0, 38, speed, 0.08, 0.05, 0.06},
                       {0, 30, speed, 0.08, 0.05, 0.06});
  Frontage look;
  look.buildings = random.uniform(0.55, 0.95);
  look.street_trees = random.uniform(0.2, 0.7);
  look.parked = random.uniform(0.35, 0.85);
  look.height = random.uniform(7, 16);
  look.setback = random.uniform(0.2, 5);
  for (std::size_t i = 0; i < builder.terrain().streets().size(); ++i) {
    if (i == 1) look.buildings *= 0.8;
    builder.furnish(builder.street(i), look);
  }
  const double from = kBefore - 50, to = end + 30;
  builder.pavement_walkers(from, to, builder.count(0.16 * (to - from)));
  builder.crossing_walkers(from, to, builder.count(5));
  return builder.finish();
}

World hill(const Config& config, Random random) {
  const double speed = 9;
  std::vector<Street> streets{{winding(random, length_for(config, speed), 0.012, 0.15, 20),
                               random.chance(0.5) ? 5.8 : 3.9, 2.2}};
  const double slope = random.uniform(0.055, 0.08), length = random.uniform(110, 220);
  Builder builder(config, ground_of(slope, length, 0.08), std::move(streets));
  const double end = add_town_traffic(builder, {}, speed, 4, {0, 40, speed, 0.1, 0.05, 0.05},
                                      {0, 32, speed, 0.1, 0.05, 0.05});
  Frontage look;
  look.buildings = random.uniform(0.3, 0.65);
  look.height = 7;
  look.setback = 5;
  look.street_trees = 0.25;
  look.parked = random.uniform(0.2, 0.6);
  const Street& street = builder.street();
  for (const int side : {-1, 1}) builder.furnish(street, side, look);
  const double trees = random.uniform(4, 15), bushes = random.uniform(5, 20);
  builder.plant(street, street.half_width + street.pavement + 1, 50, trees, bushes);
  builder.pavement_walkers(kBefore - 40, end + 20, builder.count(20));
  builder.crossing_walkers(kBefore, end, builder.count(3));
  return builder.finish();
}

World canopy(const Config& config, Random random) {
  const double speed = 6;
  std::vector<Street> streets{{winding(random, length_for(config, speed), 0.005), 5.8, 3.4}};
  Builder builder(config, ground_of(random.uniform(0.002, 0.015)), std::move(streets));
  const double end = add_town_traffic(builder, {}, speed, 5, {0, 30, speed, 0.1, 0.05, 0.06},
                                      {0, 24, 1.2 * speed, 0.1, 0.05, 0.06});
  cover_street(builder, random);
  Frontage look;
  look.buildings = 0.7;
  look.street_trees = 0.1;
  look.parked = 0.5;
  for (const int side : {-1, 1}) builder.furnish(builder.street(), side, look);
  builder.pavement_walkers(kBefore - 40, end + 20, builder.count(0.22 * (end - kBefore + 60)));
  builder.crossing_walkers(kBefore - 10, end, builder.count(4));
  return builder.finish();
}

World vegetation(const Config& config, Random random) {
  const double speed = 6;
  std::vector<Street> streets{{winding(random, length_for(config, speed), 0.015), 3.4, 0}};
  Builder builder(config, ground_of(random.uniform(0.01, 0.05), 90, 0.16, 0), std::move(streets));
  const std::size_t forward = builder.lane(builder.street(), -1.6);
  const std::size_t backward = builder.lane(builder.street(), 1.6);
  builder.ego(forward, kBefore, speed);
  builder.fill_lane({forward, 75, speed, 0.05, 0, 0.15});
  builder.fill_lane({backward, 60, 1.3 * speed, 0.05, 0, 0.2});
  const double trees = random.uniform(40, 80), bushes = random.uniform(50, 100);
  builder.plant(builder.street(), 4.4, 45, trees, bushes);
  for (const int side : {-1, 1}) {
    if (!random.chance(0.4)) continue;
    builder.barrier(side * 4.6, 6, [&builder](Random& r) {
      return r.chance(0.6) ? builder.hedge(6, 1.0, r.uniform(0.8, 2.2), r)
                           : fence_model(6, 1.1, true);
    });
  }
  for (int i = 0; i < builder.count(8); ++i) {
    const double s = kBefore + random.uniform(-30, 90), pace = random.uniform(1, 1.8);
    const double lateral = random.either_sign(2.7, 3.2), run = random.chance(0.5) ? 40 : -40;
    const double start = random.chance(0.2) ? random.uniform(2, 8) : 0;
    builder.walker(builder.way_along(s, run, 2, lateral), pace, {start});
  }
  return builder.finish();
}

World stop_and_go(const Config& config, Random random) {
  const double speed = 8;
  std::vector<Street> streets{{winding(random, length_for(config, speed), 0.003), 9.4, 3.2}};
  Builder builder(config, ground_of(random.uniform(0.005, 0.03)), std::move(streets));
  Traffic& traffic = builder.traffic();
  std::size_t lanes[4];
  const double laterals[] = {-1.75, -5.2, 1.75, 5.2};
  for (std::size_t i = 0; i < 4; ++i) lanes[i] = builder.lane(builder.street(), laterals[i]);
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
      builder.leaving_car(s, side * 8.28, side * 5.2, start, 7);
    }
    builder.fill_lane({lanes[2], 25, speed, 0.08, 0.05});
    builder.fill_lane({lanes[3], 22, 0.8 * speed, 0.08, 0.08, 0.05});
  }
  Frontage look;
  look.buildings = random.uniform(0.6, 0.95);
  look.parked = random.uniform(0.4, 0.8);
  look.height = random.uniform(8, 18);
  for (const int side : {-1, 1}) builder.furnish(builder.street(), side, look);
  builder.pavement_walkers(kBefore - 40, kBefore + 90, builder.count(22));
  builder.crossing_walkers(kBefore - 20, kBefore + 60, builder.count(3));
  return builder.finish();
}

World highway(const Config& config, Random random) {
  const double speed = 25, lane_width = 3.7;
  const double inner = random.uniform(0.9, 2.5) + 0.5 + lane_width / 2, outer = inner + lane_width;
  const double edge = outer + lane_width / 2 + 2.6;
  std::vector<Street> streets{{winding(random, length_for(config, speed), 0.0022), edge, 0}};
  Builder builder(config, ground_of(random.uniform(0.005, 0.025), 400, 0.1, 0), std::move(streets));
  Traffic& traffic = builder.traffic();
  std::size_t lanes[4];
  const double laterals[] = {-outer, -inner, inner, outer};
  for (std::size_t i = 0; i < 4; ++i) lanes[i] = builder.lane(builder.street(), laterals[i]);
  const std::size_t mine = lanes[random.chance(0.65) ? 0 : 1];
  builder.ego(mine, kBefore, speed);
  if (builder.lively()) {
    const auto lead = traffic.add_object(random.chance(0.3) ? Kind::kTruck : Kind::kCar);
    traffic.add_driver(lead, mine, kBefore + random.uniform(32, 48), traffic.drivers[0].cruise);
    builder.fill_lane({lanes[0], 70, 0.93 * speed, 0.35, 0.05});
    builder.fill_lane({lanes[1], 65, 1.2 * speed, 0.02, 0.02});
    builder.fill_lane({lanes[2], 65, 1.2 * speed, 0.02, 0.02});
    builder.fill_lane({lanes[3], 60, 0.93 * speed, 0.35, 0.05});
  }
  add_road_furniture(builder, random, edge);
  return builder.finish();
}

}  // namespace dynains::simulation
