// The odometry in simulated places, and its answers to wrong input.
#include "dynains/odometry/odometry.hpp"

#include "dynains/errors.hpp"
#include "dynains/io/trajectory.hpp"
#include "dynains/median.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/scene.hpp"
#include "support/simulated_runs.hpp"

namespace dynains::test {
namespace {

simulation::Config place(simulation::Scene scene, std::size_t scans) {
  return drive_of(scene, simulation::Sensor::kVlp16, static_cast<int>(scans), 4711);
}

struct Drive {
  std::vector<Pose> estimated;
  std::vector<Pose> exact;  ///< in the frame of the first scan
};

Drive drive(const simulation::Config& config, const OdometryConfig& odometry_config) {
  Odometry odometry(odometry_config);
  Drive result;
  const std::vector<simulation::SimulatedScan> scans = simulate(config);
  for (const simulation::SimulatedScan& scan : scans) {
    const OdometryResult found = odometry.push(points_of(scan), {}, scan.time);
    REQUIRE(found.loss == OdometryLoss::kNone);
    result.estimated.push_back(found.T_world_sensor);
    result.exact.push_back(scans[0].T_world_sensor.inverse() * scan.T_world_sensor);
  }
  return result;
}

double worst_error(const Drive& drive) {
  double worst = 0.0;
  for (std::size_t i = 0; i < drive.exact.size(); ++i) {
    const Eigen::Vector3d error = drive.estimated[i].translation() - drive.exact[i].translation();
    worst = std::max(worst, error.norm());
  }
  return worst;
}

TEST_CASE("Scans along smooth walls have a free direction, though many points fit there") {
  const auto free_scans = [](simulation::Scene scene) {
    Odometry odometry;
    std::size_t count = 0;
    for (const auto& scan : simulate(drive_of(scene, simulation::Sensor::kOs0_128, 8, 6102))) {
      count += odometry.push(points_of(scan), {}, scan.time).free_directions > 0 ? 1 : 0;
    }
    return count;
  };
  CHECK(free_scans(simulation::Scene::kTunnel) >= 6);
  CHECK(free_scans(simulation::Scene::kUrban) == 0);
}

TEST_CASE("Two scans a second by hand in a hall keep track, also if the sensor turns to and fro") {
  simulation::Config config =
      drive_of(simulation::Scene::kHall, simulation::Sensor::kOs1_64, 10, 501);
  config.gait = simulation::Gait::kHandHeld;
  config.rate = 2.0;
  config.ego_speed = 1.2;
  config.sensor_height = 1.4;
  const double degrees = GENERATE(0.0, 40.0);
  simulation::Simulator simulator(config);
  const Pose T_first_world = simulator.scan(0).T_world_sensor.inverse();
  Odometry odometry;
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    simulation::SimulatedScan scan = simulator.scan(i);
    const double angle = i % 2 == 0 ? 0.0 : degrees * M_PI / 180.0;
    const Eigen::Matrix3d R_sensor_turned =
        Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    for (std::size_t k = 0; k < scan.xyzi.size(); k += 4) {
      Eigen::Map<Eigen::Vector3f> p(&scan.xyzi[k]);
      p = R_sensor_turned.transpose().cast<float>() * p.eval();
    }
    const OdometryResult found = odometry.push(points_of(scan), {}, scan.time);
    CAPTURE(degrees, i);
    REQUIRE(found.loss == OdometryLoss::kNone);
    CHECK(found.free_directions == 0);
    const Pose T_exact = T_first_world * scan.T_world_sensor;
    CHECK((found.T_world_sensor.translation() - T_exact.translation()).norm() < 0.03);
  }
}

TEST_CASE("In a hall, a crowd and a forest, poses are found to centimetres, also without removal") {
  using simulation::Scene;
  for (const Scene scene : {Scene::kHall, Scene::kCrowd, Scene::kForest}) {
    for (const bool remove : {true, false}) {
      OdometryConfig config;
      config.remove = remove;
      const Drive found = drive(place(scene, 25), config);
      CAPTURE(static_cast<int>(scene), remove, worst_error(found));
      CHECK(found.exact.back().translation().norm() > 0.1);
      CHECK(worst_error(found) < 0.1);
    }
  }
}

/// A scan of 32 beams from -45 to 45 deg in an empty room of this size (m), from its middle
/// and 0.85 m over the floor, moved by `place` (m), with noise of 1 cm.
std::vector<Eigen::Vector3f> scan_of_room(const Eigen::Vector3d& size, const Eigen::Vector3d& place,
                                          unsigned seed) {
  constexpr int kBeams = 32, kColumns = 900;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 0.01);
  const Eigen::Vector3d high(0.5 * size.x(), 0.5 * size.y(), size.z() - 0.85);
  const Eigen::Vector3d low(-high.x(), -high.y(), -0.85);
  std::vector<Eigen::Vector3f> points;
  for (int beam = 0; beam < kBeams; ++beam) {
    const double elevation = (-45.0 + 90.0 * beam / (kBeams - 1)) * M_PI / 180.0;
    for (int column = 0; column < kColumns; ++column) {
      const double azimuth = 2.0 * M_PI * column / kColumns;
      const Eigen::Vector3d ray = dynains::test::ray_of(elevation, azimuth);
      const double range = dynains::test::range_to_wall(place, ray, low, high);
      points.push_back(((range + noise(random)) * ray).cast<float>());
    }
  }
  return points;
}

TEST_CASE("Columns of beams on smooth walls pretend no hold along corridors and tunnels") {
  const Eigen::Vector3d size =
      GENERATE(Eigen::Vector3d(1000.0, 2.2, 2.6), Eigen::Vector3d(1000.0, 8.6, 5.5));
  const double step = size.y() < 4.0 ? 0.1 : 1.0;  // m
  Odometry odometry;
  std::size_t count = 0;
  for (int i = 0; i < 10; ++i) {
    const auto points = scan_of_room(size, {step * i, 0.0, 0.0}, 7 + unsigned(i));
    count += odometry.push(points, {}, 0.1 * i).free_directions > 0 ? 1 : 0;
  }
  CAPTURE(size.transpose());
  CHECK(count == 9);
}

TEST_CASE("In rooms of 2.2 to 15 m, poses are found to 2 cm, standing and driving") {
  const Eigen::Vector3d size =
      GENERATE(Eigen::Vector3d(2.2, 2.2, 2.4), Eigen::Vector3d(5.0, 4.0, 2.6),
               Eigen::Vector3d(8.0, 6.0, 3.2), Eigen::Vector3d(15.0, 12.0, 4.0));
  const double step = GENERATE(0.0, 0.03);  // m
  Odometry odometry;
  double worst = 0.0;
  for (unsigned i = 0; i < 15; ++i) {
    const Eigen::Vector3d place(step * i, 0.0, 0.0);
    const OdometryResult found = odometry.push(scan_of_room(size, place, i), {}, 0.1 * i);
    REQUIRE(found.loss == OdometryLoss::kNone);
    CHECK(found.free_directions == 0);
    worst = std::max(worst, (found.T_world_sensor.translation() - place).norm());
  }
  CAPTURE(size.transpose(), step);
  CHECK(worst < 0.02);
}

TEST_CASE("How well a scan has to fit follows its pattern: few points in a crowd are no loss") {
  const auto config = drive_of(simulation::Scene::kCrowd, simulation::Sensor::kMid360, 8, 71);
  CHECK(worst_error(drive(config, {})) < 0.1);
}

TEST_CASE("All sensors of a rig register together, and each point has the beam of its own") {
  simulation::Config config =
      drive_of(simulation::Scene::kUrban, simulation::Sensor::kVlp16, 12, 4711);
  config.rig = simulation::Rig::kCorners;
  simulation::Simulator simulator(config);
  DynaInsRemover::Config by_sensors = DynaInsRemover::Config::odometry();
  by_sensors.sensors = simulator.mounts();
  Odometry odometry({}, by_sensors);
  by_sensors.evidence.pose_tolerance = 0.0;  // registered once
  DynaInsRemover remover(by_sensors);
  const Pose T_first_world = simulator.scan(0).T_world_sensor.inverse();
  double worst = 0.0;
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    simulation::SimulatedScan scan = simulator.scan(i);
    const RawPoints<float> points = points_of(scan);
    const OdometryResult found = odometry.push(points, {}, scan.time);
    REQUIRE(found.loss == OdometryLoss::kNone);
    const Pose T_exact = T_first_world * scan.T_world_sensor;
    worst = std::max(worst, (found.T_world_sensor.translation() - T_exact.translation()).norm());
    const FrameResult frame = remover.push(points, found.T_world_sensor, scan.time);
    if (i == 0) continue;  // judged with the next one
    CHECK_FALSE(found.frame.pose_residual);
    const auto labels = frame.newest().labels;
    CHECK(std::equal(labels.begin(), labels.end(), found.frame.newest().labels.begin()));
    scan.sensors.back() = 2;
    CHECK_THROWS_AS(odometry.push(points, {}, scan.time + 0.05), CloudError);
  }
  CHECK(worst < 0.1);
}

/// Median of the errors of the motion from scan to scan, m, for stamps `shift` s after the first
/// point of each scan.
double error_of_motion(const std::vector<simulation::SimulatedScan>& scans, double shift) {
  Odometry odometry;
  std::vector<double> errors;
  Pose T_world_estimated = Pose::Identity(), T_world_exact = Pose::Identity();
  for (std::size_t i = 0; i + 1 < scans.size(); ++i) {
    const double period = scans[i + 1].time - scans[i].time;
    const Pose T_exact =
        extrapolate(scans[i].T_world_sensor, scans[i + 1].T_world_sensor, shift / period);
    std::vector<double> offsets;
    for (const float time : scans[i].times) offsets.push_back(time - shift);
    const OdometryResult found = odometry.push(points_of(scans[i]), offsets, scans[i].time + shift);
    REQUIRE(found.loss == OdometryLoss::kNone);
    const Pose motion = T_world_estimated.inverse() * found.T_world_sensor;
    const Pose exact = T_world_exact.inverse() * T_exact;
    if (i > 0) errors.push_back((motion.translation() - exact.translation()).norm());
    T_world_estimated = found.T_world_sensor;
    T_world_exact = T_exact;
  }
  return median(std::move(errors));
}

TEST_CASE("Points with times: motions to 3 cm, wherever in the turn the stamp is") {
  for (const double speed : {1.2, 10.0}) {
    simulation::Config config = place(simulation::Scene::kUrban, 14);
    config.ego_speed = speed;
    config.rolling_shutter = true;
    const std::vector<simulation::SimulatedScan> scans = simulate(config);
    for (const double shift : {0.0, 0.05, 0.1}) {
      CAPTURE(speed, shift);
      CHECK(error_of_motion(scans, shift) < 0.03);
    }
  }
}

TEST_CASE("16 beams on a highway: the odometry moves with the road, not with the traffic") {
  for (const std::uint64_t seed : {202, 210, 622}) {
    simulation::Config config = place(simulation::Scene::kHighway, 12);
    config.seed = seed;
    config.traffic = seed == 622 ? 2.0 : 1.0;
    config.rate = seed == 210 ? 2.0 : 10.0;  // 12 m from scan to scan
    const Drive found = drive(config, {});
    CAPTURE(seed, worst_error(found));
    CHECK(found.exact.back().translation().norm() > 20.0);
    CHECK(worst_error(found) < 0.5);
    const Pose motion = found.estimated[10].inverse() * found.estimated[11];
    const Pose exact = found.exact[10].inverse() * found.exact[11];
    CHECK((motion.translation() - exact.translation()).norm() < 0.15);
  }
}

TEST_CASE("Times in nanoseconds do not widen the search for the first motion beyond that of 1 s") {
  simulation::Config config = place(simulation::Scene::kHighway, 2);
  config.seed = 210;
  config.rate = 2.0;
  simulation::Simulator highway(config);
  Odometry odometry;
  odometry.push(points_of(highway.scan(0)), {}, 0.0);
  const Pose found = odometry.push(points_of(highway.scan(1)), {}, 5e8).T_world_sensor;
  const Pose exact = highway.scan(0).T_world_sensor.inverse() * highway.scan(1).T_world_sensor;
  CHECK((found.translation() - exact.translation()).norm() < 0.5);
}

TEST_CASE("Some lost scans are bridged, and after a longer gap the map begins anew") {
  simulation::Config config = place(simulation::Scene::kUrban, 27);
  config.ego_speed = 10.0;
  simulation::Simulator street(config);
  Odometry odometry;
  const Pose T_first_world = street.scan(0).T_world_sensor.inverse();
  const auto push = [&](std::size_t i) {
    const auto scan = street.scan(i);
    const OdometryResult found = odometry.push(points_of(scan), {}, scan.time);
    const Pose exact = T_first_world * scan.T_world_sensor;
    const double error = (found.T_world_sensor.translation() - exact.translation()).norm();
    return std::make_pair(found.loss, error);
  };
  for (std::size_t i = 0; i < 8; ++i) REQUIRE(push(i).first == OdometryLoss::kNone);
  const auto [loss, error] = push(13);
  CHECK(loss == OdometryLoss::kNone);
  CHECK(error < 0.2);
  CHECK(push(14).first == OdometryLoss::kNone);
  CHECK(push(25).first == OdometryLoss::kGap);
  CHECK(push(26).first == OdometryLoss::kNone);
}

TEST_CASE("Behind another odometry, its wrong motions are corrected, and its first pose stays") {
  simulation::Simulator hall(place(simulation::Scene::kHall, 12));
  Odometry odometry;
  for (std::size_t i = 0; i < hall.size(); ++i) {
    const auto scan = hall.scan(i);
    Pose T_wrong = scan.T_world_sensor;
    T_wrong.translation().y() += 0.05 * static_cast<double>(i);
    const OdometryResult found = odometry.push(points_of(scan), {}, scan.time, T_wrong);
    CHECK(found.frame.newest().labels.size() == points_of(scan).count);
    const double error =
        (found.T_world_sensor.translation() - scan.T_world_sensor.translation()).norm();
    CHECK(error < (i == 0 ? 1e-9 : 0.1));
  }
}

TEST_CASE("Behind another odometry, a scan that does not fit keeps its motion") {
  simulation::Simulator hall(place(simulation::Scene::kHall, 8));
  simulation::Simulator street(place(simulation::Scene::kUrban, 8));
  Odometry odometry;
  const auto push = [&](const simulation::SimulatedScan& scan, double x, double time) {
    return odometry.push(points_of(scan), {}, time, Pose(Eigen::Translation3d(x, 0, 0)));
  };
  double x = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    x = push(hall.scan(0), 7.0, 0.1 * static_cast<double>(i)).T_world_sensor.translation().x();
  }
  CHECK(x == Approx(7.0).margin(0.02));
  const OdometryResult lost = push(street.scan(4), 9.0, 0.4);
  CHECK(lost.loss == OdometryLoss::kNoOverlap);
  CHECK(lost.T_world_sensor.translation().x() == Approx(x + 2.0));
  CHECK(lost.frame.newest().labels.size() == points_of(street.scan(4)).count);
  const std::vector<Eigen::Vector3f> empty;
  const Pose T_empty(Eigen::Translation3d(9.1, 0, 0));
  CHECK(odometry.push(empty, {}, 0.45, T_empty).loss == OdometryLoss::kFewPoints);
  const OdometryResult next = push(street.scan(4), 9.3, 0.5);  // the sensor stands
  CHECK(next.loss == OdometryLoss::kNone);
  CHECK(next.T_world_sensor.translation().x() == Approx(x + 2.0).margin(0.02));
}

TEST_CASE("Same scans, same bits") {
  const simulation::Config config = place(simulation::Scene::kCrowd, 8);
  const Drive a = drive(config, {}), b = drive(config, {});
  for (std::size_t i = 0; i < a.estimated.size(); ++i) {
    CHECK(std::memcmp(a.estimated[i].data(), b.estimated[i].data(), 16 * sizeof(double)) == 0);
  }
}

TEST_CASE("A lost scan is told and does not enter the map") {
  simulation::Simulator hall(place(simulation::Scene::kHall, 8));
  simulation::Simulator street(place(simulation::Scene::kUrban, 8));
  Odometry with_loss, without;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto scan = hall.scan(i);
    with_loss.push(points_of(scan), {}, scan.time);
    without.push(points_of(scan), {}, scan.time);
  }
  const auto lost = street.scan(4);
  CHECK(with_loss.push(points_of(lost), {}, lost.time).loss == OdometryLoss::kNoOverlap);
  const std::vector<float> few(4 * 50, 5.0F);
  const RawPoints<float> few_points{few.data(), 50, 4};
  CHECK(with_loss.push(few_points, {}, lost.time).loss == OdometryLoss::kFewPoints);
  const auto next = hall.scan(4);
  const Pose a = with_loss.push(points_of(next), {}, next.time).T_world_sensor;
  const Pose b = without.push(points_of(next), {}, next.time).T_world_sensor;
  CHECK(a.matrix() == b.matrix());
}

TEST_CASE("Wrong input throws and changes nothing") {
  simulation::Simulator hall(place(simulation::Scene::kHall, 3));
  Odometry odometry;
  const auto first = hall.scan(0), second = hall.scan(1);
  odometry.push(points_of(first), {}, first.time);
  const std::vector<double> offsets(7, 0.0);
  CHECK_THROWS_AS(odometry.push(points_of(second), offsets, second.time), CloudError);
  CHECK_THROWS_AS(odometry.push(points_of(second), {}, first.time), PoseError);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(odometry.push(points_of(second), {}, nan), PoseError);
  CHECK_THROWS_AS(odometry.push(RawPoints<float>{nullptr, 10, 4}, {}, second.time), CloudError);
  CHECK_THROWS_AS(odometry.push(points_of(second), {}, second.time, Eigen::Matrix4d::Zero()),
                  PoseError);
  CHECK(odometry.push(points_of(second), {}, second.time).loss == OdometryLoss::kNone);
}

TEST_CASE("Configurations out of bounds are refused by name") {
  OdometryConfig config;
  config.nearest = -1.0;
  CHECK_THROWS_WITH(Odometry(config), ContainsSubstring("nearest"));
  config.nearest = 100.0;
  config.farthest = 100.0;
  CHECK_THROWS_WITH(Odometry(config), ContainsSubstring("less than farthest"));
  config.farthest = 100.5;
  CHECK_NOTHROW(Odometry(config));
}

}  // namespace
}  // namespace dynains::test
