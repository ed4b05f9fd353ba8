#include "viewer/sightings.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "support/catch.hpp"

namespace {

using dynains::viewer::ReferenceWindow;
using dynains::viewer::SightingFinder;
using dynains::viewer::Sightings;
using dynains::viewer::ViewPoint;

/// A plate across the x axis, as x y z intensity, seen under 11 deg, with a point every 0.11 deg.
std::vector<float> plate(float x) {
  std::vector<float> xyzi;
  for (int i = -50; i <= 50; ++i) {
    for (int k = -50; k <= 50; ++k) {
      const float step = 0.002F * x;
      xyzi.insert(xyzi.end(), {x, step * static_cast<float>(i), step * static_cast<float>(k), 0});
    }
  }
  return xyzi;
}

ViewPoint point_of_scan(std::uint16_t scan, float x) {
  ViewPoint point;
  point.local = Eigen::Vector3f(x, 0, 0);
  point.scan = scan;
  return point;
}

}  // namespace

TEST_CASE("A beam passes through a place, returns there, or ends before it") {
  const std::vector<ViewPoint> points{point_of_scan(2, 10.0F)};
  SightingFinder finder(points, ReferenceWindow(4, 6, 2));
  const Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  finder.compare(0, T, plate(20.0F));   // bit 0
  finder.compare(2, T, plate(20.0F));   // its own scan
  finder.compare(4, T, plate(10.2F));   // bit 2
  finder.compare(6, T, plate(5.0F));    // hides the place
  finder.compare(8, T, {});             // looks elsewhere
  finder.compare(10, T, plate(20.0F));  // too late
  const std::vector<Sightings> found = finder.take();
  REQUIRE(found.size() == 1);
  CHECK(found[0].passed == 0b00001);
  CHECK(found[0].returned == 0b00100);
}

TEST_CASE("Sightings follow the pose of the sensor") {
  const std::vector<ViewPoint> points{point_of_scan(0, 10.0F), point_of_scan(0, -10.0F)};
  SightingFinder finder(points, ReferenceWindow(0, 10, 1));
  Eigen::Isometry3d T_local_sensor = Eigen::Isometry3d::Identity();
  T_local_sensor.translation() = Eigen::Vector3d(4, 0, 0);
  T_local_sensor.linear() = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  finder.compare(3, T_local_sensor.inverse(), plate(30.0F));  // looks along -x
  const std::vector<Sightings> found = finder.take();
  CHECK((found[0].passed | found[0].returned) == 0);
  CHECK(found[1].passed == 0b1000);
}

TEST_CASE("Points that are no numbers, or at the sensor, say nothing") {
  const std::vector<ViewPoint> points{point_of_scan(0, 10.0F), point_of_scan(0, 0.0F)};
  SightingFinder finder(points, ReferenceWindow(0, 10, 1));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  finder.compare(1, Eigen::Isometry3d::Identity(), {nan, 0, 0, 0, 0, 0, 0, 0});
  for (const Sightings& sightings : finder.take()) {
    CHECK((sightings.passed | sightings.returned) == 0);
  }
}

TEST_CASE("A window has at most 64 references, the newest") {
  const std::uint16_t scan = 1000;
  for (const auto& [lookback, lookahead, step] : std::vector<std::array<std::size_t, 3>>{
           {100, 30, 2}, {200, 100, 1}, {0, 0, 3}, {100, 30, 10}}) {
    const ReferenceWindow window(lookback, lookahead, step);
    std::size_t count = 0;
    for (std::size_t reference = 0; reference < 2000; reference += step) {
      if (!window.contains(scan, reference)) continue;
      ++count;
      REQUIRE(reference >= window.first(scan));
      CHECK((reference - window.first(scan)) / step < ReferenceWindow::kMost);
      CHECK(reference + lookback >= scan);
      CHECK(reference <= scan + lookahead);
    }
    CHECK(count <= ReferenceWindow::kMost);
    if (step == 10) CHECK(count == 13);  // of 900 to 1030, without 1000
  }
  CHECK(ReferenceWindow(100, 30, 2).first(0) == 0);
  CHECK(ReferenceWindow(100, 30, 2).first(111) == 16);  // not 111 - 96
}
