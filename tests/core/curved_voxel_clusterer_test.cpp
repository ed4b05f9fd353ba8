#include "dynains/clusters/curved_voxel_clusterer.hpp"

#include <queue>

#include "dynains/clusters/cluster_set.hpp"
#include "polar_test_points.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

// Curved-voxel clustering as in the paper: a map of voxels, breadth-first search over the 26
// neighbours, in double with libm.

/// Coordinates of a point in units of voxels: range, azimuth, elevation.
std::array<double, 3> voxel_coordinates(const CurvedVoxelClusterer::Config& config, double range,
                                        double azimuth, double z) {
  const double azimuths = std::round(360.0 / config.voxel_azimuth);
  return {std::hypot(range, z) / config.voxel_range, (azimuth + M_PI) / (2.0 * M_PI) * azimuths,
          (std::atan2(z, range) + 0.5 * M_PI) / (config.voxel_elevation * kRadiansPerDegree)};
}

std::vector<std::uint32_t> reference_clusters(const CurvedVoxelClusterer::Config& config,
                                              PolarView points) {
  const auto azimuths = static_cast<int>(std::round(360.0 / config.voxel_azimuth));
  using Voxel = std::array<int, 3>;
  std::map<Voxel, std::uint32_t> cluster_of_voxel;
  std::vector<Voxel> voxels(points.size());
  std::vector<bool> is_near(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto at = voxel_coordinates(config, points.range[i], points.azimuth[i], points.z[i]);
    is_near[i] = std::hypot(points.range[i], points.z[i]) <= config.cluster_range;
    if (!is_near[i]) continue;
    voxels[i] = {static_cast<int>(at[0]), static_cast<int>(at[1]) % azimuths,
                 static_cast<int>(at[2])};
    cluster_of_voxel[voxels[i]] = kNoCluster;
  }
  std::vector<std::uint32_t> result(points.size(), kNoCluster);
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_near[i]) continue;
    if (cluster_of_voxel[voxels[i]] == kNoCluster) {
      std::queue<Voxel> open;
      open.push(voxels[i]);
      cluster_of_voxel[voxels[i]] = count;
      while (!open.empty()) {
        const Voxel at = open.front();
        open.pop();
        for (int r = -1; r <= 1; ++r) {
          for (int a = -1; a <= 1; ++a) {
            for (int e = -1; e <= 1; ++e) {
              const auto next =
                  cluster_of_voxel.find({at[0] + r, (at[1] + a + azimuths) % azimuths, at[2] + e});
              if (next == cluster_of_voxel.end() || next->second != kNoCluster) continue;
              next->second = count;
              open.push(next->first);
            }
          }
        }
      }
      ++count;
    }
    result[i] = cluster_of_voxel[voxels[i]];
  }
  return result;
}

using Config = CurvedVoxelClusterer::Config;

// Cluster numbers in order of first appearance, as in the reference. The clusterer itself numbers
// clusters by place, from 0.
std::vector<std::uint32_t> clusters(CurvedVoxelClusterer& clusterer, PolarView points) {
  const auto result = clusterer.cluster(points);
  std::vector<std::uint32_t> renumbered(clusterer.cluster_count(), kNoCluster);
  std::vector<std::uint32_t> cluster_of;
  std::uint32_t count = 0;
  for (const std::uint32_t number : result) {
    if (number != kNoCluster && renumbered.at(number) == kNoCluster) renumbered[number] = count++;
    cluster_of.push_back(number == kNoCluster ? kNoCluster : renumbered[number]);
  }
  REQUIRE(count == clusterer.cluster_count());
  return cluster_of;
}

std::vector<std::uint32_t> clusters(const Config& config, PolarView points) {
  CurvedVoxelClusterer clusterer(config);
  return clusters(clusterer, points);
}

Config with_voxels(double range, double azimuth, double elevation, double reach = 90.0) {
  Config config;
  config.voxel_range = range;
  config.voxel_azimuth = azimuth;
  config.voxel_elevation = elevation;
  config.cluster_range = reach;
  return config;
}

struct Region {
  double range_min, range_max;      // m, three-dimensional distance
  double azimuth_min, azimuth_max;  // deg
  double elevation_min, elevation_max;
};

// Random points, none so near to a voxel border that float and double may choose different voxels.
PolarBuffer random_points(const Config& config, const Region& region, std::size_t count,
                          std::uint64_t seed) {
  constexpr double kMargin = 2e-3;  // voxels
  Random random(seed);
  PolarBuffer points;
  while (points.size() < count) {
    const double distance = random.uniform(region.range_min, region.range_max);
    const double azimuth = random.uniform(region.azimuth_min, region.azimuth_max);
    const double elevation =
        random.uniform(region.elevation_min, region.elevation_max) * kRadiansPerDegree;
    add(points, distance * std::cos(elevation), azimuth > 180.0 ? azimuth - 360.0 : azimuth,
        distance * std::sin(elevation));
    const std::size_t last = points.size() - 1;
    const auto at =
        voxel_coordinates(config, points.range[last], points.azimuth[last], points.z[last]);
    if (off_integer(at[0]) < kMargin || off_integer(at[1]) < kMargin ||
        off_integer(at[2]) < kMargin) {
      points.resize(last);
    }
  }
  return points;
}

TEST_CASE("clusters are those of a breadth-first search over all 26 neighbours") {
  struct Case {
    const char* why;
    Config config;
    Region region;
    std::size_t count;
  };
  const auto c = GENERATE(values<Case>({
      {"a whole scan, sparse", with_voxels(0.5, 0.5, 3.0), {3, 80, -180, 180, -25, 15}, 3000},
      {"clusters nearly touch", with_voxels(1.0, 4.0, 6.0), {3, 40, -180, 180, -25, 15}, 2000},
      {"one dense lump", with_voxels(0.5, 0.5, 3.0), {10, 14, 20, 30, -5, 5}, 2000},
      {"across the azimuth seam", with_voxels(0.5, 2.0, 3.0), {5, 15, 160, 200, -10, 10}, 500},
      {"straight up and down", with_voxels(0.5, 10.0, 3.0), {3, 10, -180, 180, -90, 90}, 1500},
      {"the zenith alone", with_voxels(0.5, 30.0, 5.0), {3, 6, -180, 180, 80, 90}, 100},
      {"tiny voxels", with_voxels(0.05, 0.1, 0.5, 10.0), {5, 7, -5, 5, -5, 5}, 2000},
      {"huge voxels", with_voxels(20.0, 30.0, 45.0), {3, 90, -180, 180, -90, 90}, 40},
      // Sizes that do not divide the circle and the half circle.
      {"azimuth of 7 deg", with_voxels(1.0, 7.0, 3.0), {3, 40, -180, 180, -25, 15}, 700},
      {"elevation of 7 deg", with_voxels(1.0, 5.0, 7.0), {3, 40, -180, 180, -90, 90}, 700},
      // The range of clustering at a border of voxels and within them.
      {"range 30 m", with_voxels(0.5, 2.0, 3.0, 30.0), {25, 35, -180, 180, -10, 10}, 1500},
      {"range 30.3 m", with_voxels(0.5, 2.0, 3.0, 30.3), {25, 35, -180, 180, -10, 10}, 1500},
  }));
  INFO(c.why);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const PolarBuffer points = random_points(c.config, c.region, c.count, seed);
    const auto expected = reference_clusters(c.config, points.view());
    REQUIRE((clusters(c.config, points.view()) == expected));
  }
}

TEST_CASE("a clusterer keeps nothing of the previous scan") {
  const Config config = with_voxels(0.5, 1.0, 3.0);
  CurvedVoxelClusterer clusterer(config);
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    // Alternately many elevations and few, so that the grid grows and shrinks.
    const double half = seed % 2 == 0 ? 2.0 : 60.0;
    const PolarBuffer points =
        random_points(config, {3, 40, -180, 180, -half, half}, 100 * seed, seed);
    REQUIRE((clusters(clusterer, points.view()) == reference_clusters(config, points.view())));
  }
}

TEST_CASE("cluster numbers do not depend on the order of the points") {
  const Config config = with_voxels(0.5, 1.0, 3.0);
  const PolarBuffer points = random_points(config, {3, 40, -180, 180, -20, 20}, 500, 1);
  const auto order = Random(1).permutation(points.size());
  std::vector<PointRange> ranges;
  for (const std::size_t i : order) {
    ranges.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i + 1)});
  }
  const PolarBuffer shuffled = gathered(points.view(), ranges);
  CurvedVoxelClusterer clusterer(config), of_shuffled(config);
  const auto numbers = clusterer.cluster(points.view());
  const auto shuffled_numbers = of_shuffled.cluster(shuffled.view());
  for (std::size_t i = 0; i < order.size(); ++i) {
    REQUIRE(shuffled_numbers[i] == numbers[order[i]]);
  }
}

TEST_CASE("an object behind the sensor is one cluster, +180 and -180 degrees are neighbours") {
  PolarBuffer points;
  add(points, 10.0, 179.9, 0.0);
  add(points, 10.0, -179.9, 0.0);
  add(points, 10.0, 0.0, 0.0);
  points.resize(5);
  points.range[3] = points.range[4] = 10.0F;
  points.z[3] = points.z[4] = 0.0F;
  points.azimuth[3] = detail::kPi;  // both ends of the interval of azimuths
  points.azimuth[4] = -detail::kPi;
  CHECK(clusters(with_voxels(0.5, 0.5, 3.0), points.view()) ==
        std::vector<std::uint32_t>{0, 0, 1, 0, 0});
}

TEST_CASE("a point at exactly the clustering range belongs to a cluster, the next float does not") {
  PolarBuffer points;
  add(points, 90.0, 0.0, 0.0);
  points.resize(2);
  points.range[1] = std::nextafter(90.0F, 100.0F);
  points.azimuth[1] = points.z[1] = 0.0F;
  CHECK(clusters(with_voxels(0.5, 0.5, 3.0), points.view()) ==
        std::vector<std::uint32_t>{0, kNoCluster});
}

TEST_CASE(
    "a point straight below or above the sensor is a cluster, independently of earlier scans") {
  const Config config = with_voxels(0.5, 0.5, 3.0);
  CurvedVoxelClusterer clusterer(config);
  for (const double z : {-5.0, 5.0, -0.1}) {
    PolarBuffer points;
    add(points, 0.0, 0.0, z);
    CHECK(clusters(clusterer, points.view()) == std::vector<std::uint32_t>{0});
    CHECK(clusters(config, points.view()) == std::vector<std::uint32_t>{0});
    const PolarBuffer others = random_points(config, {3, 40, -180, 180, -20, 20}, 200, 1);
    clusters(clusterer, others.view());
  }
}

TEST_CASE("points that are not finite belong to no cluster and change no cluster") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  PolarBuffer points;
  for (int i = 0; i < 5; ++i) add(points, 10.0, 0.0, 0.0);
  points.range[1] = nan;
  points.range[2] = infinity;
  points.z[3] = -infinity;
  CHECK(clusters(with_voxels(0.5, 0.5, 3.0), points.view()) ==
        std::vector<std::uint32_t>{0, kNoCluster, kNoCluster, kNoCluster, 0});
  CHECK(clusters(Config(), PolarView()).empty());
}

TEST_CASE("default voxels are derived from the beams of the sensor, given voxels are kept") {
  SensorModel sensor;
  sensor.azimuth_step = 0.4;
  sensor.elevation_gap = 2.0;
  sensor.elevation_gap_wide = 3.0;
  // 0.75 * (0.4 + 2.0) = 1.8.
  CHECK(Config().resolved(sensor).voxel_azimuth == Approx(1.8));
  CHECK(Config().resolved(sensor).voxel_elevation == Approx(3.0));
  sensor.elevation_gap_wide = 1.0;
  CHECK(Config().resolved(sensor).voxel_elevation == Approx(1.8));
  const Config dense = Config().resolved(SensorModel());
  CHECK(dense.voxel_azimuth == 0.5);
  CHECK(dense.voxel_elevation == 1.0);
  const Config given = with_voxels(0.5, 0.7, 4.0).resolved(sensor);
  CHECK(given.voxel_azimuth == 0.7);
  CHECK(given.voxel_elevation == 4.0);

  CHECK(CurvedVoxelClusterer(with_voxels(0.5, 0.7, 0.0)).needs_sensor());
  CHECK(CurvedVoxelClusterer(with_voxels(0.5, 0.0, 4.0)).needs_sensor());
  CHECK_FALSE(CurvedVoxelClusterer(with_voxels(0.5, 0.7, 4.0)).needs_sensor());

  // Neighbouring voxels of 1.8 deg, but not of 0.5 deg, the default for a typical sensor.
  PolarBuffer points;
  add(points, 10.0, 0.9, 0.0);
  add(points, 10.0, 2.7, 0.0);
  CurvedVoxelClusterer clusterer;
  CHECK(clusters(clusterer, points.view()) == std::vector<std::uint32_t>{0, 1});
  clusterer.adapt(sensor);
  CHECK(clusters(clusterer, points.view()) == std::vector<std::uint32_t>{0, 0});
}

TEST_CASE("voxels of the largest permitted grid are distinguished") {
  // 12 azimuths, 1800 elevations: the row numbers of the grid run into the millions.
  Config config = with_voxels(0.05, 30.0, 0.1, 1000.0);
  double low = 1.0;
  double high = 1000.0;
  for (int i = 0; i < 60; ++i) {  // the farthest range that passes validation
    config.cluster_range = 0.5 * (low + high);
    try {
      config.validate();
      low = config.cluster_range;
    } catch (const ConfigError&) {
      high = config.cluster_range;
    }
  }
  config.cluster_range = low;
  const PolarBuffer points =
      random_points(config, {low - 3.0, low, -180, 180, 88.5, 90.0}, 3000, 1);
  REQUIRE((clusters(config, points.view()) == reference_clusters(config, points.view())));
}

}  // namespace
}  // namespace dynains::test
