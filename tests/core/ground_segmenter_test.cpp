#include "dynains/ground/ground_segmenter.hpp"

#include <Eigen/Dense>

#include "support/catch.hpp"
#include "support/points.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

// A slow implementation of Patchwork: double precision, libm, sorting and Eigen's eigenvalue
// solver. Two rules are additions to Patchwork: planes are fitted to some points of a patch, and
// patches far above their neighbours are not ground.

/// Points to which the plane of a patch is fitted: all, or runs of eight.
std::vector<std::size_t> reference_fit_points(const std::vector<std::size_t>& points,
                                              std::size_t most) {
  if (points.size() <= most) return points;
  std::vector<std::size_t> result;
  const std::size_t runs = most / 8;
  for (std::size_t run = 0; run < runs; ++run) {
    const std::size_t begin = run * points.size() / runs;
    for (std::size_t i = begin; i < begin + 8; ++i) result.push_back(points[i]);
  }
  return result;
}

/// True for every point of the scan that is ground.
std::vector<bool> reference_ground(const GroundSegmenter::Config& config, PointsView scan) {
  const double inner = config.ground_min_range;
  const double outer = config.ground_max_range;
  const double edges[5] = {inner, (7 * inner + outer) / 8, (3 * inner + outer) / 4,
                           (inner + outer) / 2, outer};
  struct Patch {
    bool is_innermost_zone = false;
    std::size_t ring = 0;  // counted from the inside over all zones
    std::vector<std::size_t> points;
    bool is_ground = false;
    double height = 0.0;  // of its ground
    std::vector<std::size_t> members;
  };
  std::map<std::vector<int>, Patch> patches;  // by zone, ring in it and sector
  const auto rings = [](int zone) {
    return detail::ConcentricZones::kRings[static_cast<std::size_t>(zone)];
  };
  const auto sectors = [](int zone) {
    return detail::ConcentricZones::kSectors[static_cast<std::size_t>(zone)];
  };
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double range = std::hypot(scan.x[i], scan.y[i]);
    if (range < inner || range > outer) continue;
    const bool is_noise =
        config.noise_depth > 0.0 &&
        static_cast<double>(scan.z[i]) < -config.noise_depth * config.sensor_height;
    if (is_noise) continue;
    int zone = 3;
    while (range < edges[zone]) --zone;
    const double depth = (edges[zone + 1] - edges[zone]) / rings(zone);
    const double width = 2.0 * M_PI / sectors(zone);
    const int ring = std::min(static_cast<int>((range - edges[zone]) / depth), rings(zone) - 1);
    const double azimuth = std::atan2(scan.y[i], scan.x[i]) + M_PI;
    const int sector = std::min(static_cast<int>(azimuth / width), sectors(zone) - 1);
    int ring_number = ring;
    for (int z = 0; z < zone; ++z) ring_number += rings(z);
    Patch& patch = patches[{zone, ring, sector}];
    patch.is_innermost_zone = zone == 0;
    patch.ring = static_cast<std::size_t>(ring_number);
    patch.points.push_back(i);
  }

  const double h = config.sensor_height;
  for (auto& [key, patch] : patches) {
    if (patch.points.size() < static_cast<std::size_t>(config.ground_min_points)) continue;
    const std::vector<std::size_t> fitted =
        reference_fit_points(patch.points, static_cast<std::size_t>(config.ground_fit_points));
    const auto point = [&](std::size_t i) {
      return Eigen::Vector3d(scan.x[i], scan.y[i], scan.z[i]);
    };
    std::vector<double> heights;
    for (const std::size_t i : fitted) {
      const bool is_noise = patch.is_innermost_zone && scan.z[i] < -(1.0 + config.ground_below) * h;
      if (!is_noise) heights.push_back(scan.z[i]);
    }
    std::sort(heights.begin(), heights.end());
    heights.resize(std::min(heights.size(), static_cast<std::size_t>(config.ground_lowest_points)));
    double seed_height = -(1.0 + config.ground_below) * h;
    if (!heights.empty()) {
      seed_height = 0.0;
      for (const double z : heights) seed_height += z / static_cast<double>(heights.size());
    }

    std::vector<std::size_t> members;
    for (const std::size_t i : fitted) {
      if (scan.z[i] < seed_height + config.ground_seed_margin) members.push_back(i);
    }
    bool is_ground = true;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Vector3d eigenvalues = Eigen::Vector3d::Zero();
    const auto members_of = [&](const std::vector<std::size_t>& points) {
      std::vector<std::size_t> result;
      for (const std::size_t i : points) {
        if (normal.dot(point(i) - mean) < config.ground_distance) result.push_back(i);
      }
      return result;
    };
    for (int iteration = 0; iteration < config.ground_iterations; ++iteration) {
      if (members.size() < 3) {
        is_ground = false;
        break;
      }
      const auto count = static_cast<double>(members.size());
      mean.setZero();
      for (const std::size_t i : members) mean += point(i) / count;
      Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
      for (const std::size_t i : members) {
        covariance += (point(i) - mean) * (point(i) - mean).transpose() / count;
      }
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
      eigenvalues = solver.eigenvalues();
      normal = solver.eigenvectors().col(0);
      if (normal.z() < 0.0) normal = -normal;
      members = members_of(fitted);
    }
    if (!is_ground || normal.z() < config.ground_uprightness) continue;
    if (patch.ring < GroundConfig::kCheckedRings) {
      const double flatness = eigenvalues[0] / eigenvalues.sum();
      if (mean.z() + h > config.ground_elevation[patch.ring] &&
          flatness >= config.ground_flatness[patch.ring]) {
        continue;
      }
    }
    patch.is_ground = true;
    patch.height = mean.z();
    patch.members = members_of(patch.points);
  }

  // Heights of the neighbouring patches in the ring, and of three in each adjacent ring: the one at
  // the middle of the sector and its neighbours.
  const auto heights_around = [&](const std::vector<int>& key) {
    const int zone = key[0], ring = key[1], sector = key[2];
    std::vector<double> heights;
    const auto add = [&](int z, int r, int s) {
      const auto found = patches.find({z, r, (s + sectors(z)) % sectors(z)});
      if (found == patches.end() || !found->second.is_ground) return;
      heights.push_back(found->second.height);
    };
    const auto add_beside = [&](int z, int r) {
      const int s = static_cast<int>((sector + 0.5) / sectors(zone) * sectors(z));
      for (const int step : {-1, 0, 1}) add(z, r, s + step);
    };
    add(zone, ring, sector - 1);
    add(zone, ring, sector + 1);
    if (ring > 0) {
      add_beside(zone, ring - 1);
    } else if (zone > 0) {
      add_beside(zone - 1, rings(zone - 1) - 1);
    }
    if (ring + 1 < rings(zone)) {
      add_beside(zone, ring + 1);
    } else if (zone < 3) {
      add_beside(zone + 1, 0);
    }
    return heights;
  };
  std::vector<bool> result(scan.size(), false);
  for (const auto& [key, patch] : patches) {
    if (!patch.is_ground) continue;
    std::vector<double> heights = heights_around(key);
    std::sort(heights.begin(), heights.end());
    const bool hangs = config.ground_step > 0.0 && key[0] < 3 && heights.size() >= 4 &&
                       heights[heights.size() / 2] < patch.height - config.ground_step;
    if (hangs) continue;
    for (const std::size_t i : patch.members) result[i] = true;
  }
  return result;
}

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

// Random points around the sensor from `begin` to `end` (m), at `height_of(range, azimuth, place)`
// (m) over its ground.
template <class HeightOf>
PointBuffer terrain(Random& random, std::size_t count, double begin, double end,
                    HeightOf&& height_of) {
  PointBuffer result;
  for (std::size_t i = 0; i < count; ++i) {
    const double range = random.uniform(begin, end);
    const double azimuth = random.uniform(-M_PI, M_PI);
    Eigen::Vector3d place = range * ray_of(0.0, azimuth);
    place.z() = height_of(range, azimuth, place) - kSensorHeight;
    add_point(result, place);
  }
  return result;
}

// Ground with waves, noise and bushes.
PointBuffer rough_terrain(std::uint64_t seed) {
  Random random(seed);
  const auto height_of = [&random](double, double, const Eigen::Vector3d& p) {
    double z = 0.02 * p.x() + 0.8 * std::sin(0.1 * p.y()) + random.uniform(-0.05, 0.05);
    if (random.index(5) == 0) z += random.uniform(0.0, 3.0);
    if (random.index(50) == 0) z -= random.uniform(0.0, 2.0);
    return z;
  };
  return terrain(random, 60000, 0.5, 110.0, height_of);
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
  for (std::uint64_t seed = 1; seed <= 4; ++seed) compare(rough_terrain(seed));
}

// All points are below the first plane, which was fitted to the seeds only.
TEST_CASE("a slope that flattens within its patch is fitted again") {
  GroundConfig config = GroundConfig::paper();
  const double depth = (config.ground_max_range - config.ground_min_range) / 8.0;  // outer rings
  const double begin = 0.5 * (config.ground_min_range + config.ground_max_range);
  Random random(3);
  const auto height_of = [&](double range, double, const Eigen::Vector3d&) {
    const double ahead = std::fmod(range - begin, depth);
    return 0.48 * ahead - 0.02 * ahead * ahead;
  };
  const PointBuffer scan = terrain(random, 40000, begin, config.ground_max_range, height_of);
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
  const PointBuffer scan = rough_terrain(9);
  CHECK(share_of_differences(ground_of(config, scan), reference_ground(config, scan)) < kOnBorders);
}

// Terraces of a few patches each on a slope.
TEST_CASE("patches far above their neighbours are not ground, as in the reference") {
  Random random(5);
  std::vector<double> terrace(13 * 10);
  for (double& height : terrace) height = random.index(3) == 0 ? random.uniform(0.3, 1.0) : 0.0;
  const auto height_of = [&](double range, double azimuth, const Eigen::Vector3d& p) {
    const auto place = static_cast<std::size_t>((azimuth + M_PI) / 0.5) * 10 +
                       static_cast<std::size_t>(range / 11.5);
    return 0.02 * p.x() + terrace[place];
  };
  const PointBuffer scan = terrain(random, 80000, 0.5, 110.0, height_of);
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
  std::size_t missed = 0, wrong = 0, high = 0;
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
