#include "dynains/clusters/cluster_set.hpp"

#include "polar_test_points.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

using Point = std::tuple<float, float, float>;

std::vector<Point> points_of(PolarView view) {
  std::vector<Point> result;
  for (std::size_t i = 0; i < view.size(); ++i) {
    result.emplace_back(view.range[i], view.azimuth[i], view.z[i]);
  }
  return result;
}

std::vector<Point> points_of(PolarView window, Span<const PointRange> ranges) {
  return points_of(gathered(window, ranges).view());
}

TEST_CASE("S_k of every comparable cluster holds exactly the points of Eq. 4, in input order") {
  ClusterSet clusters;  // one object for all scans, as in the pipeline
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    const std::size_t scans = 1 + random.index(5);
    const std::size_t count = random.index(30);
    PolarBuffer window;
    std::vector<std::uint32_t> scan_begin = {0};
    std::vector<std::uint32_t> cluster_of;
    std::map<std::pair<std::size_t, std::size_t>, std::vector<Point>> expected;
    for (std::size_t k = 0; k < scans; ++k) {
      const std::size_t points = random.index(60);
      for (std::size_t i = 0; i < points; ++i) {
        const Eigen::Vector3d p = random.vector({1, -180, -2}, {50, 180, 2});
        add(window, p.x(), p.y(), p.z());
        const std::size_t c = random.index(count + 1);
        cluster_of.push_back(c == count ? kNoCluster : static_cast<std::uint32_t>(c));
        if (c != count) expected[{c, k}].push_back(points_of(window.view()).back());
      }
      scan_begin.push_back(static_cast<std::uint32_t>(window.size()));
    }
    clusters.build(window.view(), scan_begin, cluster_of, count);
    REQUIRE(clusters.size() == count);
    REQUIRE(clusters.scan_count() == scans);
    for (std::size_t c = 0; c < count; ++c) {
      const bool comparable =
          scans > 1 && !expected[{c, 0}].empty() && !expected[{c, scans - 1}].empty();
      REQUIRE(clusters.comparable(c) == comparable);
      if (!comparable) {
        REQUIRE(clusters[c].ranges.empty());
        continue;
      }
      std::vector<Point> all;
      for (std::size_t k = 0; k < scans; ++k) {
        const auto& part = expected[{c, k}];
        REQUIRE((points_of(clusters[c].window, clusters[c].scan(k)) == part));
        all.insert(all.end(), part.begin(), part.end());
      }
      REQUIRE((points_of(clusters[c].window, clusters[c].ranges) == all));
    }
  }
}

TEST_CASE("a cluster of the newest scan and any other is compared on demand") {
  PolarBuffer window;
  for (int i = 0; i < 8; ++i) add(window, 10.0, 0.0, 0.0);
  const std::vector<std::uint32_t> scan_begin = {0, 2, 5, 8};
  // Cluster 0: middle and newest. 1: oldest and middle. 2: newest alone. 3: oldest and newest.
  const std::vector<std::uint32_t> cluster_of = {1, 3, 1, 0, 1, 0, 2, 3};
  ClusterSet clusters;
  clusters.build(window.view(), scan_begin, cluster_of, 4, Comparison::kAnyBefore);
  CHECK(clusters.comparable(0));
  CHECK(clusters[0].oldest() == 1);
  CHECK(clusters[0].ranges.size() == 2);
  CHECK_FALSE(clusters.comparable(1));
  CHECK_FALSE(clusters.comparable(2));
  CHECK(clusters.comparable(3));
  CHECK(clusters[3].oldest() == 0);
}

}  // namespace
}  // namespace dynains::test
