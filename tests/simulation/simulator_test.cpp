#include "io/fingerprint.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"

namespace dynains::simulation {

using test::class_of;
using test::drive_of;
using test::is_moving;
using test::point_of;

namespace {

/// Fingerprint of the points, labels and pose that `simulate` writes for a scan.
std::uint64_t hash_of(const SimulatedScan& scan) {
  Fingerprint hash;
  hash.add(scan.xyzi.data(), scan.xyzi.size() * sizeof(float));
  hash.add(scan.labels.data(), scan.labels.size() * sizeof(std::uint32_t));
  hash.add(scan.T_world_sensor_noisy.matrix().data(), 16 * sizeof(double));
  return hash.value();
}

}  // namespace

TEST_CASE("one configuration gives equal bits, in any order of scans") {
  const Config config = drive_of(Scene::kUrban, Sensor::kVlp16, 4, 3);
  Simulator a(config), b(config);
  const std::uint64_t third = hash_of(b.scan(2));
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::uint64_t hash = hash_of(a.scan(i));
    CHECK(hash == hash_of(b.scan(i)));
    if (i == 2) CHECK(hash == third);
  }
  Config other = config;
  other.seed = 4;
  CHECK(hash_of(Simulator(other).scan(0)) != hash_of(a.scan(0)));
}

TEST_CASE(
    "with a rolling shutter, the points of a scan have increasing times and own sensor poses") {
  Config config = test::exact_drive_of(Scene::kHighway, Sensor::kVlp16, 2, 3);
  config.rolling_shutter = true;
  Simulator simulator(config);
  REQUIRE(simulator.size() == 2);
  const SimulatedScan scan = simulator.scan(0);
  const SimulatedScan last = simulator.scan(1);
  CHECK(hash_of(last) == hash_of(Simulator(config).scan(1)));
  REQUIRE(scan.times.size() == scan.labels.size());
  CHECK(std::is_sorted(scan.times.begin(), scan.times.end()));
  CHECK(scan.times.front() > 0.0F);
  CHECK(scan.times.front() < 0.005F);
  CHECK(scan.times.back() < 0.1F);
  CHECK(scan.times.back() > 0.095F);
  CHECK(last.times.size() == last.labels.size());

  config.rolling_shutter = false;
  const SimulatedScan still = Simulator(config).scan(0);
  CHECK(still.times.empty());
  CHECK(still.T_world_sensor.isApprox(scan.T_world_sensor, 0.0));
  const Eigen::Vector3d way = last.T_world_sensor.translation() - scan.T_world_sensor.translation();
  CHECK(way.norm() > 2.0);
}

TEST_CASE("every scene and every sensor gives points") {
  const auto scenes = value_names(Scene());
  const auto sensors = value_names(Sensor());
  for (std::size_t number = 0; number < scenes.size(); ++number) {
    const std::size_t scene = number % scenes.size();
    const std::size_t sensor = number % sensors.size();
    INFO(scenes[scene] << ' ' << sensors[sensor]);
    Simulator simulator(drive_of(static_cast<Scene>(scene), static_cast<Sensor>(sensor), 1, 5));
    const SimulatedScan scan = simulator.scan(0);
    // Most beams of the dome end in the sky.
    CHECK(scan.labels.size() > (static_cast<Sensor>(sensor) == Sensor::kMid360 ? 2000 : 5000));
    CHECK(scan.xyzi.size() == 4 * scan.labels.size());
    std::size_t bad = 0;
    for (std::size_t i = 0; i < scan.labels.size(); ++i) {
      const double range = point_of(scan, i).norm();
      const float intensity = scan.xyzi[4 * i + 3];
      bad += !(range > 0.29 && range < 150.1 && intensity >= 0 && intensity <= 1);
      bad += class_of(scan.labels[i]) == 0;
    }
    CHECK(bad == 0);
  }
}

TEST_CASE("instant labels are moving above half a metre per second") {
  for (const Scene scene : {Scene::kUrban, Scene::kStopAndGo, Scene::kCrowd}) {
    Config config = drive_of(scene, Sensor::kVlp16, 40, 2);
    config.labelling = Labelling::kInstant;
    Simulator simulator(config);
    std::size_t moving = 0, standing = 0;
    for (std::size_t i = 0; i < simulator.size(); i += 5) {
      const SimulatedScan scan = simulator.scan(i);
      std::map<std::uint32_t, const ObjectState*> states;
      for (const ObjectState& state : scan.objects) states[state.instance] = &state;
      for (const std::uint32_t label : scan.labels) {
        if (label >> 16 == 0) {
          CHECK_FALSE(is_moving(label));
          continue;
        }
        const ObjectState& state = *states.at(label >> 16);
        CHECK_FALSE(is_moving(label) != (state.speed > 0.5));
        ++(is_moving(label) ? moving : standing);
      }
    }
    CHECK(moving > 100);
    CHECK(standing > 100);
  }
}

TEST_CASE("ever labels never change, and are moving if the object moves at any time") {
  Config config = drive_of(Scene::kStopAndGo, Sensor::kVlp16, 80, 6);
  Simulator ever(config);
  config.labelling = Labelling::kInstant;
  Simulator instant(config);
  std::map<std::uint32_t, std::uint32_t> label_of;
  std::map<std::uint32_t, Eigen::Vector3d> first_seen;
  std::set<std::uint32_t> fast, far;
  bool stood_and_moved = false;
  for (std::size_t i = 0; i < ever.size(); ++i) {
    for (const ObjectState& state : ever.scan(i).objects) {
      const auto inserted = label_of.emplace(state.instance, state.label);
      CHECK(inserted.first->second == state.label);
      const Eigen::Vector3d place = state.T_world_object.translation();
      const Eigen::Vector3d way = place - first_seen.emplace(state.instance, place).first->second;
      if (state.speed > 0.5) fast.insert(state.instance);
      if (way.head<2>().norm() > 0.5) far.insert(state.instance);
    }
  }
  bool crept = false;
  for (const auto& [instance, label] : label_of) {
    CHECK(is_moving(label) == (fast.count(instance) + far.count(instance) > 0));
    crept = crept || (fast.count(instance) == 0 && far.count(instance) > 0);
  }
  CHECK(crept);
  for (const ObjectState& state : instant.scan(0).objects) {
    stood_and_moved = stood_and_moved || (!is_moving(state.label) && fast.count(state.instance));
  }
  CHECK(stood_and_moved);
}

TEST_CASE("movers have their stated speed") {
  Simulator simulator(drive_of(Scene::kUrban, Sensor::kVlp16, 20, 7));
  std::size_t compared = 0;
  std::map<std::uint32_t, ObjectState> last;
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    for (const ObjectState& state : simulator.scan(i).objects) {
      const auto found = last.find(state.instance);
      if (found != last.end()) {
        const Eigen::Vector3d step =
            state.T_world_object.translation() - found->second.T_world_object.translation();
        const double speed = 0.5 * (state.speed + found->second.speed);
        CHECK(step.head<2>().norm() / 0.1 == Approx(speed).margin(0.8));
        compared += speed > 1;
      }
      last[state.instance] = state;
    }
  }
  CHECK(compared > 50);
}

TEST_CASE("nothing moves in the static scene") {
  Simulator simulator(drive_of(Scene::kStatic, Sensor::kVlp16, 20, 2));
  bool parked = false;
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    const SimulatedScan scan = simulator.scan(i);
    for (const std::uint32_t label : scan.labels) CHECK_FALSE(is_moving(label));
    for (const ObjectState& state : scan.objects) CHECK(state.speed == 0.0);
    parked = parked || !scan.objects.empty();
  }
  CHECK(parked);
}

TEST_CASE("vehicles keep a distance from one another and from the ego vehicle") {
  for (const Scene scene : {Scene::kHighway, Scene::kHill, Scene::kStopAndGo}) {
    Simulator simulator(drive_of(scene, Sensor::kVlp16, 60, 3));
    for (std::size_t i = 0; i < simulator.size(); i += 4) {
      const SimulatedScan scan = simulator.scan(i);
      for (const ObjectState& state : scan.objects) {
        if (class_of(state.label) == 254 || class_of(state.label) == 30) continue;
        // The centre of one vehicle is outside the rectangle of the other.
        const auto check = [&state](const Eigen::Isometry3d& T_world_other) {
          const Eigen::Vector3d p = state.T_world_object.inverse() * T_world_other.translation();
          CHECK_FALSE((std::abs(p.x()) < state.length / 2 && std::abs(p.y()) < state.width / 2));
        };
        check(scan.T_world_sensor);
        for (const ObjectState& other : scan.objects) {
          if (&other != &state) check(other.T_world_object);
        }
      }
    }
  }
}

TEST_CASE("points of an object lie within its box") {
  Simulator simulator(drive_of(Scene::kUrban, Sensor::kHdl64, 3, 6));
  const SimulatedScan scan = simulator.scan(1);
  std::map<std::uint32_t, const ObjectState*> states;
  for (const ObjectState& state : scan.objects) states[state.instance] = &state;
  std::size_t inside = 0, outside = 0;
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    if (scan.labels[i] >> 16 == 0) continue;
    const ObjectState& state = *states.at(scan.labels[i] >> 16);
    const Eigen::Vector3d p =
        state.T_world_object.inverse() * (scan.T_world_sensor * point_of(scan, i));
    // Limbs swing, ranges are noisy, and wheels may stand in a bump.
    const bool in = std::abs(p.x()) < state.length / 2 + 0.45 &&
                    std::abs(p.y()) < state.width / 2 + 0.35 && p.z() > -0.3 &&
                    p.z() < state.height + 0.3;
    ++(in ? inside : outside);
  }
  CHECK(inside > 1000);
  CHECK(outside <= inside / 500);
}

TEST_CASE("range noise has the configured deviation") {
  Config config = test::exact_drive_of(Scene::kStatic, Sensor::kVlp16, 1, 4);
  const SimulatedScan exact = Simulator(config).scan(0);
  config.range_noise = 0.05;
  const SimulatedScan noisy = Simulator(config).scan(0);
  // Without losses, equal beams return, except at the end of the range.
  double sum = 0, squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < exact.labels.size() && count < noisy.labels.size(); ++i) {
    const Eigen::Vector3d a = point_of(exact, i), b = point_of(noisy, count);
    if (a.normalized().dot(b.normalized()) < 0.999999) continue;
    const double error = b.norm() - a.norm();
    sum += error;
    squares += error * error;
    ++count;
  }
  REQUIRE(count > exact.labels.size() * 9 / 10);
  const auto n = static_cast<double>(count);
  CHECK(sum / n == Approx(0).margin(0.002));
  CHECK(std::sqrt(squares / n) == Approx(0.05).margin(0.003));
}

TEST_CASE("poses are rigid and smooth, with the configured noise") {
  Config config = drive_of(Scene::kHill, Sensor::kVlp16, 60, 2);
  config.pose_noise_translation = 0.03;
  config.pose_noise_rotation = 0.1;
  Simulator simulator(config);
  double translation = 0, rotation = 0;
  SimulatedScan last;
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    SimulatedScan scan = simulator.scan(i);
    CHECK(scan.time == Approx(0.1 * static_cast<double>(i)));
    for (const Pose& T : {scan.T_world_sensor, scan.T_world_sensor_noisy}) {
      const Eigen::Matrix3d R = T.linear();
      CHECK((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-9);
      CHECK(R.determinant() == Approx(1));
    }
    const Eigen::Isometry3d error = scan.T_world_sensor.inverse() * scan.T_world_sensor_noisy;
    translation += error.translation().squaredNorm() / 3;
    rotation += std::pow(Eigen::AngleAxisd(error.linear()).angle(), 2) / 3;
    if (i > 0) {
      const Eigen::Isometry3d step = last.T_world_sensor.inverse() * scan.T_world_sensor;
      CHECK(step.translation().norm() < 1.2);  // 12 m/s
      CHECK(std::abs(step.translation().z()) < 0.12);
      CHECK(Eigen::AngleAxisd(step.linear()).angle() < 0.035);  // 20 deg/s
    }
    last = std::move(scan);
  }
  const auto n = static_cast<double>(simulator.size());
  CHECK(std::sqrt(translation / n) == Approx(0.03).epsilon(0.2));
  CHECK(std::sqrt(rotation / n) * 57.29578 == Approx(0.1).epsilon(0.2));
}

TEST_CASE("a person turns the sensor by up to 40 degrees per second and sways, a robot less") {
  struct Sway {
    double turn = 0, tilt = 0, bob = 0;
  };
  const auto sway_of = [](Gait gait) {
    Config config = drive_of(Scene::kHall, Sensor::kVlp16, 60, 4);
    config.gait = gait;
    Simulator simulator(config);
    Sway sway;
    Eigen::Isometry3d last = simulator.scan(0).T_world_sensor;
    for (std::size_t i = 1; i < simulator.size(); ++i) {
      const Eigen::Isometry3d next = simulator.scan(i).T_world_sensor;
      const Eigen::Isometry3d step = last.inverse() * next;
      sway.turn = std::max(sway.turn, std::abs(std::atan2(step(1, 0), step(0, 0))) * 572.9578);
      sway.tilt = std::max(sway.tilt, std::acos(next(2, 2)) * 57.29578);
      sway.bob = std::max(sway.bob, std::abs(next(2, 3) - last(2, 3)));
      last = next;
    }
    return sway;
  };
  const Sway vehicle = sway_of(Gait::kVehicle), hand = sway_of(Gait::kHandHeld),
             legged = sway_of(Gait::kLegged);
  CHECK(hand.turn > 37);  // deg/s
  CHECK(hand.turn < 48);  // with the bends of the way
  CHECK(hand.tilt > 2.5);
  CHECK(hand.tilt < 5);
  CHECK(hand.bob > 0.02);
  CHECK(legged.tilt > 1);
  CHECK(legged.tilt < 3);
  CHECK(legged.turn < 20);
  CHECK(vehicle.tilt < 1);
  CHECK(vehicle.bob < 0.005);
}

TEST_CASE("direction noise moves points across their beams by its deviation") {
  Config config = drive_of(Scene::kStatic, Sensor::kVlp16, 1, 2);
  const SimulatedScan exact = Simulator(config).scan(0);
  config.direction_noise = 0.1;
  const SimulatedScan noisy = Simulator(config).scan(0);
  REQUIRE(exact.labels == noisy.labels);
  double sum = 0;
  for (std::size_t i = 0; i < exact.labels.size(); ++i) {
    const Eigen::Vector3d a = point_of(exact, i), b = point_of(noisy, i);
    // Two directions across the beam.
    sum += (a.normalized() - b.normalized()).squaredNorm() / 2;
  }
  const double deviation = std::sqrt(sum / static_cast<double>(exact.labels.size()));
  CHECK(deviation * 57.29578 == Approx(0.1).epsilon(0.03));
}

}  // namespace dynains::simulation
