#include "simulation/scenes/lanes.hpp"

#include <algorithm>
#include <utility>

namespace dynains::simulation {

namespace {

/// A stream that turns from the side street into the main street at arc length `crossing_s` (m).
void add_turning_car(Builder& builder, const Street& side, double crossing_s, std::size_t signal,
                     double speed) {
  Traffic& traffic = builder.traffic();
  Random& random = builder.random();
  const Street& main = builder.street(0);
  const double middle = side.centre.length() / 2;
  const bool from_left = random.chance(0.5);
  const Waypoint stop =
      side.centre.beside(middle + (from_left ? main.half_width + 3 : -main.half_width - 3),
                         from_left ? kLaneHalf : -kLaneHalf);
  Waypoint before = stop;
  if (from_left) before.heading += kPi;
  const double s_exit = crossing_s + (random.chance(0.5) ? 14.0 : -14.0);
  const bool exit_forward = s_exit > crossing_s;
  Waypoint after = main.centre.beside(s_exit, exit_forward ? -kLaneHalf : kLaneHalf);
  if (!exit_forward) after.heading += kPi;
  std::vector<Vec2> points;
  const double run = 60;
  for (double d = -run; d < -1; d += 1.5) {
    points.push_back(before.position + d * direction(before.heading));
  }
  for (const Vec2 p : turn_points(before, after)) points.push_back(p);
  for (double d = 1.5; d < 70; d += 1.5) {
    const double s = s_exit + (exit_forward ? d : -d);
    if (s < 1 || s > main.centre.length() - 1) break;
    points.push_back(main.centre.beside(s, exit_forward ? -kLaneHalf : kLaneHalf).position);
  }
  const std::size_t turning =
      traffic.add_lane(Route(std::move(points)), {StopLine{run, signal, 1}});
  const std::size_t object = traffic.add_object(Kind::kCar);
  const double s = random.uniform(8, run - 8);
  if (builder.is_free_of_drivers(traffic.lanes[turning].route.at(s), 5)) {
    traffic.add_driver(object, turning, s, speed * 0.7).yields = true;
  } else {
    traffic.objects.pop_back();
  }
}

}  // namespace

StreetLanes add_crossing_traffic(Builder& builder, const std::vector<Crossing>& crossings,
                                 double speed, double ego_s) {
  Traffic& traffic = builder.traffic();
  Random& random = builder.random();
  const Street& main = builder.street(0);
  const double main_length = main.centre.length();
  std::vector<StopLine> forward, backward;
  for (const Crossing& crossing : crossings) {
    const double period = random.uniform(26, 44), phase = random.uniform(0, 44);
    traffic.signals.push_back({period, phase});
    const std::size_t signal = traffic.signals.size() - 1;
    const double margin = builder.street(crossing.street).half_width + 3;
    forward.push_back({crossing.main_s - margin, signal, 0});
    backward.push_back({main_length - crossing.main_s - margin, signal, 0});
  }
  if (!builder.lively()) forward.clear();
  const StreetLanes lanes{builder.lane(main, -kLaneHalf, forward),
                          builder.lane(main, kLaneHalf, backward)};
  builder.ego(lanes.forward, ego_s, speed);
  builder.main_lines[0] = forward;
  builder.main_lines[1] = backward;
  for (std::size_t i = 0; i < crossings.size() && builder.lively(); ++i) {
    const Street& side = builder.street(crossings[i].street);
    const double middle = side.centre.length() / 2;
    const std::vector<StopLine> lines{{middle - main.half_width - 3, i, 1}};
    for (const double lateral : {-kLaneHalf, kLaneHalf}) {
      const std::size_t lane = builder.lane(side, lateral, lines);
      fill_lane(builder, {lane, random.uniform(30, 60), speed * 0.8, 0.05, 0.05, 0.1});
    }
    add_turning_car(builder, side, crossings[i].main_s, i, speed);
  }
  return lanes;
}

void make_robot(Traffic& traffic) {
  traffic.objects[0].size = {0.8, 0.6, 0.9};
  traffic.drivers[0].rest_gap = 0.3;
  traffic.drivers[0].foresight = 0.2;
}

void fill_lane(Builder& builder, Traffic::Flow flow) {
  if (!builder.lively()) return;
  flow.spacing /= std::max(builder.config().traffic, 1e-3);
  builder.traffic().fill(flow);
}

void add_parking_moves(Builder& builder, double from, double to, int number, double speed) {
  Random& random = builder.random();
  const Street& main = builder.street(0);
  for (int i = 0; i < number; ++i) {
    const int side = random.chance(0.5) ? 1 : -1;
    const double s = random.uniform(from, to), start = random.uniform(1, 9);
    const double place = side * (main.half_width - 1.12);
    if (builder.terrain().distance_to_street(main.centre.beside(s, place).position) < -2) continue;
    if (random.chance(0.65)) {
      builder.leaving_car(main, s, place, side * kLaneHalf, start, speed);
    } else {
      const double run = random.uniform(30, 60);
      builder.arriving_car(main, side < 0 ? s - run : s + run, s, place, side * kLaneHalf, speed);
    }
  }
}

void add_barrier(Builder& builder, const Street& street, double lateral, double piece,
                 const std::function<Model(Random&)>& model) {
  for (double s = piece / 2; s < street.centre.length() - piece / 2; s += piece) {
    Random random = builder.random().fork(builder.random().bits());
    const Waypoint at = street.centre.beside(s, lateral);
    builder.traffic().fixed.add({at.position, at.heading, piece / 2, 0.1});
    builder.place_anyway(model(random), at);
  }
}

}  // namespace dynains::simulation
