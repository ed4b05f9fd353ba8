// Registration of known motions, and motions that nothing determines.
#include <Eigen/Geometry>
#include <limits>
#include <random>
#include <vector>

#include "odometry/scan_preparation.hpp"
#include "poses/scan_registration.hpp"
#include "support/catch.hpp"

namespace dynains::odometry {
namespace {

using Points = std::vector<Eigen::Vector3d>;

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

SurfaceGrid map_of(const Points& points) {
  SurfaceGrid map(true);
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
  const SurfaceGrid map = map_of(corridor(true, 1, 20000));
  for (const double degrees : {-4.0, 0.0, 4.0}) {
    const Pose T = motion({0.3, -0.2, 0.1}, degrees);
    const Points scan = seen_from(T, corridor(true, 2, 2000));
    const auto found = register_scans(map, scan, {Pose::Identity()});
    REQUIRE(found);
    CAPTURE(degrees, (found->T_a_b.translation() - T.translation()).norm());
    CHECK(found->free_directions == 0);
    CHECK((found->T_a_b.translation() - T.translation()).norm() < 0.005);
    CHECK(angle_between(found->T_a_b, T) < 0.1);
    CHECK(found->score > 0.9);
  }
}

TEST_CASE("Along an open corridor the motion stays the predicted one, and this is told") {
  const SurfaceGrid map = map_of(corridor(false, 1, 20000));
  const Pose T = motion({0.4, 0.1, 0.0}, 0.0);
  Points scan;
  for (const Eigen::Vector3d& p : seen_from(T, corridor(false, 2, 2000))) {
    if (std::abs(p.x()) < 10.0) scan.push_back(p);  // no end of the map in sight
  }
  const auto found = register_near(map, scan, motion({0.7, 0.0, 0.0}, 0.0));
  REQUIRE(found);
  CHECK(found->free_directions == 1);
  CHECK(found->T_a_b.translation().x() == Approx(0.7).margin(0.01));
  CHECK(found->T_a_b.translation().y() == Approx(0.1).margin(0.005));
}

TEST_CASE("The best of several guesses counts") {
  const SurfaceGrid map = map_of(corridor(true, 1, 20000));
  const Pose T = motion({4.2, 0.0, 0.0}, 0.0);
  const Points scan = seen_from(T, corridor(true, 2, 2000));
  const auto error_from = [&](const std::vector<Pose>& guesses) {
    const auto found = register_scans(map, scan, guesses);
    REQUIRE(found);
    return (found->T_a_b.translation() - T.translation()).norm();
  };
  CHECK(error_from({Pose::Identity()}) > 0.5);
  CHECK(error_from({Pose::Identity(), motion({3.0, 0.0, 0.0}, 0.0)}) < 0.005);
}

TEST_CASE("A scan of another place does not fit") {
  const SurfaceGrid map = map_of(corridor(true, 1, 20000));
  std::mt19937 random(3);
  Points scan;
  for (int i = 0; i < 2000; ++i) {
    const auto coordinate = [&] { return 0.04 * static_cast<double>(random() % 1000); };
    scan.emplace_back(coordinate(), coordinate(), coordinate());
  }
  const auto found = register_scans(map, scan, {Pose::Identity()});
  CHECK((found ? found->score : 0.0) < 0.3);
  CHECK_FALSE(register_scans(SurfaceGrid(), scan, {Pose::Identity()}));
}

TEST_CASE("What is far is forgotten") {
  const Points points = corridor(true, 1, 20000);
  SurfaceGrid map = map_of(points);
  map.forget_beyond({-20.0, 0.0, 0.0}, 15.0);
  CHECK(map.find(2, {-15.3, 0.3, -1.5}) != nullptr);
  CHECK(map.find(2, {15.3, 0.3, -1.5}) == nullptr);
}

TEST_CASE("An upright pole is a surface; a ring of the sensor is none") {
  SurfaceGrid map;
  for (int i = 0; i < 20; ++i) map.insert({5.0, 0.0, 0.125 * i});
  for (int i = 0; i < 20; ++i) map.insert({0.0, 20.0 + 0.125 * i, 0.0});
  REQUIRE(map.find(2, {5.1, 0.1, 1.1}) != nullptr);
  CHECK(map.find(2, {5.1, 0.1, 1.1})->direction_count == 2);
  CHECK(map.find(2, {0.1, 21.1, 0.0}) == nullptr);
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
