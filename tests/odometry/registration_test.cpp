// Registration of known motions, and motions that nothing determines.
#include "odometry/registration.hpp"

#include <Eigen/Geometry>
#include <limits>
#include <random>
#include <vector>

#include "odometry/scan_preparation.hpp"
#include "support/catch.hpp"

namespace dynains::odometry {
namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr double kFinest = 0.1;  // m

/// Random points on the floor and two walls of a corridor of 40 m along x, with 1 cm of noise. A
/// closed one has a wall at one end.
Points corridor(bool is_closed, unsigned seed, std::size_t count) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * std::generate_canonical<double, 32>(random);
  };
  Points points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = uniform(-20.0, 20.0), y = uniform(-3.0, 3.0), z = uniform(-1.5, 1.5);
    const double noise = uniform(-0.01, 0.01);
    switch (i % (is_closed ? 4 : 3)) {
      case 0:
        points.emplace_back(x, y, -1.5 + noise);
        break;
      case 1:
        points.emplace_back(x, -3.0 + noise, z);
        break;
      case 2:
        points.emplace_back(x, 3.0 + noise, z);
        break;
      default:
        points.emplace_back(8.0 + noise, y, z);
    }
  }
  return points;
}

LocalMap map_of(const Points& points) {
  LocalMap map;
  for (const Eigen::Vector3d& p : points) map.insert(p);
  return map;
}

Points seen_from(const Pose& T_map_scan, const Points& points) {
  Points seen;
  for (const Eigen::Vector3d& p : points) seen.push_back(T_map_scan.inverse() * p);
  return seen;
}

Pose motion(const Eigen::Vector3d& translation, double degrees) {
  Pose T = Pose::Identity();
  T.translate(translation);
  const Eigen::Vector3d axis = Eigen::Vector3d(0.1, 0.2, 1.0).normalized();
  T.rotate(Eigen::AngleAxisd(degrees * M_PI / 180.0, axis));
  return T;
}

double angle_between(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() * 180.0 / M_PI;
}

TEST_CASE("Known motions are recovered") {
  const LocalMap map = map_of(corridor(true, 1, 20000));
  for (const double degrees : {-4.0, 0.0, 4.0}) {
    const Pose T = motion({0.3, -0.2, 0.1}, degrees);
    const Points scan = seen_from(T, corridor(true, 2, 2000));
    const Alignment found = align(scan, map, Pose::Identity(), 1.0, kFinest);
    CAPTURE(degrees, (found.T_map_scan.translation() - T.translation()).norm());
    CHECK(found.free_directions == 0);
    CHECK((found.T_map_scan.translation() - T.translation()).norm() < 0.005);
    CHECK(angle_between(found.T_map_scan, T) < 0.1);
    CHECK(found.fit > 0.9);
  }
}

TEST_CASE("Along an open corridor the motion stays the predicted one, and this is told") {
  const LocalMap map = map_of(corridor(false, 1, 20000));
  const Pose T = motion({0.4, 0.1, 0.0}, 0.0);
  Points scan;
  for (const Eigen::Vector3d& p : seen_from(T, corridor(false, 2, 2000))) {
    if (std::abs(p.x()) < 10.0) scan.push_back(p);  // no end of the map in sight
  }
  const Alignment found = align(scan, map, motion({0.7, 0.0, 0.0}, 0.0), 1.0, kFinest);
  CHECK(found.free_directions == 1);
  CHECK(found.T_map_scan.translation().x() == Approx(0.7).margin(0.01));
  CHECK(found.T_map_scan.translation().y() == Approx(0.1).margin(0.005));
}

TEST_CASE("A search finds a motion that a prediction is too far from") {
  const LocalMap map = map_of(corridor(true, 1, 20000));
  const Pose T = motion({2.2, 0.0, 0.0}, 0.0);
  const Points scan = seen_from(T, corridor(true, 2, 2000));
  CHECK((align(scan, map, Pose::Identity(), kFinest, kFinest).T_map_scan.translation() -
         T.translation())
            .norm() > 0.5);
  CHECK((search(scan, map, Pose::Identity(), kFinest).T_map_scan.translation() - T.translation())
            .norm() < 0.005);
}

TEST_CASE("A scan of another place does not fit") {
  const LocalMap map = map_of(corridor(true, 1, 20000));
  std::mt19937 random(3);
  Points scan;
  for (int i = 0; i < 2000; ++i) {
    const auto coordinate = [&] { return 0.04 * static_cast<double>(random() % 1000); };
    scan.emplace_back(coordinate(), coordinate(), coordinate());
  }
  CHECK(align(scan, map, Pose::Identity(), 1.0, kFinest).fit < 0.2);
  CHECK(align(scan, LocalMap(), Pose::Identity(), 1.0, kFinest).fit == 0.0);
}

TEST_CASE("What is far is forgotten") {
  const Points points = corridor(true, 1, 20000);
  LocalMap map = map_of(points);
  map.forget_beyond({-20.0, 0.0, 0.0}, 15.0);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  CHECK(map.surface_at({-15.0, 0.0, -1.5}, up).direction_count == 1);
  CHECK(map.surface_at({15.0, 0.0, -1.5}, up).direction_count == 0);
}

TEST_CASE("An upright pole is a surface; a ring of the sensor is none") {
  LocalMap map;
  for (int i = 0; i < 20; ++i) map.insert({5.0, 0.0, 0.25 * i});
  for (int i = 0; i < 20; ++i) map.insert({0.0, 20.0 + 0.25 * i, 0.0});
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  CHECK(map.surface_at({5.1, 0.0, 2.0}, up).direction_count == 2);
  CHECK(map.surface_at({0.1, 22.0, 0.0}, up).direction_count == 0);
}

TEST_CASE("Points are moved by the motion between their time and the mean time") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<float> xyz = {5.0F, 0.0F, 1.0F, 5.0F, 0.0F, 1.0F,
                                  5.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F};
  const std::vector<double> offsets = {0.25, 0.1, nan, 0.05};
  Pose T = Pose::Identity();
  T.translation().x() = 2.0;
  T.linear() = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  ScanPreparation preparation(1.0, 100.0);
  preparation.take({xyz.data(), 4, 3}, offsets);
  CHECK(preparation.mean_offset() == Approx(0.175));  // of returns with a time
  const auto point = [&](std::size_t i) {
    return Eigen::Vector3f(preparation.cloud().data + 3 * i).cast<double>().eval();
  };
  for (int turn = 0; turn < 2; ++turn) {  // from the points as they were measured
    preparation.prepare(T, 0.15);
    const Eigen::Vector3d after(1.0 + 5.0 * std::cos(0.1), 5.0 * std::sin(0.1), 1.0);
    CHECK((point(0) - after).norm() < 1e-5);
    const Eigen::Vector3d before(-1.0 + 5.0 * std::cos(0.1), -5.0 * std::sin(0.1), 1.0);
    CHECK((point(1) - before).norm() < 1e-5);
    CHECK(point(2) == Eigen::Vector3d(5.0, 0.0, 1.0));
    CHECK(point(3).isZero(0.0));
  }
  preparation.take({xyz.data(), 4, 3}, {});
  preparation.prepare(T, 0.1);
  CHECK(preparation.mean_offset() == 0.0);
  CHECK(point(0) == Eigen::Vector3d(5.0, 0.0, 1.0));
}

}  // namespace
}  // namespace dynains::odometry
