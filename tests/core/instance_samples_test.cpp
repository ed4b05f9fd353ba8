// Samples of instances, compared with a slow and simple implementation.
#include "dynains/evidence/instance_samples.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

using namespace detail;

using Place = std::tuple<std::uint32_t, std::int32_t, std::int32_t, std::int32_t>;
using Point = std::array<float, 3>;

struct SampledScan {
  PointBuffer points;
  std::vector<std::uint32_t> instance_of;

  void add(const Point& p, std::uint32_t instance) {
    points.push_back(p[0], p[1], p[2]);
    instance_of.push_back(instance);
  }
  Point point(std::size_t i) const { return {points.x[i], points.y[i], points.z[i]}; }
};

constexpr std::size_t kInstances = 5;

// Points of some instances and points without instance, in a box around the sensor.
SampledScan random_scan(std::uint64_t seed, std::size_t count, double reach) {
  Random random(seed);
  SampledScan scan;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f p =
        random.vector({-reach, -reach, -2.0}, {reach, reach, 2.0}).cast<float>();
    const std::size_t number = random.index(kInstances + 1);
    scan.add({p.x(), p.y(), p.z()},
             number == kInstances ? kNoCluster : static_cast<std::uint32_t>(number));
  }
  return scan;
}

SampledScan shuffled(const SampledScan& scan, std::uint64_t seed) {
  SampledScan result;
  for (const std::size_t i : Random(seed).permutation(scan.points.size())) {
    result.add(scan.point(i), scan.instance_of[i]);
  }
  return result;
}

// The supervoxel that contains a point of an instance.
Place place_of(std::uint32_t instance, const Point& p, float size) {
  const auto cell = [size](float coordinate) {
    return static_cast<std::int32_t>(std::floor(coordinate * (1.0F / size)));
  };
  return {instance, cell(p[0]), cell(p[1]), cell(p[2])};
}
VoxelKey packed(const Place& place) {
  return voxel_key(std::get<1>(place), std::get<2>(place), std::get<3>(place));
}

// The samples of each supervoxel of each instance.
std::map<Place, std::multiset<Point>> by_supervoxel(const InstanceSamples& samples, float size) {
  std::map<Place, std::multiset<Point>> result;
  for (std::uint32_t instance = 0; instance < samples.instance_count(); ++instance) {
    for (std::uint32_t s = samples.supervoxel_begin[instance];
         s < samples.supervoxel_begin[instance + 1]; ++s) {
      REQUIRE(samples.instance_of[s] == instance);
      std::multiset<Point> points;
      for (std::uint32_t p = samples.sample_begin[s]; p < samples.sample_begin[s + 1]; ++p) {
        points.insert({samples.points.x[p], samples.points.y[p], samples.points.z[p]});
      }
      REQUIRE(!points.empty());
      const Place place = place_of(instance, *points.begin(), size);
      REQUIRE(samples.place[s] == packed(place));
      // No supervoxel occurs twice.
      REQUIRE(result.insert({place, points}).second);
    }
  }
  return result;
}

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

// Supervoxel per point.
std::vector<std::uint32_t> supervoxel_of(const InstanceSamples& samples, std::size_t points) {
  REQUIRE(samples.group_of_point.size() == points);
  std::vector<std::uint32_t> result;
  for (const std::uint32_t group : samples.group_of_point) {
    REQUIRE(group <= samples.instance_of.size());
    result.push_back(group <= samples.supervoxel_count() ? group - 1 : kNone);
  }
  return result;
}

TEST_CASE("a supervoxel has as many samples as permitted, and every point has a supervoxel") {
  constexpr float kSize = 0.9F;
  constexpr float kRange = 10.0F;
  const SampledScan scan = random_scan(7, 4000, 12.0);
  for (const std::uint32_t most : {1U, 2U, 3U, 4U, 64U}) {
    CAPTURE(most);
    InstanceSampler sampler(kSize, kRange, most);
    InstanceSamples samples;
    // Twice: the second call must not depend on the first.
    sampler.sample(scan.points, scan.instance_of, kInstances, samples);
    sampler.sample(scan.points, scan.instance_of, kInstances, samples);
    REQUIRE(samples.instance_count() == kInstances);

    const std::vector<std::uint32_t> supervoxels = supervoxel_of(samples, scan.points.size());
    std::map<Place, std::multiset<Point>> points;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const Point p = scan.point(i);
      const bool is_near = p[0] * p[0] + p[1] * p[1] <= kRange * kRange;
      const std::uint32_t instance = scan.instance_of[i];
      REQUIRE((supervoxels[i] != kNone) == (is_near && instance != kNoCluster));
      const std::uint32_t group = samples.group_of_point[i];
      REQUIRE((group == 0 ? kNoCluster : samples.instance_of[group - 1]) == instance);
      if (supervoxels[i] == kNone) continue;
      const Place place = place_of(instance, p, kSize);
      REQUIRE(samples.place[supervoxels[i]] == packed(place));
      points[place].insert(p);
    }
    const auto found = by_supervoxel(samples, kSize);
    REQUIRE(found.size() == points.size());
    for (const auto& [place, chosen] : found) {
      const std::multiset<Point>& all = points.at(place);
      CHECK(chosen.size() == std::min<std::size_t>(most, all.size()));
      CHECK(std::includes(all.begin(), all.end(), chosen.begin(), chosen.end()));
    }
  }
}

TEST_CASE("the choice of samples does not depend on the order of the scan") {
  // Near and crowded, then so wide that memory grows while points are added.
  for (const double reach : {6.0, 60.0}) {
    CAPTURE(reach);
    const SampledScan scan = random_scan(21, 30000, reach);
    InstanceSamples samples, other;
    InstanceSampler sampler(0.9, 100.0, 4);
    sampler.sample(scan.points, scan.instance_of, kInstances, samples);
    const auto expected = by_supervoxel(samples, 0.9F);
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const SampledScan again = shuffled(scan, seed);
      sampler.sample(again.points, again.instance_of, kInstances, other);
      CHECK((by_supervoxel(other, 0.9F) == expected));
    }
  }
}

TEST_CASE("a change of the last bit of a coordinate changes few samples") {
  const SampledScan scan = random_scan(5, 30000, 30.0);
  SampledScan moved;
  Random random(6);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    Point p = scan.point(i);
    for (float& x : p) x *= 1.0F + random.uniform_float(-1e-7, 1e-7);
    moved.add(p, scan.instance_of[i]);
  }
  InstanceSamples samples, other;
  InstanceSampler sampler(0.9, 100.0, 4);
  sampler.sample(scan.points, scan.instance_of, kInstances, samples);
  sampler.sample(moved.points, moved.instance_of, kInstances, other);
  const auto number = [](const SampledScan& of, const InstanceSamples& which) {
    std::map<Point, std::size_t> at;
    for (std::size_t i = 0; i < of.points.size(); ++i) at[of.point(i)] = i;
    std::set<std::size_t> chosen;
    for (std::size_t p = 0; p < which.size(); ++p) {
      chosen.insert(at.at({which.points.x[p], which.points.y[p], which.points.z[p]}));
    }
    return chosen;
  };
  const std::set<std::size_t> before = number(scan, samples), after = number(moved, other);
  std::vector<std::size_t> both;
  std::set_intersection(before.begin(), before.end(), after.begin(), after.end(),
                        std::back_inserter(both));
  REQUIRE(before.size() > 5000);
  CHECK(1000 * both.size() > 998 * before.size());
  CHECK(1000 * both.size() > 998 * after.size());
}

TEST_CASE("the number of samples in each part of a supervoxel is proportional to its points") {
  // Points of one supervoxel at a time, twice as many in its right half as in its left half.
  Random random(9);
  SampledScan scan;
  for (int corner = 0; corner < 2000; ++corner) {
    const float x = static_cast<float>(corner % 50), y = static_cast<float>(corner / 50);
    for (int i = 0; i < 30; ++i) {
      const double low = i < 10 ? 0.0 : 0.5;
      scan.add({x + random.uniform_float(low, low + 0.499), y + random.uniform_float(0.0, 0.999),
                random.uniform_float(0.0, 0.999)},
               0);
    }
  }
  InstanceSampler sampler(1.0, 100.0, 4);
  InstanceSamples samples;
  sampler.sample(scan.points, scan.instance_of, 1, samples);
  REQUIRE(samples.size() == 8000);
  std::array<int, 2> halves = {};
  for (std::size_t p = 0; p < samples.size(); ++p) {
    const float x = samples.points.x[p];
    ++halves[x - std::floor(x) < 0.5F ? 0 : 1];
  }
  // 2667 of 8000, give or take four standard deviations.
  CHECK(halves[0] > 2667 - 170);
  CHECK(halves[0] < 2667 + 170);
}

TEST_CASE("beams pass within a quarter of the width of an instance at the height of a sample") {
  SampledScan scan;
  for (const float side : {-0.1F, 0.1F}) scan.add({6.0F - side, 8.0F + side, 0.5F}, 0);  // a pole
  for (const float side : {-0.7F, 0.7F})
    scan.add({6.0F - side, 8.0F + side, 4.1F}, 0);  // its lamps
  InstanceSamples samples;
  const auto reach_with = [&](double edge) {
    InstanceSampler layered(edge, 80.0, 4);
    layered.sample(scan.points, scan.instance_of, 1, samples);
    layered.find_reach(samples);
    std::map<float, float> reach;  // by height
    for (std::size_t i = 0; i < samples.size(); ++i) reach[samples.points.z[i]] = samples.reach[i];
    return reach;
  };
  // Across the direction (0.6, 0.8), sides of `side` along x and y are 1.4 `side` apart.
  const auto layers = reach_with(1.0), one = reach_with(5.0);
  CHECK(layers.at(0.5F) == Approx(0.25 * 0.28 + 0.05).margin(0.002));
  CHECK(layers.at(4.1F) == Approx(0.25 * 1.96 + 0.05).margin(0.01));
  CHECK(one.at(0.5F) == one.at(4.1F));
}

TEST_CASE("a point in another supervoxel than its predecessor is a change") {
  Random random(5);
  InstanceSampler sampler(0.5, 80.0, 1);
  for (const std::size_t count : {1U, 7U, 8U, 9U, 63U, 64U}) {
    for (int round = 0; round < 50; ++round) {
      PointBuffer points;
      for (std::size_t i = 0; i < count; ++i) {
        // Within one voxel, or within a few around the sensor.
        const float reach = random.index(3) == 0 ? 0.6F : 0.1F;
        points.push_back(random.uniform_float(-0.05F, reach), random.uniform_float(-0.05F, reach),
                         random.uniform_float(-0.05F, reach));
      }
      std::uint64_t expected = 1;
      const auto voxel = [&](std::size_t i) {
        return std::array<float, 3>{std::floor(points.x[i] / 0.5F), std::floor(points.y[i] / 0.5F),
                                    std::floor(points.z[i] / 0.5F)};
      };
      for (std::size_t i = 1; i < count; ++i) {
        if (voxel(i) != voxel(i - 1)) expected |= std::uint64_t{1} << i;
      }
      const std::uint64_t all = ~std::uint64_t{0} >> (64 - count);
      REQUIRE((sampler.find_changes(points) & all) == expected);
    }
  }
}

}  // namespace
}  // namespace dynains::test
