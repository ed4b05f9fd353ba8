// Points of the map that are later seen through are removed.
#include "dynains/map/map_revision.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "support/catch.hpp"
#include "support/counting_map.hpp"
#include "support/own_stages.hpp"
#include "support/runs.hpp"
#include "support/scene.hpp"
#include "support/visibility.hpp"

namespace dynains::test {
namespace {

/// A scan with one result for all samples: free, hit or unknown.
class Eyes {
 public:
  explicit Eyes(BeamResult result) : result_(result) {}
  const detail::Visibility& operator()(const PointBuffer&, std::size_t count,
                                       const Eigen::Isometry3d&) {
    visibility_ = visibility_of(std::vector<BeamResult>(count, result_));
    return visibility_;
  }

 private:
  BeamResult result_;
  detail::Visibility visibility_;
};

/// A scan that covers only the first points, and these are free.
class NarrowEyes {
 public:
  explicit NarrowEyes(std::size_t most) : most_(most) {}
  const detail::Visibility& operator()(const PointBuffer&, std::size_t count,
                                       const Eigen::Isometry3d&) {
    std::vector<BeamResult> seen(count, BeamResult::kUnknown);
    std::fill_n(seen.begin(), std::min(count, most_), BeamResult::kFree);
    visibility_ = visibility_of(seen);
    return visibility_;
  }

 private:
  std::size_t most_;
  detail::Visibility visibility_;
};

PointBuffer three_points(float x) {
  PointBuffer points;
  points.push_back(x, 0.1F, 0.1F);
  points.push_back(x, 0.3F, 0.1F);
  points.push_back(x, 0.1F, 0.3F);
  return points;
}

struct Watched {
  MapRevision revision;
  StaticMapAccumulator map;
  std::uint64_t scan = 0;

  explicit Watched(const MapRevision::Config& config = every_scan()) : revision(config) {
    map.insert(three_points(5.1F), {}, Eigen::Isometry3d::Identity());
  }
  static MapRevision::Config every_scan() {
    MapRevision::Config config;
    config.revision_period = 1;
    return config;
  }
  void look(BeamResult result, const Eigen::Vector3d& sensor = Eigen::Vector3d::Zero()) {
    revision.revise(map, scan++, sensor, Eyes(result));
  }
};

// The log-odds of 0.7 are 0.847. Wholly free counts twice: 1.69, then 3.39, above the 2.94 of 0.95.
TEST_CASE("a block of the map is emptied by the second scan in which it is wholly free") {
  Watched watched;
  watched.look(BeamResult::kFree);
  CHECK(watched.map.size() == 3);
  watched.look(BeamResult::kFree);
  CHECK(watched.map.empty());
}

// The hit takes 1.70 away: 1.69, 0, 1.69, 3.39.
TEST_CASE("a hit lowers the belief in free space, but not below zero") {
  Watched watched;
  for (int i = 0; i < 50; ++i) watched.look(BeamResult::kHit);
  watched.look(BeamResult::kFree);
  watched.look(BeamResult::kHit);
  watched.look(BeamResult::kFree);
  CHECK(watched.map.size() == 3);
  watched.look(BeamResult::kUnknown);
  CHECK(watched.map.size() == 3);
  watched.look(BeamResult::kFree);
  CHECK(watched.map.empty());
}

TEST_CASE("a scan that covers few points of a block does not change its belief") {
  PointBuffer eight;
  for (int i = 0; i < 8; ++i) {
    eight.push_back(5.1F + 0.2F * static_cast<float>(i % 4), 0.1F,
                    0.1F + 0.2F * static_cast<float>(i / 4));
  }
  struct Case {
    PointBuffer points;
    std::size_t seen;
    bool enough;
  };
  for (const Case& c : {
           Case{three_points(5.1F), 1, false},
           Case{three_points(5.1F), 2, true},
           Case{eight, 2, false},  // a quarter
           Case{eight, 3, true},
       }) {
    MapRevision revision(Watched::every_scan());
    StaticMapAccumulator map;
    map.insert(c.points, {}, Eigen::Isometry3d::Identity());
    REQUIRE(map.size() == c.points.size());
    REQUIRE(map.block_count() == 1);
    for (std::uint64_t scan = 0; scan < 2; ++scan) {
      revision.revise(map, scan, Eigen::Vector3d::Zero(), NarrowEyes(c.seen));
    }
    INFO(c.seen << " of " << c.points.size());
    CHECK(map.empty() == c.enough);
  }
}

TEST_CASE("tau_revise is the belief at which a block is emptied") {
  MapRevision::Config config = Watched::every_scan();
  config.tau_revise = 0.84;  // log-odds 1.66
  Watched sooner(config);
  sooner.look(BeamResult::kFree);
  CHECK(sooner.map.empty());
  config.tau_revise = 0.97;  // log-odds 3.48
  Watched later(config);
  later.look(BeamResult::kFree);
  later.look(BeamResult::kFree);
  CHECK(later.map.size() == 3);
  later.look(BeamResult::kFree);
  CHECK(later.map.empty());
}

TEST_CASE("a block is tested once in a period, and only within range") {
  MapRevision::Config config;
  config.revision_period = 5;
  config.tau_revise = 0.84;
  Watched watched(config);
  for (int i = 0; i < 20; ++i) watched.look(BeamResult::kFree, {66.0, 0.0, 0.0});
  CHECK(watched.map.size() == 3);
  int looks = 0;
  while (!watched.map.empty() && looks < 6) {
    watched.look(BeamResult::kFree, {64.0, 0.0, 0.0});
    ++looks;
  }
  CHECK(watched.map.empty());
  CHECK(looks <= 5);
}

TEST_CASE("emptied places are filled again, without new memory") {
  Watched watched;
  const std::size_t memory = watched.map.memory_bytes();
  for (int round = 0; round < 2000; ++round) {
    watched.look(BeamResult::kFree);
    REQUIRE(watched.map.size() == 3);
    watched.look(BeamResult::kFree);
    REQUIRE(watched.map.empty());
    watched.map.insert(three_points(5.1F), {}, Eigen::Isometry3d::Identity());
    REQUIRE(watched.map.size() == 3);
  }
  CHECK(watched.map.memory_bytes() == memory);
  std::size_t visited = 0;
  watched.map.for_each([&](const Eigen::Vector3d& p) {
    ++visited;
    CHECK(std::abs(p.x() - 5.1) < 1e-5);
  });
  CHECK(visited == 3);
}

/// The sensor stands; a van is parked between it and a wall for 3 s and then leaves at 8 m/s.
std::vector<Scan> departure() {
  Scene parked = yard_with(van(9.0, 3.0));
  Scene leaving = yard_with(van(9.0, 3.0 - 3.0 * 8.0, {0.0, 8.0, 0.0}));
  for (Scene* const scene : {&parked, &leaving}) {
    scene->boxes.push_back({{20.0, -30.0, 0.0}, {21.0, 30.0, 8.0}});
  }
  std::vector<Scan> scans;
  for (int i = 0; i < 70; ++i) {
    scans.push_back((i < 30 ? parked : leaving).scan(sensor_at(0.0), 0.1 * i));
  }
  return scans;
}

std::size_t points_of_van(const StaticMapAccumulator& map) {
  std::size_t count = 0;
  // Lower blocks also contain ground, which stays.
  map.for_each_in({Eigen::Vector3d(6.7, 1.9, 0.41), Eigen::Vector3d(11.3, 4.1, 2.5)},
                  [&](const Eigen::Vector3d&) { ++count; });
  return count;
}

TEST_CASE("a van that leaves after lookahead_scans leaves the map, and verdicts do not change") {
  const std::vector<Scan> scans = departure();
  DynaInsRemover::Config config;
  config.evidence.lookahead_scans = 5;
  DynaInsRemover plain(config);
  config.revision.revise_map = true;
  DynaInsRemover revising(config);
  CHECK(run(plain, scans).final == run(revising, scans).final);
  CHECK(points_of_van(plain.map()) > 100);
  CHECK(points_of_van(revising.map()) < 5);
  // All other points stay.
  const std::size_t van = points_of_van(plain.map()) - points_of_van(revising.map());
  CHECK(static_cast<double>(revising.map().size()) >
        0.998 * static_cast<double>(plain.map().size() - van));
}

TEST_CASE("after a reset, a revised map is equal") {
  const std::vector<Scan> scans = departure();
  DynaInsRemover::Config config;
  config.evidence.lookahead_scans = 5;
  config.revision.revise_map = true;
  DynaInsRemover remover(config);
  const auto points = [&] {
    std::vector<Eigen::Vector3d> result;
    remover.map().for_each([&](const Eigen::Vector3d& p) { result.push_back(p); });
    return result;
  };
  run(remover, scans);
  const std::vector<Eigen::Vector3d> first = points();
  remover.reset();
  run(remover, scans);
  CHECK(points() == first);
}

struct CountingStages : DefaultStages {
  using Map = CountingMap;
};

TEST_CASE("a map is revised by free-space evidence, and only if its type can remove points") {
  DynaInsRemover::Config config = DynaInsRemover::Config::paper();
  config.revision.revise_map = true;
  CHECK_THROWS_WITH(DynaInsRemover(config),
                    ContainsSubstring("MapRevision.revise_map = true needs decision = free_space"));
  config.decision = Decision::kFreeSpace;
  CHECK_NOTHROW(config.validate());
  config.build_map = false;
  CHECK_THROWS_WITH(config.validate(),
                    ContainsSubstring("MapRevision.revise_map = true needs build_map = true"));
  BasicDynaInsRemover<CountingStages>::Config keeping;
  CHECK_NOTHROW(BasicDynaInsRemover<CountingStages>(keeping));
  keeping.revision.revise_map = true;
  CHECK_THROWS_WITH(
      BasicDynaInsRemover<CountingStages>(keeping),
      ContainsSubstring("MapRevision.revise_map = true needs a map that is kept in memory"));
}

TEST_CASE("a block of the map is tested once per reference: its period is not below the step") {
  DynaInsRemover::Config config;
  config.evidence.reference_step = 3;
  config.revision.revision_period = 2;
  CHECK_NOTHROW(config.validate());
  config.revision.revise_map = true;
  CHECK_THROWS_WITH(config.validate(),
                    ContainsSubstring("MapRevision.revision_period = 2 must not be below "
                                      "FreeSpaceEvidence.reference_step = 3"));
  config.revision.revision_period = 3;
  CHECK_NOTHROW(config.validate());
}

}  // namespace
}  // namespace dynains::test
