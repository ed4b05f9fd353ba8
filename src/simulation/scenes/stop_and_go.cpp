#include <algorithm>
#include <cmath>
#include <utility>

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

}  // namespace

World stop_and_go(const Config& config) {
  const double speed = 8;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.003, 0, 17)), 9.4, 3.2});
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
    fill_lane(builder, back_inner, 25, speed, 0.08, 0.05, 0);
    fill_lane(builder, back_outer, 22, 0.8 * speed, 0.08, 0.08, 0.05);
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

}  // namespace dynains::simulation
