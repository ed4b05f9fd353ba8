#include "dynains/clusters/cluster_set.hpp"
#include "support/catch.hpp"
#include "support/points.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

TEST_CASE("points of the window are at the place of Eq. 3 in double") {
  // All counts up to three packs of eight, so that tails of every length occur.
  Random random(1);
  for (std::size_t count = 0; count <= 24; ++count) {
    const Eigen::Isometry3d T = random.pose(5.0);
    PointBuffer points;
    for (std::size_t i = 0; i < count; ++i) {
      add_point(points, random.vector({-60, -60, -5}, {60, 60, 10}));
    }
    PolarBuffer window;
    window.append(points, T);
    window.append(points, Eigen::Isometry3d::Identity());
    REQUIRE(window.size() == 2 * count);
    for (std::size_t i = 0; i < 2 * count; ++i) {
      const std::size_t from = i % count;
      const Eigen::Vector3d source(points.x[from], points.y[from], points.z[from]);
      const Eigen::Vector3d p = i < count ? T * source : source;
      const double range = std::hypot(p.x(), p.y());
      REQUIRE(window.range[i] == Approx(range).margin(3e-5));
      const double azimuth = window.azimuth[i] - std::atan2(p.y(), p.x());
      REQUIRE(std::abs(std::remainder(azimuth, 2.0 * M_PI)) < 1e-6 + 3e-5 / range);
      REQUIRE(window.z[i] == Approx(p.z()).margin(3e-5));
    }
  }
}

TEST_CASE("a window that is cleared and refilled contains no old points") {
  PointBuffer points;
  for (int i = 0; i < 20; ++i) points.push_back(3.0F, 4.0F, 1.0F);
  PolarBuffer window;
  window.append(points, Eigen::Isometry3d::Identity());
  window.clear();
  CHECK(window.view().empty());
  window.append(PointsView(points).subview(0, 3), Eigen::Isometry3d::Identity());
  REQUIRE(window.view().size() == 3);
  CHECK(window.view().range[2] == 5.0F);
}

}  // namespace
}  // namespace dynains::test
