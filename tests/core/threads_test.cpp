// One and two threads of a remover give the same answers.
#include <new>

#include "support/catch.hpp"
#include "support/own_stages.hpp"
#include "support/runs.hpp"

namespace dynains::test {
namespace {

// Fails in chosen calls.
class FailingClusterer : public CurvedVoxelClusterer {
 public:
  struct Config : CurvedVoxelClusterer::Config {
    int failing_call = -1;

    static Config paper() {
      Config config;
      static_cast<CurvedVoxelClusterer::Config&>(config) = CurvedVoxelClusterer::Config::paper();
      return config;
    }
  };
  explicit FailingClusterer(const Config& config)
      : CurvedVoxelClusterer(config), calls_left_(config.failing_call) {}

  Span<const std::uint32_t> cluster(PolarView points) {
    if (calls_left_-- == 0) throw std::bad_alloc();
    return CurvedVoxelClusterer::cluster(points);
  }

 private:
  int calls_left_;
};

class FaintingMap : public StaticMapAccumulator {
 public:
  struct Config : StaticMapAccumulator::Config {
    int failing_insert = -1;
  };
  explicit FaintingMap(const Config& config)
      : StaticMapAccumulator(config), inserts_left_(config.failing_insert) {}

  void insert(PointsView points, Span<const std::uint8_t> keep, const Pose& T_world_points) {
    if (inserts_left_-- == 0) throw std::bad_alloc();
    StaticMapAccumulator::insert(points, keep, T_world_points);
  }

 private:
  int inserts_left_;
};

struct FaintingStages : DefaultStages {
  using Clusterer = FailingClusterer;
  using Map = FaintingMap;
};

using FaintingRemover = BasicDynaInsRemover<FaintingStages>;
using FaintingConfig = FaintingRemover::Config;

struct Answers {
  Run verdicts;
  std::vector<std::uint64_t> finished_after;  // by final verdict: number of pushes before it
  std::vector<double> residuals;              // m
  std::vector<Eigen::Vector3d> map;
  std::size_t epochs = 0;
  std::size_t failures = 0;
};

Answers answers(FaintingConfig config, int threads, const std::vector<Scan>& scans) {
  config.threads = threads;
  FaintingRemover remover(config);
  Answers result;
  std::uint64_t pushes = 0;
  const auto take = [&](const ScanVerdict& verdict) {
    result.verdicts.final.emplace_back(verdict);
    result.finished_after.push_back(pushes);
  };
  for (const Scan& scan : scans) {
    try {
      ++pushes;
      const FrameResult frame = push(remover, scan);
      result.verdicts.newest.emplace_back(frame.newest());
      result.epochs += frame.began_epoch ? 1 : 0;
      if (frame.pose_residual) result.residuals.push_back(frame.pose_residual->translation);
      if (frame.finished) take(*frame.finished);
    } catch (const std::bad_alloc&) {
      ++result.failures;
    } catch (const PoseError&) {
      ++result.failures;
    }
  }
  remover.flush(take);
  remover.map().for_each([&](const Eigen::Vector3d& point) { result.map.push_back(point); });
  return result;
}

// Runs both and compares; returns the answers of one thread.
Answers check_equal(const FaintingConfig& config, const std::vector<Scan>& scans) {
  const Answers one = answers(config, 1, scans);
  const Answers two = answers(config, 2, scans);
  CHECK((one.verdicts.final == two.verdicts.final));
  CHECK(one.residuals == two.residuals);
  CHECK((one.map == two.map));
  CHECK(one.epochs == two.epochs);
  CHECK(one.failures == two.failures);
  if (one.failures == 0) {
    CHECK((one.verdicts.newest == two.verdicts.newest));
    const std::size_t latency = FaintingRemover(config).latency();
    const std::uint64_t delay = latency > 0 ? 1 : 0;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      CHECK(one.finished_after[i] == std::min(i + latency + 1, scans.size()));
      CHECK(two.finished_after[i] == std::min(i + latency + delay + 1, scans.size()));
    }
  }
  return one;
}

FaintingConfig with_lookahead(int scans, int reference_step = 2) {
  FaintingConfig config;
  config.evidence.lookahead_scans = scans;
  config.evidence.reference_step = reference_step;
  return config;
}

std::vector<FaintingConfig> configs() {
  FaintingConfig by_newest_window = FaintingConfig::paper();
  by_newest_window.votes = 0;
  FaintingConfig crowd = with_lookahead(8);
  crowd.evidence.dynamic_grid_ratio = 0.4;
  return {
      FaintingConfig::paper(), by_newest_window,  with_lookahead(30),        with_lookahead(5, 1),
      with_lookahead(7, 3),    with_lookahead(0), FaintingConfig::offline(), crowd};
}

const std::vector<Scan>& one_passing_van() {
  static const std::vector<Scan> scans = drive(oncoming(), 36, 5.0);
  return scans;
}

TEST_CASE("two threads give the answers of one thread, with every configuration") {
  for (const FaintingConfig& config : configs()) {
    const Answers one = check_equal(config, one_passing_van());
    CHECK(one.verdicts.final.size() == one_passing_van().size());
    CHECK(one.failures == 0);
    CHECK_FALSE(one.map.empty());
  }
}

TEST_CASE("two threads give the same answers where poses are corrected") {
  std::vector<Scan> scans = one_passing_van();
  Random random(7);
  for (Scan& scan : scans) {
    const Eigen::Vector3d most = Eigen::Vector3d::Constant(0.05);
    scan.T_world_sensor.translation() += random.vector(-most, most);
  }
  const Answers one = check_equal(with_lookahead(8), scans);
  REQUIRE_FALSE(one.residuals.empty());
  CHECK(*std::max_element(one.residuals.begin(), one.residuals.end()) > 0.02);
}

TEST_CASE("two threads give the same answers where epochs begin again") {
  std::vector<Scan> scans = one_passing_van();
  for (std::size_t i = 12; i < scans.size(); ++i) scans[i].time += 2.0;  // a pause
  for (std::size_t i = 20; i < scans.size(); ++i) {                      // a jump
    scans[i].T_world_sensor.translation() += Eigen::Vector3d(500.0, 0.0, 0.0);
  }
  scans[25].points.clear();
  scans[25].object.clear();
  for (const FaintingConfig& config : {FaintingConfig::paper(), with_lookahead(7, 3)}) {
    CHECK(check_equal(config, scans).epochs >= 3);
  }
}

TEST_CASE("two threads give the same answers where the first scans do not tell the sensor") {
  std::vector<Scan> scans = one_passing_van();
  for (std::size_t i = 0; i < 10; ++i) {
    scans[i].points.resize(20);
    scans[i].object.resize(20);
  }
  check_equal(with_lookahead(5), scans);
}

TEST_CASE(
    "a scan that is refused or fails is dropped, and a new window begins, by two threads, too") {
  for (FaintingConfig config : {FaintingConfig::paper(), FaintingConfig(), with_lookahead(8)}) {
    for (const int failing : {0, 3, 33}) {
      std::vector<Scan> scans = one_passing_van();
      scans[15].T_world_sensor.translation().x() = std::numeric_limits<double>::quiet_NaN();
      config.clusterer.failing_call = failing;
      const Answers one = check_equal(config, scans);
      CHECK(one.failures == 2);
      scans.erase(scans.begin() + 15);
      scans.erase(scans.begin() + failing);
      REQUIRE(one.verdicts.final.size() == scans.size());
      for (std::size_t i = 0; i < scans.size(); ++i) {
        CHECK(one.verdicts.final[i].scan == i);
        CHECK(one.verdicts.final[i].beliefs.size() == scans[i].points.size());
      }
    }
  }
}

TEST_CASE("an exception of the second thread reaches the caller, and the scan is taken") {
  for (FaintingConfig config : {FaintingConfig::paper(), with_lookahead(8)}) {
    config.map.failing_insert = 3;
    const Answers one = check_equal(config, one_passing_van());
    CHECK(one.failures == 1);
    CHECK(one.verdicts.newest.size() == one_passing_van().size() - 1);
    CHECK(one.verdicts.final.size() == one_passing_van().size() - 1);
  }
}

TEST_CASE("with two threads, one more scan than with one is open, and flush() gives it") {
  for (FaintingConfig config : {FaintingConfig::paper(), with_lookahead(8)}) {
    const std::size_t latency = FaintingRemover(config).latency();
    config.threads = 2;
    config.map.failing_insert = static_cast<int>(one_passing_van().size()) - 1;
    FaintingRemover remover(config);
    CHECK(remover.latency() == latency + 1);
    for (const Scan& scan : one_passing_van()) push(remover, scan);
    std::size_t flushed = 0;
    const auto count = [&](const ScanVerdict&) { ++flushed; };
    CHECK_THROWS_AS(remover.flush(count), std::bad_alloc);
    CHECK(flushed == latency);
  }
}

}  // namespace
}  // namespace dynains::test
