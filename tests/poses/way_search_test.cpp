// The way along a road, by what stands beside it.
#include "poses/way_search.hpp"

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "dynains/points.hpp"
#include "support/catch.hpp"

namespace dynains::test {
namespace {

/// Makes the landmarks that a sensor on a road measures on posts beside it and on vehicles ahead.
class Road {
 public:
  explicit Road(unsigned seed) : random_(seed) {
    for (int k = 0; k < 60; ++k) {
      const double side = k % 2 == 0 ? 1.0 : -1.0;
      posts_.emplace_back(draw(-45.0, 45.0), side * draw(6.0, 14.0));
    }
  }

  /// The sensor has moved by `way` (m) since the first scan, and vehicles by `traffic` (m).
  Landmarks seen_after(double way, double traffic) {
    PointBuffer points;
    for (const Eigen::Vector2d& post : posts_) {
      for (int k = 0; k < 8; ++k) add(points, post.x() - way, post.y(), draw(0.0, 3.0));
    }
    for (const double behind : {8.0, 22.0, 37.0}) {
      for (int k = 0; k < 120; ++k) {
        add(points, behind + draw(0.0, 0.6) + traffic - way, draw(-1.0, 1.0), draw(-1.0, 0.5));
      }
    }
    return Landmarks(points, Mounting(), kWayRange);
  }

 private:
  double draw(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }
  void add(PointBuffer& points, double x, double y, double z) {
    std::normal_distribution<double> noise(0.0, 0.02);
    points.push_back(static_cast<float>(x + noise(random_)), static_cast<float>(y + noise(random_)),
                     static_cast<float>(z + noise(random_)));
  }

  std::mt19937 random_;
  std::vector<Eigen::Vector2d> posts_;
};

TEST_CASE("Traffic of nearly the own speed does not shorten the way that posts tell") {
  constexpr double kWay = 2.1;  // m
  const auto seed = GENERATE(1U, 2U, 3U, 4U);
  const auto traffic = GENERATE(0.0, 1.4, 1.7, 2.1, 2.6);
  INFO("seed " << seed << ", traffic moves by " << traffic << " m");
  Road road(seed);
  const Landmarks a = road.seen_after(0.0, 0.0);
  const Landmarks b = road.seen_after(kWay, traffic);
  for (const double guess : {0.0, 1.0, 3.0}) {
    Pose T_a_b = Pose::Identity();
    T_a_b.translation().x() = guess;
    const auto found = search_way(a, b, T_a_b, Eigen::Vector3d::UnitX(), 6.0);
    REQUIRE(found);
    CHECK(found->translation().x() == Approx(kWay).margin(0.03));
  }
}

}  // namespace
}  // namespace dynains::test
