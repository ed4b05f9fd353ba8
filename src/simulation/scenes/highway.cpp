#include <algorithm>
#include <cmath>
#include <utility>

#include "simulation/materials.hpp"
#include "simulation/scenes/lanes.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {

namespace {

Model gantry_model(double edge) {
  Model gantry{
      make_primitive(Shape::kBox, materials::kSteelPole, {0, 0, 6.2F},
                     {0.15F, static_cast<float>(edge + 1), 0.15F}),
      make_primitive(Shape::kBox, materials::kSignPlate, {0.2F, -6, 6.6F}, {0.05F, 2.5F, 1.2F})};
  for (const float side : {-1.0F, 1.0F}) {
    gantry.push_back(make_primitive(Shape::kCylinder, materials::kSteelPole,
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

World highway(const Config& config) {
  const double speed = 25;
  Random random(mix(config.seed, 77));
  const double length = 2 * kBefore + travel(config, speed) + 30;
  const double median = random.uniform(0.9, 2.5), lane_width = 3.7;
  const double inner = median + 0.5 + lane_width / 2, outer = inner + lane_width;
  const double edge = outer + lane_width / 2 + 2.6;
  std::vector<Street> streets;
  streets.push_back({route_of_bends(winding(random, length, 0.0022, 0, 17)), edge, 0});
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
    fill_lane(builder, right, 70, 0.93 * speed, 0.35, 0.05, 0);
    fill_lane(builder, left, 65, 1.2 * speed, 0.02, 0.02, 0);
    fill_lane(builder, far_left, 65, 1.2 * speed, 0.02, 0.02, 0);
    fill_lane(builder, far_right, 60, 0.93 * speed, 0.35, 0.05, 0);
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
