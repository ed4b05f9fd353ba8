#include "dynains/map/static_map_accumulator.hpp"

#include "dynains/pose.hpp"
#include "support/catch.hpp"
#include "support/points.hpp"
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
    add_point(points, place);
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

TEST_CASE("a map that has moved grows on, and has no copy that would change the original") {
  STATIC_REQUIRE(!std::is_copy_constructible_v<StaticMapAccumulator>);
  STATIC_REQUIRE(!std::is_copy_assignable_v<StaticMapAccumulator>);
  PointBuffer points;
  points.push_back(1.0F, 1.0F, 1.0F);
  StaticMapAccumulator map = make_map(0.2);
  map.insert(points, {}, Pose::Identity());
  StaticMapAccumulator moved = std::move(map);
  points.push_back(1.3F, 1.0F, 1.0F);
  moved.insert(points, {}, Pose::Identity());
  CHECK(sorted_points(moved).size() == 2);
}

TEST_CASE("at UTM coordinates the map keeps a tenth of a millimetre") {
  Random random(11);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  T.translation() = Eigen::Vector3d(500123.4567, 5678901.2345, 321.9876);
  for (int i = 0; i < 200; ++i) {
    PointBuffer one;
    add_point(one, random.vector({-80, -80, -3}, {80, 80, 3}));
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
    map.for_each([&](const Eigen::Vector3d& q) { found += (q - expected).norm() < 0.001 ? 1 : 0; });
    CHECK(found == 1);

    T.translation().x() = std::nextafter(side * kMaxTranslation, side * 1e9);
    CHECK_THROWS_AS(validate_pose("T", T), PoseError);
  }
}

}  // namespace
}  // namespace dynains::test
