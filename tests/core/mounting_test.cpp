#include "dynains/sensor/mounting.hpp"

#include "dynains/compiled_remover.hpp"
#include "dynains/io/recording.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/points.hpp"
#include "support/recordings.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

constexpr double kRadians = M_PI / 180.0;

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kRadians;
}

/// A plane of 30 m by 30 m, `height` below the sensor, with a wall along it, in the frame of a
/// sensor that is mounted with `R_level_sensor`.
PointBuffer street(double height, const Eigen::Matrix3d& R_level_sensor) {
  PointBuffer points;
  const auto add = [&](double x, double y, double z) {
    add_point(points, R_level_sensor.transpose() * Eigen::Vector3d(x, y, z));
  };
  for (double a = -15.0; a < 15.0; a += 0.23) {
    for (double b = -15.0; b < 15.0; b += 0.23) add(a, b, -height);
    for (double b = 0.0; b < 6.0; b += 0.23) add(a, 9.0, b - height);
  }
  return points;
}

TEST_CASE("a heading turns with the points and runs along the scene, to its end with more points") {
  Random random(11);
  PointBuffer scan;
  for (int i = 0; i < 2000; ++i) {
    add_point(scan, random.vector({-30.0, -9.0, 0.0}, {50.0, 9.0, 0.0}));
  }
  CHECK(std::abs(estimate_heading(scan)) < 0.05);
  const double plain = estimate_heading(scan);
  for (const double angle : {0.5, 1.6, 3.1, -2.0, -0.01}) {
    INFO("turned by " << angle);
    const Eigen::Matrix3f R = R_headed(-angle).cast<float>();
    PointBuffer turned;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      add_point(turned, R * Eigen::Vector3f(scan.x[i], scan.y[i], scan.z[i]));
    }
    const double off = estimate_heading(turned) - plain - angle;
    CHECK(std::abs(std::remainder(off, 2.0 * M_PI)) < 1e-5);
  }
  CHECK(estimate_heading(PointBuffer()) == 0.0);
}

TEST_CASE("A plane and a wall give exact height and tilt") {
  for (const double height : {0.5, 1.2, 1.73, 2.5, 4.0}) {
    for (const double pitch : {-30.0, 0.0, 20.0}) {
      for (const double roll : {0.0, 30.0, 170.0}) {
        const Eigen::Matrix3d R_level_sensor = slant(pitch, roll);
        const Mounting mounting = estimate_mounting(street(height, R_level_sensor));
        CAPTURE(height, pitch, roll, mounting.height, mounting.up_sensor.transpose());
        REQUIRE(mounting.known);
        CHECK(std::abs(mounting.height - height) < 0.02);
        CHECK(angle_between(mounting.up_sensor,
                            R_level_sensor.transpose() * Eigen::Vector3d::UnitZ()) < 0.3);
      }
    }
  }
}

TEST_CASE("A sensor is levelled by the smallest rotation, upside down or not") {
  Mounting mounting;
  for (const double tilt : {0.0, 1e-9, 5.0, 89.9, 90.0, 90.1, 179.0, 180.0 - 1e-4, 180.0 - 1e-9}) {
    for (const double heading : {0.0, 0.3, 2.0, -1.7}) {
      CAPTURE(tilt, heading);
      const double angle = tilt * kRadians;
      mounting.up_sensor = {std::sin(angle) * std::cos(heading),
                            std::sin(angle) * std::sin(heading), std::cos(angle)};
      const Eigen::Matrix3d R = mounting.R_level_sensor();
      CHECK((R * mounting.up_sensor - Eigen::Vector3d::UnitZ()).norm() < 1e-9);
      CHECK((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-9);
      CHECK(std::abs(R.determinant() - 1.0) < 1e-9);
      if (tilt > 179.5) continue;  // Eigen gives any half turn there
      const auto slow =
          Eigen::Quaterniond::FromTwoVectors(mounting.up_sensor, Eigen::Vector3d::UnitZ());
      CHECK((R - slow.toRotationMatrix()).norm() < 1e-12);
    }
  }
  mounting.up_sensor = {0.0, 0.0, std::nextafter(1.0, 2.0)};  // rounding error of normals
  CHECK(mounting.tilt() == 0.0);
  mounting.up_sensor = -Eigen::Vector3d::UnitZ();
  CHECK(mounting.R_level_sensor() ==
        Eigen::Matrix3d(Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal()));
}

TEST_CASE("A roof of the own vehicle and points that are not finite change nothing") {
  PointBuffer points = street(1.9, Eigen::Matrix3d::Identity());
  for (double a = -2.0; a < 2.0; a += 0.05) {
    for (double b = -0.8; b < 0.8; b += 0.05) {
      points.push_back(static_cast<float>(a), static_cast<float>(b), -0.4F);
    }
  }
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  points.push_back(std::nanf(""), 0.0F, 0.0F);
  points.push_back(1.0F, kInfinity, 0.0F);
  points.push_back(0.0F, 0.0F, -kInfinity);
  const Mounting mounting = estimate_mounting(points);
  REQUIRE(mounting.known);
  CHECK(std::abs(mounting.height - 1.9) < 0.03);
}

TEST_CASE("Without ground, the mounting is not known") {
  CHECK_FALSE(estimate_mounting({}).known);

  PointBuffer few;
  for (int i = 0; i < 1000; ++i) few.push_back(5.0F, 0.001F * static_cast<float>(i), -1.7F);
  CHECK_FALSE(estimate_mounting(few).known);

  PointBuffer wall;
  for (float a = -15.0F; a < 15.0F; a += 0.2F) {
    for (float b = -3.0F; b < 6.0F; b += 0.2F) wall.push_back(6.0F, a, b);
  }
  CHECK_FALSE(estimate_mounting(wall).known);

  Random random(5);
  PointBuffer cloud;
  for (int i = 0; i < 20000; ++i) {
    add_point(cloud, random.vector({-15.0, -15.0, -15.0}, {15.0, 15.0, 15.0}));
  }
  CHECK_FALSE(estimate_mounting(cloud).known);
}

TEST_CASE("Ground in 60 cells is enough, and cells left and right of zero differ") {
  PointBuffer points;
  for (const float y : {-1.25F, -0.75F, -0.25F, 0.25F, 0.75F, 1.25F}) {
    for (int column = -5; column < 5; ++column) {
      points.push_back(0.25F + 0.5F * static_cast<float>(column), y, -1.75F);
    }
  }
  const Mounting mounting = estimate_mounting(points);
  REQUIRE(mounting.known);
  CHECK(mounting.height == Approx(1.75));
  points.x[0] = points.x[1];  // 59 cells
  points.y[0] = points.y[1];
  CHECK_FALSE(estimate_mounting(points).known);
}

TEST_CASE("The lower of two planes is the ground, even if it is smaller") {
  PointBuffer points;
  for (float b = -9.0F; b < 9.0F; b += 0.23F) {
    for (float a = -9.0F; a < 0.0F; a += 0.23F) points.push_back(a, b, -1.0F);
    for (float a = 0.0F; a < 8.0F; a += 0.23F) points.push_back(a, b, -2.5F);
  }
  const Mounting mounting = estimate_mounting(points);
  REQUIRE(mounting.known);
  CHECK(std::abs(mounting.height - 2.5) < 0.02);
}

TEST_CASE("A plane is no ground if more points are below it than on it, or if it is a small part") {
  const auto is_known = [](std::size_t below, std::size_t above) {
    PointBuffer points;
    for (float a = -2.5F; a < 2.5F; a += 0.23F) {  // a platform of a hundred cells
      for (float b = -2.5F; b < 2.5F; b += 0.23F) points.push_back(a, b, -1.0F);
    }
    Random random(7);
    const auto scatter = [&](std::size_t count, double low, double high) {
      for (std::size_t i = 0; i < count; ++i) {
        add_point(points, random.vector({-9.0, -9.0, low}, {9.0, 9.0, high}));
      }
    };
    scatter(below, -9.0, -1.6);
    scatter(above, 0.0, 14.0);
    return estimate_mounting(points).known;
  };
  CHECK(is_known(0, 0));
  CHECK(is_known(60, 0));
  CHECK_FALSE(is_known(150, 0));
  CHECK(is_known(0, 1000));
  CHECK_FALSE(is_known(0, 4000));
}

TEST_CASE("Height and tilt of every sensor in every simulated scene") {
  namespace sim = simulation;
  struct Mount {
    double height, pitch, roll;
  };
  const Mount mounts[] = {{1.73, 0, 0},  {0.5, 0, 0},   {1.0, -20, 10}, {1.73, 30, 0},
                          {2.5, 5, -25}, {0.7, 0, -30}, {2.0, -10, 0}};
  int unknown_in_rooms = 0;
  for (std::size_t i = 0; i < 2 * value_names(sim::Scene()).size(); ++i) {
    const Mount& mount = mounts[(3 * i) % std::size(mounts)];
    sim::Config config =
        drive_of(static_cast<sim::Scene>(i % value_names(sim::Scene()).size()),
                 static_cast<sim::Sensor>(i % value_names(sim::Sensor()).size()), 1, 12 + i);
    config.sensor_height = mount.height;
    config.mounting_pitch = mount.pitch;
    config.mounting_roll = mount.roll;
    config.ego_points = i % 2 == 0;
    const Mounting mounting = estimate_mounting(buffer_of(sim::Simulator(config).scan(0).xyzi));

    Eigen::Matrix3d R_body_sensor = slant(mount.pitch, mount.roll);
    if (config.sensor == sim::Sensor::kPandar64) {
      R_body_sensor = R_body_sensor * Eigen::AngleAxisd(90 * kRadians, Eigen::Vector3d::UnitZ());
    }
    CAPTURE(plain_value(config.scene), plain_value(config.sensor), mount.height, mount.pitch,
            mount.roll, mounting.height, mounting.up_sensor.transpose());
    // A tilted sensor sees little floor in a small room: its mounting is unknown, not wrong.
    if (!mounting.known && config.scene == sim::Scene::kRoom) {
      ++unknown_in_rooms;
      continue;
    }
    REQUIRE(mounting.known);
    CHECK(std::abs(mounting.height - mount.height) < 0.12);
    // The vehicle is not parallel to the ground around it: crowned roads, unevenness.
    CHECK(angle_between(mounting.up_sensor, R_body_sensor.transpose() * Eigen::Vector3d::UnitZ()) <
          2.2);
  }
  CHECK(unknown_in_rooms <= 1);
}

// `height` was measured by hand on ground points around the vehicle.
void check_mounting(const std::string& name, double height, double tilt) {
  const auto folder = recording_or_skip(name);
  if (!folder) return;
  const Recording recording(*folder);
  for (const std::size_t i : {std::size_t{0}, recording.size() / 2, recording.size() - 1}) {
    const Mounting mounting = estimate_mounting(buffer_of(recording.read_scan(i).xyzi));
    CAPTURE(i);
    REQUIRE(mounting.known);
    CHECK(std::abs(mounting.height - height) < 0.1);
    CHECK(std::abs(mounting.tilt() - tilt) < 1.0);
  }
}

TEST_CASE("Height and tilt on a recorded road") { check_mounting("kitti_van", 1.73, 1.5); }

TEST_CASE("Height and tilt on a recorded busy street") {
  check_mounting("pandaset_street", 2.1, 2.0);
}

}  // namespace
}  // namespace dynains::test
