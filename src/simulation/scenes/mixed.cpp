// A street whose every part is drawn from the seed.
#include <cmath>

#include "simulation/scenes/builder.hpp"
#include "simulation/scenes/scenes.hpp"

namespace dynains::simulation {
namespace {

constexpr double kUsualSpeed = 8;      // m/s, of a vehicle
constexpr double kCarriedSpeed = 1.2;  // m/s
constexpr double kLong = 20;           // s; longer recordings have vehicles that wait

TerrainConfig draw_ground(Random& random) {
  TerrainConfig ground;
  ground.hill_slope = random.chance(0.3) ? random.uniform(0.03, 0.09) : random.uniform(0, 0.03);
  ground.hill_length = random.uniform(50, 400);
  const double rough = random.unit();
  ground.roughness = 0.005 + 0.15 * rough * rough;
  ground.kerb = random.chance(0.2) ? 0 : random.uniform(0.03, 0.2);
  return ground;
}

Frontage draw_frontage(Random& random) {
  return {random.uniform(0.1, 1.0), random.uniform(0.2, 8),   random.uniform(4, 20),
          random.uniform(0, 0.8),   random.uniform(0.2, 0.9), random.uniform(0.3, 1),
          random.uniform(0, 1),     random.uniform(0.2, 0.9)};
}

/// Cars beside one another, at an angle to the street.
void park_angled(Builder& builder, Random& random, int side) {
  const Street& street = builder.street();
  const double angle = random.uniform(40, 90) * kPi / 180, occupied = random.uniform(0.4, 1);
  const double pitch = random.uniform(2.3, 2.8) / std::sin(angle);
  const bool nose_in = random.chance(0.6);
  for (double s = random.uniform(3, 8); s < street.centre.length() - 4; s += pitch) {
    const double deep = 2.4 * std::sin(angle) + 0.9 * std::cos(angle) + 0.15 * random.unit();
    const bool used = random.chance(occupied), odd = random.chance(0.1);
    Waypoint at = street.centre.beside(s, side * (street.half_width - deep));
    at.heading += (side > 0 ? angle : -angle) + (nose_in != odd ? 0 : kPi) + 0.04 * random.normal();
    const bool is_crossing = builder.is_near_crossing(street, at.position, 6);
    const Kind kind = builder.parked_kind();
    if (used && !is_crossing && kind != Kind::kTruck) builder.park(at, kind);
  }
}

/// Events of long recordings: deliveries and buses at stops against the way, which wait and go, and
/// parked cars that leave while the sensor is near.
void add_waiting(Builder& builder, Random random, const StreetLanes& lanes, double speed) {
  const Config& config = builder.config();
  const double seconds = config.scans / config.rate, way = travel(config, speed);
  if (seconds < kLong) return;
  Traffic& traffic = builder.traffic();
  const Street& street = builder.street();
  for (double s = random.uniform(20, 60); s < way + 40; s += random.uniform(60, 160)) {
    const Kind kind = random.chance(0.5) ? Kind::kVan : Kind::kBus;
    const double begin = random.uniform(0, 0.5 * seconds), wait = random.uniform(10, 40);
    const double place = street.centre.length() - kBefore - s;
    if (!builder.is_free_of_drivers(traffic.lanes[lanes.backward].route.at(place), 8)) continue;
    Traffic::Driver& driver =
        traffic.add_driver(traffic.add_object(kind), lanes.backward, place, kUsualSpeed);
    driver.speed = 0;
    driver.schedule = {{0, 0}, {begin + wait, kUsualSpeed}};
  }
  if (street.half_width < 5) return;
  for (double t = random.uniform(2, 15); t < seconds; t += random.uniform(5, 20)) {
    const int side = random.chance(0.5) ? 1 : -1;
    const double s = kBefore + speed * t + random.uniform(-20, 40);
    builder.leaving_car(s, side * (street.half_width - 1.12), side * kLaneHalf, t, 7);
  }
}

/// A vehicle that stays ahead, and traffic both ways.
void add_vehicles(Builder& builder, Random& random, const StreetLanes& lanes, double speed,
                  bool is_carried) {
  Traffic& traffic = builder.traffic();
  if (!is_carried && random.chance(0.4)) {
    const Kind kind = random.chance(0.8) ? Kind::kCar : Kind::kVan;
    traffic.add_driver(traffic.add_object(kind), lanes.forward, kBefore + random.uniform(9, 40),
                       traffic.drivers[0].cruise);
  }
  Traffic::Flow flow{lanes.forward, 0, speed};
  flow.trucks = random.uniform(0, 0.2);
  flow.buses = random.uniform(0, 0.1);
  flow.cyclists = random.uniform(0, 0.25);
  Traffic::Flow oncoming = flow;
  oncoming.lane = lanes.backward;
  flow.spacing = random.uniform(20, 80);
  oncoming.spacing = random.uniform(14, 70);
  oncoming.speed = speed * random.uniform(0.6, 1.4);
  builder.fill_lane(flow);
  builder.fill_lane(oncoming);
}

}  // namespace

World mixed(const Config& config, Random random) {
  const bool is_carried = config.gait != Gait::kVehicle;
  const double speed = is_carried ? kCarriedSpeed : kUsualSpeed, way = travel(config, speed);
  const double width = random.unit();
  const bool angled = width > 0.65;
  const double half_width = angled         ? random.uniform(8.6, 9.8)
                            : width < 0.25 ? random.uniform(3.4, 4.2)
                                           : random.uniform(5.6, 7.2);
  const double pavement = is_carried ? random.uniform(3, 6) : random.uniform(0.5, 5);
  const double gentle = random.uniform(0.001, 0.015), corners = random.uniform(0, 0.4);
  std::vector<Street> streets{
      {winding(random, 2 * kBefore + way + 30, gentle, corners), half_width, pavement}};
  std::vector<Crossing> crossings;
  if (random.chance(0.6)) {
    crossings = add_side_streets(random, streets, random.uniform(50, 140), 4.0);
  }
  const TerrainConfig ground = draw_ground(random);
  Builder builder(config, ground, std::move(streets));
  const Street& street = builder.street();
  const StreetLanes lanes{builder.lane(street, -kLaneHalf), builder.lane(street, kLaneHalf)};
  // On the street, or on the pavement if it is carried.
  const std::size_t mine =
      is_carried ? builder.lane(street, -(half_width + 0.6 * pavement)) : lanes.forward;
  builder.ego(mine, kBefore, speed, is_carried);
  const double end = kBefore + way + 40;
  Frontage look = draw_frontage(random);
  if (builder.lively()) {
    if (half_width > 5 && !angled) {
      builder.parking_moves(kBefore - 20, end, builder.count(random.uniform(0, 10)), 7);
    }
    add_waiting(builder, random.fork(41), lanes, config.ego_speed < 0 ? speed : config.ego_speed);
    add_vehicles(builder, random, lanes, kUsualSpeed * random.uniform(0.5, 1.4), is_carried);
  }
  for (const int side : {-1, 1}) {
    if (random.chance(0.4)) look = draw_frontage(random);
    if (angled && random.chance(0.75)) {
      park_angled(builder, random, side);
      look.parked = 0;
    }
    builder.furnish(street, side, look);
  }
  for (const Crossing& crossing : crossings) {
    for (const int side : {-1, 1}) builder.furnish(builder.street(crossing.street), side, look);
  }
  if (random.chance(0.4)) {
    const double trees = random.uniform(2, 40), bushes = random.uniform(4, 60);
    builder.plant(street, half_width + pavement + 1, 50, trees, bushes);
  }
  builder.pavement_walkers(kBefore - 40, end,
                           builder.count(random.uniform(0.02, 0.25) * (end - kBefore + 40)));
  builder.crossing_walkers(kBefore - 10, end, builder.count(random.uniform(0, 6)));
  return builder.finish();
}

}  // namespace dynains::simulation
