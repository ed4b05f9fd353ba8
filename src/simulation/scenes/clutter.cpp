#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "simulation/scenes/builder.hpp"

namespace dynains::simulation {
namespace {

/// Puts things beside one side of a street, out of the way of vehicles and of the sensor.
class Kerbside {
 public:
  Kerbside(Builder& builder, Random random) : builder_(builder), random_(random) {
    const Traffic& traffic = builder.traffic();
    way_ = &traffic.lanes[traffic.drivers[0].lane].route;
  }

  void add_thing(double s, int side) {
    const double beyond = std::max(street_.pavement, 1.5) + 1.5;
    const double lateral = side * (street_.half_width + random_.uniform(0.15, beyond));
    const double kind = random_.unit();
    Waypoint at = street_.centre.beside(s, lateral);
    if (kind < 0.2) {
      at.heading += kPi / 2 * random_.uniform(0, 4);
      put(sign_model(random_), at, 0.1, 0.3);
    } else if (kind < 0.45) {
      add_bicycles(at);
    } else if (kind < 0.8) {
      const bool railing = kind < 0.65;
      const double length = railing ? random_.uniform(2, 8) : random_.uniform(2, 6);
      const double height = railing ? random_.uniform(0.6, 1.2) : random_.uniform(0.7, 1.6);
      put(railing ? railing_model(length, height, random_) : paling_model(length, height, random_),
          at, length / 2, 0.06);
    } else if (kind < 0.9) {
      at.heading += random_.uniform(0, 2 * kPi);
      put(trolley_model(random_), at, 0.55, 0.3);
    } else {
      put(furniture_model(random_), at, 0.8, 0.35);
    }
  }

  /// Poles with wires between them.
  void add_line(double from, double to, int side) {
    const double lateral = side * (street_.half_width + 0.4), height = random_.uniform(5.5, 8);
    const double span = random_.uniform(18, 35);
    const auto wires = static_cast<int>(1 + random_.index(3));
    for (double s = from; s + span < to; s += span) {
      const Vec2 a = street_.centre.beside(s, lateral).position;
      const Vec2 b = street_.centre.beside(s + span, lateral).position, along = b - a;
      const Waypoint middle{0.5 * (a + b), std::atan2(along.y, along.x)};
      put(pole_model(height + 0.3, false, false, random_), {a, middle.heading}, 0.15, 0.15);
      for (int i = 0; i < wires; ++i) {
        builder_.place_anyway(wire_model(norm(along), height - 0.4 * i, random_), middle);
      }
    }
  }

  /// Somebody who takes a few steps to and fro.
  void add_loiterer(double s, int side) {
    const double lateral = side * (street_.half_width + random_.uniform(-0.3, 2.0));
    const Vec2 from = street_.centre.beside(s, lateral).position;
    const double run = random_.uniform(1.2, 3), heading = random_.uniform(0, 2 * kPi);
    const double pace = random_.uniform(0.25, 0.8), start = random_.uniform(0, 6);
    const double stop = start + random_.uniform(1, 12);
    builder_.walker({from, from + run * direction(heading)}, pace, {start, stop});
  }

  /// Two to five people abreast and behind one another, now and then with a pram.
  void add_group(double s, int side) {
    const double room = std::max(street_.pavement, 1.5);
    const double lateral = side * (street_.half_width + random_.uniform(0.3, room));
    const double run = random_.either_sign(20, 60), pace = random_.uniform(0.7, 1.5);
    const bool pram = random_.chance(0.5);
    const auto people = static_cast<int>(2 + random_.index(4));
    for (int i = 0; i < people; ++i) {
      const int row = i / 2;
      const double beside = 0.6 * (i % 2), behind = 0.8 * row;
      std::vector<Vec2> goals;
      for (int step = 0; step <= 3; ++step) {
        goals.push_back(
            street_.centre.beside(s + run * step / 3 + behind, lateral + side * beside).position);
      }
      if (!builder_.walker(std::move(goals), pace) || !pram || i > 0) continue;
      builder_.traffic().objects.back().pushes_pram = true;
    }
  }

  /// Doors of cars that are parked along the first `way` (m), opened within `seconds`.
  void add_doors(double way, double seconds, int doors) {
    Traffic& traffic = builder_.traffic();
    const Vec2 start = way_->at(traffic.drivers[0].s + 0.5 * way).position;
    std::vector<ObjectPose> cars;
    for (const ObjectPose& pose : traffic.parked) {
      const bool is_car = traffic.objects[pose.object].kind == Kind::kCar;
      if (is_car && norm(pose.at.position - start) < 0.5 * way + 20) cars.push_back(pose);
    }
    for (int i = 0; i < doors && !cars.empty(); ++i) {
      const ObjectPose car = cars[random_.index(cars.size())];
      const Size size = traffic.objects[car.object].size;
      const int side = random_.chance(0.5) ? 1 : -1;
      const double open = random_.uniform(0.2, seconds), pause = random_.uniform(2, 12);
      const Vec2 ahead = direction(car.at.heading);
      const Vec2 hinge = car.at.position + (0.2 * size.length) * ahead +
                         (side * (0.5 * size.width + 0.02)) * left_of(ahead);
      const std::size_t object = traffic.add_object(Kind::kCar, {1.05, 0.08, size.height});
      traffic.objects[object].model = door_model(size.height);
      traffic.doors.push_back({object, {hinge, car.at.heading}, side, open, open + pause});
    }
  }

 private:
  void add_bicycles(const Waypoint& at) {
    const auto bicycles = static_cast<int>(1 + random_.index(6));
    const double turn = random_.chance(0.7) ? kPi / 2 : 0;
    const double pitch = turn > 0 ? random_.uniform(0.45, 0.8) : 1.9;
    for (int i = 0; i < bicycles; ++i) {
      const Waypoint place{at.position + (pitch * i) * direction(at.heading),
                           at.heading + turn + 0.1 * random_.normal()};
      put(bicycle_model(), place, 0.85, 0.2);
    }
  }

  void put(const Model& model, const Waypoint& at, double half_length, double half_width) {
    const Footprint place{at.position, at.heading, half_length, half_width};
    const Vec2 way = way_->at(way_->nearest(at.position)).position;
    const bool in_the_way = distance(place, way) < 1.2;
    if (!in_the_way && builder_.clearance(place) >= 0.05) builder_.place(model, place, 0.02);
  }

  Builder& builder_;
  Random random_;
  const Street& street_ = builder_.street();
  const Route* way_;
};

}  // namespace

void add_clutter(Builder& builder, double amount) {
  Random random = builder.random().fork(31);
  Kerbside kerbside(builder, random.fork(1));
  const double length = builder.street().centre.length();
  for (const int side : {-1, 1}) {
    for (double s = random.uniform(1, 8); s < length; s += random.uniform(2, 9) / amount) {
      kerbside.add_thing(s, side);
    }
    if (random.chance(0.35 * amount)) kerbside.add_line(random.uniform(0, 20), length, side);
  }
  const double start = builder.traffic().drivers[0].s;
  const auto along_the_way = [&](int number, void (Kerbside::*add)(double, int)) {
    for (int i = 0; i < number; ++i) {
      const double s = start + random.uniform(-20, 90);
      (kerbside.*add)(s, random.chance(0.5) ? 1 : -1);
    }
  };
  along_the_way(builder.count(10 * amount), &Kerbside::add_loiterer);
  const double seconds = builder.config().scans / builder.config().rate;
  kerbside.add_doors(30 + travel(builder.config(), 8), seconds, builder.count(4 * amount));
  along_the_way(builder.count(5 * amount), &Kerbside::add_group);
}

}  // namespace dynains::simulation
