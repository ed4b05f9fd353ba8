#include "dynains/map/rebasable_static_map.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <vector>

#include "dynains/errors.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

using Coordinates = std::array<double, 3>;

RebasableStaticMap make_rebasable(double voxel) {
  RebasableStaticMap::Config config;
  config.map_voxel = voxel;
  config.scan_voxel = 1.5 * voxel;
  return RebasableStaticMap(config);
}

std::vector<Coordinates> points_of(const RebasableStaticMap& map) {
  std::vector<Coordinates> result;
  map.for_each([&](const Eigen::Vector3d& p) { result.push_back({p.x(), p.y(), p.z()}); });
  return result;
}

struct TestScan {
  PointBuffer points;
  std::vector<std::uint8_t> keep;
};

TestScan random_scan(Random& random) {
  TestScan scan;
  for (std::size_t i = 0; i < 200; ++i) {
    const Eigen::Vector3f p = random.vector({-6, -6, -1}, {6, 6, 2}).cast<float>();
    scan.points.push_back(p.x(), p.y(), p.z());
    scan.keep.push_back(random.index(5) == 0 ? 0 : 1);
  }
  if (random.index(4) == 0) scan.keep.clear();
  return scan;
}

Eigen::Isometry3d random_pose(Random& random) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d axis = random.vector({-1, -1, -1}, {1, 1, 1});
  T.linear() =
      Eigen::Quaterniond(1.0, axis.x(), axis.y(), axis.z()).normalized().toRotationMatrix();
  T.translation() = random.vector({-15, -15, -2}, {15, 15, 2});
  return T;
}

/// The definition of the map, point by point.
std::map<std::array<std::int64_t, 3>, Coordinates> reference_of(const std::vector<TestScan>& scans,
                                                                const std::vector<Pose>& poses,
                                                                double voxel) {
  const auto voxel_of = [](const Eigen::Vector3d& p, double edge) {
    return std::array<std::int64_t, 3>{static_cast<std::int64_t>(std::floor(p.x() / edge)),
                                       static_cast<std::int64_t>(std::floor(p.y() / edge)),
                                       static_cast<std::int64_t>(std::floor(p.z() / edge))};
  };
  std::map<std::array<std::int64_t, 3>, Coordinates> world;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    std::map<std::array<std::int64_t, 3>, bool> own;
    const PointBuffer& points = scans[s].points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!scans[s].keep.empty() && scans[s].keep[i] == 0) continue;
      const Eigen::Vector3d p(points.x[i], points.y[i], points.z[i]);
      if (!own.emplace(voxel_of(p, 1.5 * voxel), true).second) continue;
      const Eigen::Vector3d q = poses[s] * p;
      world.try_emplace(voxel_of(q, voxel), Coordinates{q.x(), q.y(), q.z()});
    }
  }
  return world;
}

}  // namespace

TEST_CASE("After any insertions and updates the map equals a new one with the last poses") {
  const unsigned seed = GENERATE(range(1U, 9U));
  const double voxel = seed % 2 == 0 ? 0.25 : 0.4;
  Random random(seed);
  RebasableStaticMap map = make_rebasable(voxel);
  std::vector<TestScan> scans;
  std::vector<Pose> poses;
  for (int step = 0; step < 40; ++step) {
    if (scans.empty() || random.index(2) == 0) {
      scans.push_back(random_scan(random));
      poses.push_back(random_pose(random));
      map.insert(scans.back().points, scans.back().keep, poses.back());
      continue;
    }
    std::vector<ScanPose> updates;
    const std::size_t count = random.index(scans.size() + 2);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t scan = random.index(scans.size());  // some scans twice
      updates.push_back({scan, random_pose(random)});
      poses[scan] = updates.back().T_world_sensor;
    }
    map.update_poses(updates);
  }
  RebasableStaticMap fresh = make_rebasable(voxel);
  for (std::size_t s = 0; s < scans.size(); ++s) {
    fresh.insert(scans[s].points, scans[s].keep, poses[s]);
  }
  CHECK(points_of(map) == points_of(fresh));
  CHECK(map.size() == fresh.size());

  const auto reference = reference_of(scans, poses, voxel);
  REQUIRE(map.size() == reference.size());
  for (const Coordinates& p : points_of(map)) {
    const auto at = [&](double value) {
      return static_cast<std::int64_t>(std::floor(value / voxel));
    };
    const auto found = reference.find({at(p[0]), at(p[1]), at(p[2])});
    REQUIRE(found != reference.end());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      CHECK(std::abs(found->second[axis] - p[axis]) < 1e-9);
    }
  }

  for (const double half : {0.3, 4.0, 100.0}) {
    const Eigen::Vector3d centre = random.vector({-10, -10, -2}, {10, 10, 2});
    const Eigen::AlignedBox3d box(centre.array() - half, centre.array() + half);
    std::vector<Coordinates> inside;
    map.for_each_in(box, [&](const Eigen::Vector3d& p) {
      inside.push_back({p.x(), p.y(), p.z()});
    });
    std::vector<Coordinates> expected;
    for (const Coordinates& p : points_of(map)) {
      if (box.contains(Eigen::Vector3d(p[0], p[1], p[2]))) expected.push_back(p);
    }
    CHECK(inside == expected);
  }
}

TEST_CASE("Points may be given in another frame than that of the pose") {
  Random random(5);
  const TestScan scan = random_scan(random);
  const Eigen::Isometry3d T_world_sensor = random_pose(random);
  const Eigen::Isometry3d T_points_sensor = random_pose(random);
  PointBuffer turned;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d p(scan.points.x[i], scan.points.y[i], scan.points.z[i]);
    const Eigen::Vector3f q = (T_points_sensor * p).cast<float>();
    turned.push_back(q.x(), q.y(), q.z());
  }
  RebasableStaticMap expected, map;
  expected.insert(scan.points, scan.keep, T_world_sensor);
  map.insert(turned, scan.keep, T_world_sensor * T_points_sensor.inverse(), T_world_sensor);
  const std::vector<Coordinates> a = points_of(expected), b = points_of(map);
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) CHECK(std::abs(a[i][axis] - b[i][axis]) < 1e-4);
  }
}

TEST_CASE("A refused update leaves the map as it was") {
  Random random(3);
  RebasableStaticMap map = make_rebasable(0.3);
  for (int i = 0; i < 5; ++i) {
    const TestScan scan = random_scan(random);
    map.insert(scan.points, scan.keep, random_pose(random));
  }
  const std::vector<Coordinates> before = points_of(map);
  const std::vector<ScanPose> unknown = {{0, random_pose(random)}, {5, random_pose(random)}};
  CHECK_THROWS_AS(map.update_poses(unknown), UsageError);
  std::vector<ScanPose> invalid = {{0, random_pose(random)}, {1, random_pose(random)}};
  invalid[1].T_world_sensor.translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(map.update_poses(invalid), PoseError);
  CHECK(points_of(map) == before);
}

TEST_CASE("Scans without points have a number, and clear() begins with scan 0") {
  Random random(4);
  RebasableStaticMap map;
  const Eigen::Isometry3d pose = random_pose(random);
  map.insert({}, {}, pose);
  PointBuffer far;
  far.push_back(1e7F, 0.0F, 0.0F);
  far.push_back(std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F);
  map.insert(far, {}, pose);
  CHECK(map.empty());
  CHECK(map.scan_count() == 2);
  const std::vector<ScanPose> update = {{1, pose}};
  CHECK_NOTHROW(map.update_poses(update));
  map.clear();
  CHECK(map.scan_count() == 0);
  CHECK_THROWS_AS(map.update_poses(update), UsageError);
}

TEST_CASE("A voxel size out of bounds is refused") {
  CHECK_THROWS_AS(make_rebasable(0.0), ConfigError);
  CHECK_THROWS_AS(make_rebasable(11.0), ConfigError);
}

}  // namespace dynains::test
