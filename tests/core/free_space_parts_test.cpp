// The parts of the free-space evidence, each compared with a slow and simple implementation.

#include "dynains/evidence/ground_samples.hpp"
#include "dynains/evidence/instance_judge.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/instance_tracks.hpp"
#include "dynains/evidence/moved_ground.hpp"
#include "dynains/evidence/reference_scans.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "support/catch.hpp"
#include "support/points.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

using namespace detail;

constexpr std::uint32_t kNoLimit = 64;

// The distances of the compared references if one scan of `step` has an image.
std::vector<int> reference_lags(int most, int remainder, int step, int above = 0) {
  std::vector<int> lags;
  for (int age = 1; age <= 200; ++age) {
    if (age % step == remainder % step && is_compared(age, step, most, above)) lags.push_back(age);
  }
  return lags;
}

TEST_CASE("references are the nearest scans with an image behind the wanted ones") {
  using Lags = std::vector<int>;
  CHECK(reference_lags(30, 0, 1) == Lags{2, 4, 6, 8, 10, 13, 16, 20, 25, 30});
  CHECK(reference_lags(29, 0, 1) == Lags{2, 4, 6, 8, 10, 13, 16, 20, 25});
  // One scan of three has an image. The scan 30 before scan 31 is scan 1; scan 0 is the next with
  // an image.
  CHECK(reference_lags(31, 1, 3) == Lags{4, 7, 10, 13, 16, 22, 25, 31});
  CHECK(reference_lags(30, 1, 3) == Lags{4, 7, 10, 13, 16, 22, 25, 28});
  // Two lags that lead to one scan count once.
  CHECK(reference_lags(25, 0, 10) == Lags{10, 20});
  CHECK(reference_lags(0, 0, 1).empty());
  CHECK(reference_lags(2, 0, 3).empty());
  CHECK(reference_lags(-2, 1, 3).empty());
  // Only lags above a limit.
  CHECK(reference_lags(100, 3, 10, 31) == Lags{43, 53, 73, 83, 93});
  CHECK(reference_lags(35, 9, 10, 31).empty());
}

// Supervoxels with the given number of samples at the given places, all of one instance.
InstanceSamples supervoxels_at(const std::vector<std::array<int, 3>>& places, int samples_each) {
  InstanceSamples samples;
  samples.sample_begin.push_back(0);
  for (const auto& p : places) {
    samples.place.push_back(voxel_key(p[0], p[1], p[2]));
    samples.sample_begin.push_back(samples.sample_begin.back() +
                                   static_cast<std::uint32_t>(samples_each));
  }
  samples.supervoxel_begin = {0, static_cast<std::uint32_t>(places.size())};
  return samples;
}

TEST_CASE("groups of random supervoxels are those of a search over all pairs") {
  Random random(3);
  SupervoxelGroups groups;
  for (int round = 0; round < 50; ++round) {
    std::set<std::array<int, 3>> places;
    for (int i = 0; i < 60; ++i) {
      places.insert({static_cast<int>(random.index(8)) - 4, static_cast<int>(random.index(8)) - 4,
                     static_cast<int>(random.index(4)) - 2});
    }
    const std::vector<std::array<int, 3>> all(places.begin(), places.end());
    const InstanceSamples samples = supervoxels_at(all, 1);
    std::vector<std::size_t> group(all.size());
    for (std::size_t i = 0; i < all.size(); ++i) group[i] = i;
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t i = 0; i < all.size(); ++i) {
        for (std::size_t j = 0; j < all.size(); ++j) {
          const bool touch = std::abs(all[i][0] - all[j][0]) <= 1 &&
                             std::abs(all[i][1] - all[j][1]) <= 1 &&
                             std::abs(all[i][2] - all[j][2]) <= 1;
          if (touch && group[i] < group[j]) {
            group[j] = group[i];
            changed = true;
          }
        }
      }
    }
    std::map<std::size_t, std::size_t> sizes;
    for (const std::size_t g : group) ++sizes[g];
    std::vector<std::uint32_t> expected;
    std::vector<std::uint32_t> members;
    for (std::uint32_t i = 0; i < all.size(); ++i) {
      members.push_back(i);
      if (sizes[group[i]] >= 3) expected.push_back(i);
    }
    groups.keep_large(samples, 3, members);
    std::sort(members.begin(), members.end());
    REQUIRE(members == expected);
  }
}

// Indices of the points that a footprint finds under removed points.
std::vector<std::size_t> find_under(const GroundFootprint& footprint, const PointBuffer& ground,
                                    const Clearance& clearance) {
  std::vector<std::size_t> found;
  for (std::size_t begin = 0; begin < ground.size(); begin += kWordBits) {
    const std::uint64_t under =
        footprint.find_under(GroundFootprint::block_of(ground, begin / kWordBits), clearance);
    for (std::size_t i = 0; i < kWordBits; ++i) {
      if ((under >> i & 1U) != 0) found.push_back(begin + i);
    }
  }
  return found;
}

TEST_CASE("a footprint gives the points that a search over all removed points gives") {
  Random random(11);
  GroundFootprint footprint(0.25, 40.0);
  // Scattered points, and small places with many points, in which whole blocks are skipped.
  PointBuffer ground;
  for (int i = 0; i < 1001; ++i) add_point(ground, random.vector({-39, -39, -1}, {39, 39, 2}));
  for (int place = 0; place < 20; ++place) {
    const Eigen::Vector3d corner = random.vector({-39, -39, 0}, {38, 38, 0});
    for (int i = 0; i < 200; ++i) add_point(ground, corner + random.vector({0, 0, -1}, {1, 1, 2}));
  }
  // Two rounds, because the second must not depend on the first.
  for (int round = 0; round < 2; ++round) {
    // Some points are removed alone, others as a part of a block.
    PointBuffer removed, block;
    std::uint64_t which = 0;
    for (int i = 0; i < 90; ++i) {
      const float x = random.uniform_float(-39, 39), y = random.uniform_float(-39, 39);
      const float z = random.uniform_float(0, 2);
      const std::size_t way = block.size() < 64 ? random.index(3) : 0;
      if (way == 0) footprint.add(buffer_of(std::vector<float>{x, y, z, 0.0F}), 1);
      if (way == 1) which |= std::uint64_t{1} << block.size();
      if (way <= 1) removed.push_back(x, y, z);
      if (way >= 1) block.push_back(x, y, z);
    }
    footprint.add(block, which);
    const Clearance clearance = {0.4F, round == 0 ? 0.0F : 0.02F};
    const std::vector<std::size_t> found = find_under(footprint, ground, clearance);
    std::vector<std::size_t> expected;
    const auto touches = [](float a, float b) {
      return std::abs(std::floor(a / 0.25F) - std::floor(b / 0.25F)) <= 1.0F;
    };
    for (std::size_t i = 0; i < ground.size(); ++i) {
      float lowest = std::numeric_limits<float>::infinity();
      for (std::size_t k = 0; k < removed.size(); ++k) {
        if (touches(ground.x[i], removed.x[k]) && touches(ground.y[i], removed.y[k])) {
          lowest = std::min(lowest, removed.z[k]);
        }
      }
      const float range = std::sqrt(ground.x[i] * ground.x[i] + ground.y[i] * ground.y[i]);
      const float gap = std::max(clearance.least, clearance.slope * range);
      if (lowest < ground.z[i] + gap) expected.push_back(i);
    }
    REQUIRE(found == expected);
    CHECK(found.size() < ground.size() / 2);
    CHECK_FALSE(found.empty());
    footprint.clear();
  }
}

using CellsOf = std::vector<std::vector<int>>;

// The next scan of a linker: instances that occupy the given cells of a row.
TrackedInstances next_scan(InstanceLinker& linker, const CellsOf& cells_of) {
  InstanceSamples samples;
  samples.sample_begin = {0};
  samples.supervoxel_begin = {0};
  for (const std::vector<int>& cells : cells_of) {
    for (const int x : cells) {
      samples.points.push_back(static_cast<float>(x) + 0.5F, 0.5F, 0.5F);
      samples.sample_begin.push_back(static_cast<std::uint32_t>(samples.points.size()));
    }
    samples.supervoxel_begin.push_back(static_cast<std::uint32_t>(samples.points.size()));
  }
  samples.points.grow(samples.points.size() + kPackWidth);
  TrackedInstances tracked;
  linker.measure(samples, Eigen::Isometry3d::Identity(), tracked);
  return tracked;
}

TEST_CASE("an instance is linked to the earlier instance with which it shares most cells") {
  InstanceLinker linker(1.0, 18.0, 4.5, 0.25);
  const CellsOf whole = {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}};
  const CellsOf parts = {{0, 1, 2}, {3, 4, 5, 6, 7, 8}, {9, 10, 11}, {40, 41}};
  TrackedInstances before, now;
  const auto link = [&](const CellsOf& cells_before, const CellsOf& cells_now) {
    before = next_scan(linker, cells_before);
    now = next_scan(linker, cells_now);
    linker.link(before, now);
    return now.instances[0].past.instance;
  };
  CHECK(link(whole, parts) == 0);
  CHECK(before.instances[0].future.instance == 1);
  for (const std::size_t i : {1U, 2U}) CHECK(now.instances[i].past.instance == 0);
  CHECK(now.instances[3].past.instance == kNoCluster);

  CHECK(link(parts, whole) == 1);
  for (const std::size_t i : {0U, 1U, 2U}) CHECK(before.instances[i].future.instance == 0);

  // Two of eleven cells are less than a quarter. Earlier scans have no influence.
  CHECK(link({{0, 1}}, {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}}) == kNoCluster);
  CHECK(link({}, whole) == kNoCluster);
}

TEST_CASE("instances without a common cell are not linked, however many cells they have") {
  InstanceLinker linker(1.0, 1e6, 4.5, 0.25);
  Random random(17);
  std::vector<int> some, others;
  for (int i = 0; i < 100000; ++i) (random.index(2) == 0 ? some : others).push_back(i);
  TrackedInstances before = next_scan(linker, {some}), now = next_scan(linker, {others});
  linker.link(before, now);
  CHECK(now.instances[0].past.instance == kNoCluster);
  CHECK(before.instances[0].future.instance == kNoCluster);
}

TEST_CASE("instances that are too long, too high or a single sample are not carried") {
  struct Case {
    float length, height;
    int samples;
    bool carried;
  };
  for (const Case& c : {
           Case{2.9F, 3.9F, 2, true},
           Case{3.1F, 3.9F, 2, false},
           Case{2.9F, 4.1F, 2, false},
           Case{0.0F, 0.0F, 1, false},
       }) {
    PointBuffer points;
    points.push_back(10.0F, 5.0F, -1.0F);
    // The limit applies to the diagonal: 3, 4, 5.
    if (c.samples > 1) {
      points.push_back(10.0F + 0.6F * c.length, 5.0F - 0.8F * c.length, c.height - 1.0F);
    }
    InstanceSampler sampler(0.6, 80.0, kNoLimit);
    InstanceSamples samples;
    const std::vector<std::uint32_t> instance_of(points.size(), 0);
    sampler.sample(points, instance_of, 1, samples);
    InstanceLinker linker(0.8, 3.0, 4.0, 0.25);
    TrackedInstances tracked;
    linker.measure(samples, Eigen::Isometry3d::Identity(), tracked);
    CAPTURE(c.length, c.height, c.samples);
    CHECK(tracked.shapes[0].carried == c.carried);
    CHECK((tracked.shapes[0].cells == 0) == !c.carried);
  }
}

TEST_CASE("samples along a track are summed on both sides, and fade") {
  using Instance = TrackedInstances::Instance;
  const InstanceBeliefs::Counts before = {50, 0, 40}, own = {50, 10, 40}, after = {50, 2, 40};
  Instance middle;
  middle.past.seen = sum_along_track(own, sum_along_track(before, {}));
  middle.future.seen = sum_along_track(own, sum_along_track(after, {}));
  CHECK(middle.past.seen.moved == Approx(10.0F));
  CHECK(middle.past.seen.stood == Approx(30.0F + 0.8F * 40.0F));
  CHECK(middle.future.seen.moved == Approx(10.0F + 0.95F * 2.0F));
  CHECK(middle.future.seen.stood == Approx(30.0F + 0.8F * 38.0F));
  // Those of the scan itself count once.
  CHECK(middle.moved_ratio(own) == Approx(11.9F / (11.9F + 92.4F)));
  CHECK(Instance().moved_ratio({}) == 0.0F);  // nothing is decided
}

std::vector<float> random_angles(std::size_t count, double low, double high, Random& random) {
  std::vector<float> angles(count);
  for (float& angle : angles) angle = random.uniform_float(low, high);
  return angles;
}

TEST_CASE("gaps in bands of an angle are those of the sorted angles of a quarter of the points") {
  Random random(22);
  for (const std::size_t count : {1U, 600U, 20000U}) {
    const std::vector<float> across = random_angles(count, -180.0, 180.0, random);
    std::vector<float> along = random_angles(count, -180.0, 180.0, random);
    std::fill_n(along.begin(), count / 5, along.back());  // some are equal
    std::map<int, std::vector<float>> by_band;
    for (std::size_t i = 0; i < count; ++i) {
      by_band[static_cast<int>((static_cast<double>(across[i]) + 181.0) / 0.5)].push_back(along[i]);
    }
    std::vector<float> expected;
    std::size_t seen = 0, sorted = 0;
    for (auto& [band, angles] : by_band) {
      seen += angles.size();
      if (4 * sorted > seen - angles.size()) continue;
      sorted += angles.size();
      std::sort(angles.begin(), angles.end());
      for (std::size_t k = 1; k < angles.size(); ++k) {
        if (angles[k] - angles[k - 1] > 0.25F) expected.push_back(angles[k] - angles[k - 1]);
      }
    }
    CHECK(gaps_in_bands(across, along, 0.5, 0.25) == expected);
  }
}

// Adds a point 20 m away; deg.
void add_beam(double azimuth, double elevation, PointBuffer& points) {
  add_point(points, 20.0 * ray_of(elevation * M_PI / 180.0, azimuth * M_PI / 180.0));
}

TEST_CASE("the beam spacing of a sensor is measured from one scan") {
  // 40 beams 0.5 deg apart, a point every 0.3 deg, at 20 m.
  PointBuffer points;
  for (int beam = 0; beam < 40; ++beam) {
    for (int column = 0; column < 1200; ++column) {
      add_beam(0.3 * column - 180.0, -15.0 + 0.5 * beam, points);
    }
  }
  const SensorModel sensor = estimate_sensor_model(points);
  REQUIRE(sensor.known());
  CHECK(sensor.azimuth_step == Approx(0.3).margin(0.01));
  CHECK(sensor.elevation_gap == Approx(0.5).margin(0.01));
  CHECK(sensor.elevation_gap_wide == Approx(0.5).margin(0.01));
  CHECK(sensor.elevation_min == Approx(-15.0).margin(0.1));
  CHECK(sensor.elevation_max == Approx(4.5).margin(0.1));
  CHECK_FALSE(estimate_sensor_model(PointsView(points).subview(0, 499)).known());
  CHECK(estimate_sensor_model(PointsView(points).subview(0, 500)).known());
}

TEST_CASE("the beams of a sensor without rings are as far apart as their density says") {
  // A third of a turn, 40 deg high, with 5,000 beams in random directions.
  Random random(4);
  PointBuffer points;
  for (int i = 0; i < 5000; ++i) {
    const double sine = random.uniform(std::sin(-10.0 * M_PI / 180.0), 0.5);
    add_beam(random.uniform(-60.0, 60.0), std::asin(sine) * 180.0 / M_PI, points);
  }
  const SensorModel sensor = estimate_sensor_model(points);
  const double spacing =
      std::sqrt(120.0 * (0.5 - std::sin(-10.0 * M_PI / 180.0)) * 180.0 / M_PI / 5000.0);
  CHECK(sensor.azimuth_step == Approx(spacing).epsilon(0.02));
  CHECK(sensor.elevation_gap == sensor.azimuth_step);
  CHECK(sensor.elevation_gap_wide == sensor.azimuth_step);
}

TEST_CASE("dense and wide gaps of unevenly spaced beams are distinguished") {
  // 24 gaps: ten of 0.3 deg, eight of 0.6 deg, six of 1.2 deg. Each beam is measured twice.
  PointBuffer points;
  double elevation = -10.0;
  for (int beam = 0; beam < 25; ++beam) {
    for (int column = 0; column < 1800; ++column) {
      for (const double again : {0.0, 0.002}) {
        add_beam(0.2 * column - 180.0 + again, elevation, points);
      }
    }
    elevation += beam < 10 ? 0.3 : beam < 18 ? 0.6 : 1.2;
  }
  const SensorModel sensor = estimate_sensor_model(points);
  CHECK(sensor.azimuth_step == Approx(0.2).margin(0.01));
  CHECK(sensor.elevation_gap == Approx(0.3).margin(0.01));
  CHECK(sensor.elevation_gap_wide == Approx(1.2).margin(0.01));
}

}  // namespace
}  // namespace dynains::test
