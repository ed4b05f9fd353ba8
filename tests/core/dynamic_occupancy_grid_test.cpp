// The dynamic occupancy grid, compared with counts by hand and with a slow reference count.
#include "dynains/evidence/dynamic_occupancy_grid.hpp"

#include "support/catch.hpp"
#include "support/points.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

using namespace detail;

using Count = DynamicOccupancyGrid::Count;
using Verdict = DynamicOccupancyGrid::Verdict;

// A scan of single points, each in a separate supervoxel, with a verdict for each.
struct SparseScan {
  InstanceSamples samples;
  std::vector<Count> counted;
  std::vector<Verdict> verdicts;

  explicit SparseScan(const std::vector<Eigen::Vector3f>& points) {
    std::vector<std::uint32_t> instance_of(points.size());
    for (std::uint32_t i = 0; i < instance_of.size(); ++i) instance_of[i] = i;
    InstanceSampler(0.9, 80.0, 4).sample(buffer_of(points), instance_of, points.size(), samples);
    counted.assign(samples.supervoxel_count(), Count::kNone);
  }

  void say(Cause cause, float belief = 0.5F) { verdicts.assign(counted.size(), {cause, belief}); }
  Verdict judge(std::uint64_t scan, DynamicOccupancyGrid& grid,
                const Eigen::Isometry3d& T_origin_sensor = Eigen::Isometry3d::Identity()) {
    grid.judge(scan, samples, T_origin_sensor, counted, verdicts);
    return verdicts[0];
  }
};

constexpr float kBelief = 0.625F;

FreeSpaceConfig with_ratio(double ratio) {
  FreeSpaceConfig config;
  config.dynamic_grid_ratio = ratio;
  return config;
}
FreeSpaceConfig three_quarters() { return with_ratio(0.75); }

// The cause of a static point in a place where `moved` and `stayed` points were seen before.
Verdict verdict_behind(int moved, int stayed, FreeSpaceConfig config = three_quarters(),
                       std::uint64_t later = 1, Cause cause_of_moved = Cause::kFreeSpace) {
  DynamicOccupancyGrid grid(config);
  const std::vector<Eigen::Vector3f> place(1, {10.1F, 5.2F, 0.3F});
  std::uint64_t scan = 0;
  for (int i = 0; i < moved + stayed; ++i) {
    SparseScan one(place);
    one.say(i < moved ? cause_of_moved : Cause::kOccupied);
    one.judge(scan++, grid);
  }
  SparseScan last(place);
  last.say(Cause::kOccupied, kBelief);
  return last.judge(scan - 1 + later, grid);
}

TEST_CASE(
    "the belief in a dynamic cell is its ratio of dynamic samples, if that is the higher one") {
  CHECK(verdict_behind(4, 0).belief == Approx(0.8F));
  CHECK(verdict_behind(3, 0).belief == kBelief);
}

TEST_CASE("a cell is cleared if no scan of the lookback interval has a sample in it") {
  FreeSpaceConfig config = three_quarters();
  config.lookback_scans = 20;
  CHECK(verdict_behind(8, 0, config, 20).cause == Cause::kDynamicOccupancy);
  CHECK(verdict_behind(8, 0, config, 21).cause == Cause::kOccupied);
}

TEST_CASE("presumed instances are not counted, and a ratio of 1 turns the grid off") {
  CHECK(verdict_behind(8, 0, three_quarters(), 1, Cause::kPresumed).cause == Cause::kOccupied);
  CHECK(verdict_behind(100, 0, with_ratio(1.0)).cause == Cause::kOccupied);
}

TEST_CASE("a part of a large instance needs a lower ratio for a final verdict") {
  const std::vector<Eigen::Vector3f> place(1, {10.1F, 5.2F, 0.3F});
  for (const bool carried : {true, false}) {
    DynamicOccupancyGrid grid(three_quarters());
    TrackedInstances tracked;
    tracked.shapes.resize(1);
    tracked.shapes[0].carried = carried;
    SparseScan scan(place);
    for (std::uint64_t i = 0; i < 4; ++i) {  // three of four moved
      scan = SparseScan(place);
      scan.say(i < 3 ? Cause::kFreeSpace : Cause::kOccupied);
      if (i < 3) scan.judge(i, grid);
    }
    CHECK(scan.judge(3, grid).cause == Cause::kOccupied);
    grid.judge(3, scan.samples, Pose::Identity(), scan.counted, scan.verdicts, &tracked);
    CHECK(scan.verdicts[0].cause == (carried ? Cause::kOccupied : Cause::kDynamicOccupancy));
  }
}

TEST_CASE("a later verdict on a scan replaces the earlier one in the count") {
  DynamicOccupancyGrid grid(three_quarters());
  const std::vector<Eigen::Vector3f> place(1, {-3.0F, 4.0F, 1.0F});
  std::vector<SparseScan> scans(5, SparseScan(place));
  const auto judge = [&](std::uint64_t scan, Cause cause) {
    scans[scan].say(cause);
    return scans[scan].judge(scan, grid).cause;
  };
  for (std::uint64_t scan = 0; scan < 4; ++scan) judge(scan, Cause::kFreeSpace);
  // After repeated verdicts, the scan counts once: 4 of 5.
  for (int i = 0; i < 10; ++i) CHECK(judge(4, Cause::kOccupied) == Cause::kDynamicOccupancy);
  // One of the moving points gets a static verdict: 3 of 5. Then it gets a dynamic one again.
  CHECK(judge(0, Cause::kOccupied) == Cause::kOccupied);
  CHECK(judge(4, Cause::kOccupied) == Cause::kOccupied);
  CHECK(judge(0, Cause::kAlongTrack) == Cause::kAlongTrack);
  CHECK(judge(4, Cause::kOccupied) == Cause::kDynamicOccupancy);
  grid.clear();
  scans[4].counted.assign(1, Count::kNone);
  CHECK(judge(4, Cause::kOccupied) == Cause::kOccupied);
}

TEST_CASE("cells lie in the world frame: their counts do not depend on the pose of the sensor") {
  DynamicOccupancyGrid grid(with_ratio(0.5));
  const Eigen::Vector3f place(20.3F, -7.7F, 0.3F);  // the middle of a cell
  for (std::uint64_t scan = 0; scan < 10; ++scan) {
    const auto i = static_cast<double>(scan);
    const Eigen::Isometry3d T_origin_sensor = Eigen::Translation3d(1.5 * i, 0.3, 0.1) *
                                              Eigen::AngleAxisd(0.3 * i, Eigen::Vector3d::UnitZ());
    const std::vector<Eigen::Vector3f> seen(1, T_origin_sensor.inverse().cast<float>() * place);
    SparseScan one(seen);
    one.say(scan < 9 ? Cause::kFreeSpace : Cause::kOccupied);
    const Verdict verdict = one.judge(scan, grid, T_origin_sensor);
    if (scan == 9) CHECK(verdict.cause == Cause::kDynamicOccupancy);
  }
}

TEST_CASE("the grid equals a slow reference count") {
  Random random(11);
  DynamicOccupancyGrid grid(with_ratio(0.6));
  struct Counts {
    int moved = 0, stayed = 0;
  };
  std::map<std::tuple<int, int, int>, Counts> cells;
  std::size_t in_grid = 0, stay = 0;
  for (std::uint64_t scan = 0; scan < 40; ++scan) {
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < 300; ++i) {
      points.push_back(random.vector({-5, -5, -1}, {5, 5, 1}).cast<float>());
    }
    SparseScan one(points);
    const auto cell_of = [&](std::size_t s) {
      const std::uint32_t i = one.samples.sample_begin[s];
      const auto index = [](float coordinate) {
        return static_cast<int>(std::floor(coordinate * (1.0F / 0.6F)));
      };
      return std::make_tuple(index(one.samples.points.x[i]), index(one.samples.points.y[i]),
                             index(one.samples.points.z[i]));
    };
    one.say(Cause::kOccupied);
    for (std::size_t s = 0; s < one.counted.size(); ++s) {
      // Points on one side move more often than points on the other.
      const double chance = one.samples.points.x[one.samples.sample_begin[s]] > 0 ? 0.75 : 0.3;
      if (random.uniform(0, 1) < chance) one.verdicts[s].cause = Cause::kWithInstance;
      Counts& counts = cells[cell_of(s)];
      ++(is_dynamic(one.verdicts[s].cause) ? counts.moved : counts.stayed);
    }
    const std::vector<Verdict> said = one.verdicts;
    one.judge(scan, grid);
    for (std::size_t s = 0; s < said.size(); ++s) {
      if (is_dynamic(said[s].cause)) {
        REQUIRE(one.verdicts[s] == said[s]);
        continue;
      }
      const Counts& counts = cells[cell_of(s)];
      const bool expected = 10 * counts.moved > 6 * (counts.moved + counts.stayed);
      REQUIRE((one.verdicts[s].cause == Cause::kDynamicOccupancy) == expected);
      ++(expected ? in_grid : stay);
    }
  }
  CHECK(in_grid > 500);
  CHECK(stay > 500);
}

TEST_CASE("one sample in a dynamic cell is enough for its supervoxel") {
  DynamicOccupancyGrid grid(with_ratio(0.5));
  const std::vector<Eigen::Vector3f> passed(1, {0.15F, 0.15F, 0.15F});
  std::uint64_t scan = 0;
  for (; scan < 20; ++scan) {
    SparseScan one(passed);
    one.say(Cause::kFreeSpace);
    one.judge(scan, grid);
  }
  // Samples of one supervoxel, 0.3 m apart; the first two of four lie in the cell of those above.
  for (const bool is_inside : {true, false}) {
    PointBuffer points;
    for (int i = is_inside ? 0 : 2; i < 4; ++i) {
      points.push_back(0.15F + 0.3F * static_cast<float>(i), 0.15F, 0.15F);
    }
    const std::vector<std::uint32_t> one_instance(points.size(), 0);
    InstanceSamples samples;
    InstanceSampler(1.2, 80.0, 64).sample(points, one_instance, 1, samples);
    REQUIRE(samples.supervoxel_count() == 1);
    REQUIRE(samples.size() == points.size());
    std::vector<Count> counted(1, Count::kNone);
    std::vector<Verdict> verdicts(1, {Cause::kOccupied, 0.5F});
    grid.judge(scan++, samples, Pose::Identity(), counted, verdicts);
    CHECK((verdicts[0].cause == Cause::kDynamicOccupancy) == is_inside);
  }
}

}  // namespace
}  // namespace dynains::test
