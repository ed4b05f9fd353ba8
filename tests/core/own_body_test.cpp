// Returns of the own vehicle, in scans of a drive between pillars.
#include "dynains/sensor/own_body.hpp"

#include "support/catch.hpp"
#include "support/points.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

/// Scans of a drive along pillars, `step` m apart.
std::vector<PointBuffer> drive_past(double step, std::size_t count = 16) {
  std::vector<PointBuffer> scans;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = step * static_cast<double>(i);
    scans.push_back(buffer_of(yard().scan(sensor_at(x, 0.0, 0.02 * x), 0.0).points));
  }
  return scans;
}

/// A plate 0.8 m below the sensor and `length` m long in front of it, missed by some beams.
void add_bonnet(std::vector<PointBuffer>& scans, float length) {
  for (std::size_t i = 0; i < scans.size(); ++i) {
    for (float x = 1.2F; x < length; x += 0.05F) {
      for (float y = -0.6F; y < 0.6F; y += 0.05F) {
        if ((static_cast<int>(20.0F * (x + y)) + static_cast<int>(i)) % 3 == 0) continue;
        scans[i].push_back(x, y, -0.8F);
      }
    }
  }
}

/// A person of 0.4 m width behind the robot, who sways by `sway` m.
void add_follower(std::vector<PointBuffer>& scans, float sway) {
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const float shift = sway * static_cast<float>((5 * i) % 7) / 6.0F;
    for (float y = -0.2F; y < 0.2F; y += 0.03F) {
      for (float z = -1.2F; z < 0.2F; z += 0.05F) scans[i].push_back(-2.0F - shift, y, z);
    }
  }
}

TEST_CASE("A sensor that sees no body judges from the first ground zone on") {
  const OwnBody body = estimate_own_body(drive_past(1.0));
  CHECK(body.known);
  CHECK(body.reach == 0.0);
  CHECK(body.min_range() == 1.0);
}

TEST_CASE("The reach of a body is that of its farthest steady return") {
  const float length = GENERATE(1.6F, 2.4F, 3.9F);
  std::vector<PointBuffer> scans = drive_past(1.0);
  add_bonnet(scans, length);
  const OwnBody body = estimate_own_body(scans);
  CHECK(body.min_range() > length);
  CHECK(body.min_range() < length + 0.8);
  CHECK(body.min_range() == Approx(body.reach + 0.3));
}

TEST_CASE("Somebody who follows the robot is no part of it, unless he keeps still in its frame") {
  std::vector<PointBuffer> scans = drive_past(1.0);
  SECTION("a person") {
    add_follower(scans, 0.5F);
    CHECK(estimate_own_body(scans).reach == 0.0);
  }
  SECTION("a mast") {
    add_follower(scans, 0.0F);
    CHECK(estimate_own_body(scans).reach == Approx(2.0).margin(0.05));
  }
}

/// Two walls, 1.4 m to each side of a sensor on the line between them.
void add_corridor(std::vector<PointBuffer>& scans) {
  for (PointBuffer& scan : scans) {
    for (float x = -8.0F; x < 8.0F; x += 0.04F) {
      for (float z = -1.2F; z < 0.4F; z += 0.1F) {
        scan.push_back(x, 1.4F, z);
        scan.push_back(x, -1.4F, z);
      }
    }
  }
}

TEST_CASE("What keeps its place in the world is no body, and the body is found beside it") {
  const double step = GENERATE(0.0, 0.4);  // m
  std::vector<PointBuffer> scans = drive_past(step);
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    poses.emplace_back(Eigen::Translation3d(step * static_cast<double>(i), 0.0, 0.0));
  }
  add_corridor(scans);
  CHECK(estimate_own_body(scans).reach > 1.3);
  CHECK(estimate_own_body(scans, poses).reach == 0.0);
  for (PointBuffer& scan : scans) {
    for (float z = -0.9F; z < -0.2F; z += 0.03F) {
      for (float y = -0.2F; y < 0.2F; y += 0.03F) scan.push_back(-1.0F, y, z);
    }
  }
  const double reach = estimate_own_body(scans, poses).reach;
  CHECK(reach == Approx(step > 0.0 ? 1.0 : 0.0).margin(0.05));
}

TEST_CASE("Few scans tell nothing of the body") {
  CHECK_FALSE(estimate_own_body(drive_past(1.0, 7)).known);
  CHECK(estimate_own_body(drive_past(1.0, 8)).known);
  CHECK_FALSE(estimate_own_body({}).known);
  CHECK(estimate_own_body(std::vector<PointBuffer>(8)).reach == 0.0);
}

}  // namespace
}  // namespace dynains::test
