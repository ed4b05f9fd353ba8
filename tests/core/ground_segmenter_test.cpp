#include "dynains/ground/ground_segmenter.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "reference_ground.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

// For each point of the scan, whether it is ground. Checks that the split is a permutation of the
// scan, with the points that are not judged behind all others.
std::vector<bool> ground_of(GroundSegmenter& segmenter, PointsView scan) {
  GroundSplit split;
  std::vector<std::uint32_t> numbers(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) numbers[i] = static_cast<std::uint32_t>(7 * i + 3);
  segmenter.segment(scan, numbers, split);
  REQUIRE(split.count <= scan.size());
  REQUIRE(split.ground_count <= split.count);
  const GroundConfig& config = segmenter.config();
  std::vector<bool> result(scan.size());
  std::vector<bool> seen(scan.size(), false);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    REQUIRE(split.input[i] % 7 == 3);
    const std::size_t from = split.input[i] / 7;
    REQUIRE((from < scan.size() && !seen[from]));
    seen[from] = true;
    REQUIRE(split.points.x[i] == scan.x[from]);
    REQUIRE(split.points.y[i] == scan.y[from]);
    REQUIRE(split.points.z[i] == scan.z[from]);
    const auto lowest = static_cast<float>(-config.noise_depth * config.sensor_height);
    const bool is_noise = config.noise_depth > 0.0 && scan.z[from] < lowest;
    REQUIRE(is_noise == (i >= split.count));
    result[from] = i < split.ground_count;
  }
  return result;
}

std::vector<bool> ground_of(const GroundConfig& config, PointsView scan) {
  GroundSegmenter segmenter(config);
  return ground_of(segmenter, scan);
}

PointBuffer buffer_of(const std::vector<Eigen::Vector3f>& points) {
  PointBuffer result;
  for (const Eigen::Vector3f& p : points) result.push_back(p.x(), p.y(), p.z());
  return result;
}

// Ground with waves, noise and bushes.
PointBuffer rough_terrain(std::uint64_t seed, std::size_t count) {
  Random random(seed);
  PointBuffer result;
  for (std::size_t i = 0; i < count; ++i) {
    const double range = random.uniform(0.5, 110.0);
    const double azimuth = random.uniform(-M_PI, M_PI);
    const double x = range * std::cos(azimuth);
    const double y = range * std::sin(azimuth);
    double z = -kSensorHeight + 0.02 * x + 0.8 * std::sin(0.1 * y) + random.uniform(-0.05, 0.05);
    if (random.index(5) == 0) z += random.uniform(0.0, 3.0);
    if (random.index(50) == 0) z -= random.uniform(0.0, 2.0);
    result.push_back(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
  }
  return result;
}

double share_of_differences(const std::vector<bool>& a, const std::vector<bool>& b) {
  std::size_t different = 0;
  for (std::size_t i = 0; i < a.size(); ++i) different += a[i] != b[i] ? 1U : 0U;
  return static_cast<double>(different) / static_cast<double>(a.size());
}

// Only points on a border of a patch or of a plane may differ, because moments and angles are
// floats.
constexpr double kOnBorders = 1e-3;

TEST_CASE("ground equals that of Patchwork in double precision") {
  GroundSegmenter segmenter(GroundConfig::paper());  // one object for all scans, as in the pipeline
  const auto compare = [&](PointsView scan) {
    const std::vector<bool> expected = reference_ground(segmenter.config(), scan);
    const auto ground = std::count(expected.begin(), expected.end(), true);
    REQUIRE(ground > static_cast<std::ptrdiff_t>(scan.size() / 4));  // otherwise nothing is tested
    REQUIRE(share_of_differences(ground_of(segmenter, scan), expected) < kOnBorders);
  };
  for (const double yaw : {0.0, 2.0}) {
    compare(buffer_of(yard_with(van(10.0, 3.0)).scan(sensor_at(0.0, 0.0, yaw), 0.0).points));
  }
  for (std::uint64_t seed = 1; seed <= 4; ++seed) compare(rough_terrain(seed, 60000));
}

// All points are below the first plane, which was fitted to the seeds only.
TEST_CASE("a slope that flattens within its patch is fitted again") {
  GroundConfig config = GroundConfig::paper();
  const double depth = (config.ground_max_range - config.ground_min_range) / 8.0;  // outer rings
  const double begin = 0.5 * (config.ground_min_range + config.ground_max_range);
  Random random(3);
  PointBuffer scan;
  for (int i = 0; i < 40000; ++i) {
    const double range = random.uniform(begin, config.ground_max_range);
    const double azimuth = random.uniform(-M_PI, M_PI);
    const double ahead = std::fmod(range - begin, depth);
    const double z = -kSensorHeight + 0.48 * ahead - 0.02 * ahead * ahead;
    scan.push_back(static_cast<float>(range * std::cos(azimuth)),
                   static_cast<float>(range * std::sin(azimuth)), static_cast<float>(z));
  }
  const std::vector<bool> expected = reference_ground(config, scan);
  const auto ground = std::count(expected.begin(), expected.end(), true);
  REQUIRE(ground > 10000);
  REQUIRE(ground < 35000);
  CHECK(share_of_differences(ground_of(config, scan), expected) < kOnBorders);
}

TEST_CASE("ground equals that of Patchwork for other parameters") {
  GroundConfig config;
  config.sensor_height = 0.6;
  config.ground_min_range = 2.0;
  config.ground_max_range = 60.0;
  config.ground_iterations = 1;
  config.ground_lowest_points = 64;
  config.ground_min_points = 3;
  config.ground_seed_margin = 0.2;
  config.ground_distance = 0.3;
  config.ground_uprightness = 0.99;
  config.ground_elevation = {0.1, 0.1, 0.1, 0.1};
  config.ground_flatness = {1e-2, 1e-2, 1e-2, 1e-2};
  const PointBuffer scan = rough_terrain(9, 60000);
  CHECK(share_of_differences(ground_of(config, scan), reference_ground(config, scan)) < kOnBorders);
}

// Terraces of a few patches each on a slope.
TEST_CASE("patches far above their neighbours are not ground, as in the reference") {
  Random random(5);
  std::vector<double> terrace(13 * 10);
  for (double& height : terrace) height = random.index(3) == 0 ? random.uniform(0.3, 1.0) : 0.0;
  PointBuffer scan;
  for (int i = 0; i < 80000; ++i) {
    const double range = random.uniform(0.5, 110.0);
    const double azimuth = random.uniform(-M_PI, M_PI);
    const double x = range * std::cos(azimuth), y = range * std::sin(azimuth);
    const auto place = static_cast<std::size_t>((azimuth + M_PI) / 0.5) * 10 +
                       static_cast<std::size_t>(range / 11.5);
    scan.push_back(static_cast<float>(x), static_cast<float>(y),
                   static_cast<float>(-kSensorHeight + 0.02 * x + terrace[place]));
  }
  GroundConfig config = GroundConfig::paper();
  const std::vector<bool> patchwork = ground_of(config, scan);
  config.ground_step = 0.5;
  const std::vector<bool> expected = reference_ground(config, scan);
  REQUIRE(share_of_differences(patchwork, expected) > 10 * kOnBorders);
  CHECK(share_of_differences(ground_of(config, scan), expected) < kOnBorders);
}

TEST_CASE("a flat floor is ground, pillars and vans are not") {
  const Scan scan = yard_with(van(10.0, 3.0)).scan(sensor_at(0.0), 0.0);
  const std::vector<bool> ground = ground_of(GroundConfig(), buffer_of(scan.points));
  std::size_t missed = 0;
  std::size_t wrong = 0;
  std::size_t high = 0;
  for (std::size_t i = 0; i < ground.size(); ++i) {
    const bool is_floor = scan.object[i] == kGroundObject;
    if (is_floor && !ground[i]) ++missed;
    if (!is_floor && scan.points[i].z() > -kSensorHeight + 0.3) {
      ++high;
      if (ground[i]) ++wrong;
    }
  }
  REQUIRE(high > 5000);
  CHECK(missed < ground.size() / 100);
  CHECK(wrong < high / 1000);
}

// 400 points of the plane z = -h + slope * (x - 10) in the patch around (10, 0.6).
PointBuffer patch_of_plane(double slope, std::size_t count = 400, double lift = 0.0) {
  Random random(3);
  PointBuffer points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = random.uniform(9.8, 10.8);
    points.push_back(static_cast<float>(x), random.uniform_float(0.3, 0.9),
                     static_cast<float>(-kSensorHeight + lift + slope * (x - 10.3)));
  }
  return points;
}

TEST_CASE("ground_elevation counts from the ground of the sensor, given or estimated") {
  // 0.6 m above the ground of a sensor as high as kSensorHeight, 0.1 m below that of a lower one.
  const PointBuffer points = patch_of_plane(0.0, 400, 0.6);
  GroundConfig config;
  config.ground_elevation[1] = 0.5;
  config.ground_flatness[1] = 0.0;
  SensorModel low = SensorModel::typical();
  low.height = kSensorHeight - 0.7;
  GroundSegmenter found(config);
  CHECK(found.needs_sensor());
  CHECK_FALSE(ground_of(found, points)[0]);
  found.adapt(low);
  CHECK(ground_of(found, points)[0]);
  config.sensor_height = kSensorHeight;
  GroundSegmenter given(config);
  CHECK_FALSE(given.needs_sensor());
  given.adapt(low);
  CHECK_FALSE(ground_of(given, points)[0]);
}

TEST_CASE("reflections under the floor do not pull the ground down near the sensor") {
  PointBuffer points = patch_of_plane(0.0);
  for (int i = 0; i < 2; ++i) points.push_back(10.3F, 0.6F, -3.0F);
  GroundConfig config;
  config.ground_lowest_points = 2;
  CHECK(ground_of(config, points)[0]);
  config.ground_below = 10.0;  // the two points seed the plane, and no other is near it
  CHECK_FALSE(ground_of(config, points)[0]);
}

}  // namespace
}  // namespace dynains::test
