#include "dynains/map/static_map_accumulator.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include "dynains/pose.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

using Coordinates = std::array<double, 3>;

StaticMapAccumulator make_map(double voxel) {
  StaticMapAccumulator::Config config;
  config.map_voxel = voxel;
  return StaticMapAccumulator(config);
}

std::vector<Coordinates> sorted_points(const StaticMapAccumulator& map) {
  std::vector<Coordinates> result;
  map.for_each([&](const Eigen::Vector3d& p) { result.push_back({p.x(), p.y(), p.z()}); });
  std::sort(result.begin(), result.end());
  return result;
}

// Eq. 1 on a grid: keeps the first point of every voxel.
class ReferenceMap {
 public:
  explicit ReferenceMap(double voxel) : voxel_(voxel) {}

  void insert(PointsView points, Span<const std::uint8_t> keep, const Eigen::Isometry3d& T) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!keep.empty() && keep[i] == 0) continue;
      const Eigen::Vector3d p = T * Eigen::Vector3d(points.x[i], points.y[i], points.z[i]);
      const auto at = [&](double value) { return static_cast<std::int64_t>(std::floor(value)); };
      first_.try_emplace({at(p.x() / voxel_), at(p.y() / voxel_), at(p.z() / voxel_)},
                         Coordinates{p.x(), p.y(), p.z()});
    }
  }

  std::vector<Coordinates> sorted_points() const {
    std::vector<Coordinates> result;
    for (const auto& [key, point] : first_) result.push_back(point);
    std::sort(result.begin(), result.end());
    return result;
  }

 private:
  double voxel_;
  std::map<std::array<std::int64_t, 3>, Coordinates> first_;
};

// Multiples of 1/64 m: every sum and product below is exact in floats, in the map and in the test.
Eigen::Vector3d grid_vector(Random& random, double reach, double height) {
  const Eigen::Vector3d most(reach, reach, height);
  return (random.vector(-most, most) * 64.0).array().round() / 64.0;
}

// Half of the points are near their predecessor, like neighbours in a scan.
PointBuffer grid_points(Random& random, std::size_t count, double reach) {
  PointBuffer points;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    place = random.index(2) == 0 ? grid_vector(random, reach, 4.0)
                                 : place + grid_vector(random, 0.125, 0.125);
    const Eigen::Vector3f p = place.cast<float>();
    points.push_back(p.x(), p.y(), p.z());
  }
  return points;
}

Eigen::Isometry3d quarter_turns(int count, const Eigen::Vector3d& translation) {
  Eigen::Matrix3d quarter;
  quarter << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int i = 0; i < count; ++i) T.linear() = T.linear() * quarter;
  T.translation() = translation;
  return T;
}

TEST_CASE("the map holds the first measured point of every voxel, exactly, and nothing else") {
  // The origin, negative coordinates, and UTM coordinates.
  const Eigen::Vector3d origin = GENERATE(values<Eigen::Vector3d>(
      {{0.0, 0.0, 0.0}, {-300.5, 17.25, -8.0}, {412345.25, 5654321.5, 312.75}}));
  for (const double voxel : {0.125, 0.25, 1.0}) {
    StaticMapAccumulator map = make_map(voxel);
    ReferenceMap reference(voxel);
    Random random(7);
    for (int scan = 0; scan < 12; ++scan) {
      const PointBuffer points = grid_points(random, 500 + random.index(17), 20.0);
      std::vector<std::uint8_t> keep(points.size());
      for (std::uint8_t& flag : keep) flag = random.index(4) == 0 ? 0 : 1;
      if (scan % 3 == 0) keep.clear();  // all
      const Eigen::Isometry3d T = quarter_turns(scan, origin + grid_vector(random, 9.0, 0.0));
      map.insert(points, keep, T);
      reference.insert(points, keep, T);
    }
    const std::vector<Coordinates> expected = reference.sorted_points();
    CHECK(map.size() == expected.size());
    CHECK((sorted_points(map) == expected));
  }
}

TEST_CASE("at UTM coordinates the map keeps a tenth of a millimetre") {
  Random random(11);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  T.translation() = Eigen::Vector3d(500123.4567, 5678901.2345, 321.9876);
  for (int i = 0; i < 200; ++i) {
    PointBuffer one;
    const Eigen::Vector3f p = random.vector({-80, -80, -3}, {80, 80, 3}).cast<float>();
    one.push_back(p.x(), p.y(), p.z());
    StaticMapAccumulator single = make_map(0.0);
    single.insert(one, {}, T);
    const Eigen::Vector3d expected = T * Eigen::Vector3d(one.x[0], one.y[0], one.z[0]);
    single.for_each([&](const Eigen::Vector3d& q) { REQUIRE((q - expected).norm() < 1e-4); });
    REQUIRE(single.size() == 1);
  }
}

TEST_CASE("the finest map reaches the farthest pose that is accepted") {
  PointBuffer point;
  point.push_back(100.0F, -100.0F, 100.0F);
  for (const double side : {-1.0, 1.0}) {
    StaticMapAccumulator map = make_map(0.005);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation().setConstant(side * kMaxTranslation);
    CHECK_NOTHROW(validate_pose("T", T));
    map.insert(point, {}, T);
    const Eigen::Vector3d expected = T * Eigen::Vector3d(100.0, -100.0, 100.0);
    std::size_t found = 0;
    map.for_each_in({expected.array() - 0.001, expected.array() + 0.001},
                    [&](const Eigen::Vector3d&) { ++found; });
    CHECK(found == 1);

    T.translation().x() = std::nextafter(side * kMaxTranslation, side * 1e9);
    CHECK_THROWS_AS(validate_pose("T", T), PoseError);
  }
}

TEST_CASE("a region has exactly the points that a filter over the map finds") {
  StaticMapAccumulator map = make_map(0.25);
  Random random(13);
  for (int i = 0; i < 40; ++i) {
    const PointBuffer points = grid_points(random, 300, 30.0);
    map.insert(points, {}, quarter_turns(i, grid_vector(random, 200.0, 0.0)));
  }
  const auto compare = [&](const Eigen::AlignedBox3d& box) {
    std::vector<Coordinates> expected;
    for (const Coordinates& p : sorted_points(map)) {
      if (box.contains(Eigen::Vector3d(p[0], p[1], p[2]))) expected.push_back(p);
    }
    std::vector<Coordinates> found;
    map.for_each_in(box, [&](const Eigen::Vector3d& p) { found.push_back({p.x(), p.y(), p.z()}); });
    std::sort(found.begin(), found.end());
    REQUIRE((found == expected));
    return found.size();
  };
  std::size_t found = 0;
  for (int i = 0; i < 60; ++i) {
    const double size = i % 2 == 0 ? 5.0 : 150.0;  // fewer tiles than the map has, and more
    const Eigen::Vector3d low = random.vector({-230, -230, -5}, {200, 200, -5});
    const Eigen::Vector3d high = low + Eigen::Vector3d(size, size, 10.0);
    found += compare({low, high});
  }
  CHECK(found > 1000);

  // Borders belong to the region: a box of one stored point.
  const Coordinates first = sorted_points(map).front();
  const Eigen::Vector3d p(first[0], first[1], first[2]);
  CHECK(compare({p, p}) == 1);
  const Eigen::Vector3d everywhere = Eigen::Vector3d::Constant(1e300);
  CHECK(compare({-everywhere, everywhere}) == map.size());
  CHECK(compare({everywhere, everywhere}) == 0);
  CHECK(compare(Eigen::AlignedBox3d()) == 0);
}

TEST_CASE("every stored point is found at its place, for any rounding of floats") {
  StaticMapAccumulator map = make_map(0.05);
  Random random(14);
  for (int i = 0; i < 20; ++i) {
    PointBuffer points;
    points.resize(5000);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector3f p = random.vector({-60, -60, -3}, {60, 60, 6}).cast<float>();
      points.x[k] = p.x();
      points.y[k] = p.y();
      points.z[k] = p.z();
      if (i % 2 == 0) continue;
      // On borders of voxels, or beside them by a rounding error.
      points.x[k] = std::round(p.x() * 20.0F) * 0.05F;
      points.y[k] = std::round(p.y() * 20.0F) * 0.05F;
      points.z[k] = std::round(p.z() * 20.0F) * 0.05F;
    }
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.rotate(Eigen::AngleAxisd(i % 2 == 0 ? 0.3 * i : 0.0,
                               random.vector({-1, -1, 1}, {1, 1, 2}).normalized()));
    T.translation() = random.vector({-500, -500, -10}, {500, 500, 10});
    if (i % 2 != 0) T.translation() = (T.translation() * 20.0).array().round() / 20.0;
    map.insert(points, {}, T);
  }
  std::size_t lost = 0;
  map.for_each([&](const Eigen::Vector3d& point) {
    std::size_t found = 0;
    map.for_each_in({point, point}, [&](const Eigen::Vector3d&) { ++found; });
    if (found == 0) ++lost;
  });
  CHECK(map.size() > 90000);
  CHECK(lost == 0);
}

}  // namespace
}  // namespace dynains::test
