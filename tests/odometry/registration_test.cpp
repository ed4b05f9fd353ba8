// Registration of known motions, and motions that nothing determines.

#include "dynains/surfaces/scan_registration.hpp"
#include "odometry/scan_preparation.hpp"
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
  const Eigen::Vector3d axis = Eigen::Vector3d(0.1, 0.2, 1.0).normalized();
  return Eigen::Translation3d(translation) * Eigen::AngleAxisd(degrees * M_PI / 180.0, axis);
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

TEST_CASE("An upright pole is a surface, a ring of the sensor is none") {
  SurfaceGrid map;
  for (int i = 0; i < 20; ++i) map.insert({5.0, 0.0, 0.125 * i});
  for (int i = 0; i < 20; ++i) map.insert({0.0, 20.0 + 0.125 * i, 0.0});
  REQUIRE(map.find(2, {5.1, 0.1, 1.1}) != nullptr);
  CHECK(map.find(2, {5.1, 0.1, 1.1})->direction_count == 2);
  CHECK(map.find(2, {0.1, 21.1, 0.0}) == nullptr);
}

TEST_CASE("The surface of a cell does not depend on when it is asked for") {
  const bool is_asked_before = GENERATE(true, false);
  const Eigen::Vector3d middle(0.5, 10.5, 0.5);
  SurfaceGrid map(true);
  map.begin_scan({0.5, 0.0, 0.5});  // in the plane of the points: they may be traces of beams
  for (int i = -4; i <= 4; ++i) {
    for (int k = -4; k <= 4; ++k) map.insert(middle + Eigen::Vector3d(0.0, 0.11 * i, 0.11 * k));
  }
  if (is_asked_before) CHECK(map.find(2, middle) == nullptr);
  map.begin_scan({9.0, 10.0, 0.5});
  CHECK(map.find(2, middle) == nullptr);
}

}  // namespace
}  // namespace dynains::odometry
