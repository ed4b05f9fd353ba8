// Moving objects as boxes with ids and velocities (RemoverConfig::objects).
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "support/catch.hpp"
#include "support/runs.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

constexpr double kStart = 14.0, kSpeed = -6.0;  // m, m/s, of a van along x

/// Scans of a van that something hides for half a second.
std::vector<Scan> passing_van() {
  const Scene with = yard_with(van(kStart, 3.5, {kSpeed, 0.0, 0.0}));
  const Scene without = yard();
  std::vector<Scan> scans;
  for (int i = 0; i < 40; ++i) {
    const bool is_hidden = i >= 20 && i < 25;
    scans.push_back((is_hidden ? without : with).scan(sensor_at(0.0), 0.1 * i));
  }
  return scans;
}

struct Found {
  std::uint64_t scan;
  double time;
  MovingObject object;
};

struct Listed {
  std::vector<Found> newest, final;
};

Listed list_objects(const std::vector<Scan>& scans, int threads) {
  DynaInsRemover::Config config;
  config.objects = true;
  config.threads = threads;
  config.evidence.lookahead_scans = 10;
  DynaInsRemover remover(config);
  Listed listed;
  const auto keep = [](const ScanVerdict& verdict, std::vector<Found>& found) {
    for (const MovingObject& object : verdict.objects) {
      found.push_back({verdict.scan, verdict.time, object});
    }
  };
  for (const Scan& scan : scans) {
    const FrameResult frame = remover.push(scan.points, scan.T_world_sensor, scan.time);
    keep(frame.newest(), listed.newest);
    if (frame.finished) keep(*frame.finished, listed.final);
  }
  remover.flush([&](const ScanVerdict& verdict) { keep(verdict, listed.final); });
  return listed;
}

std::vector<double> numbers_of(const std::vector<Found>& found) {
  std::vector<double> numbers;
  for (const Found& row : found) {
    numbers.push_back(row.time);
    MovingObject::visit(row.object, [&](const char*, auto number) {
      numbers.push_back(static_cast<double>(number));
    });
  }
  return numbers;
}

TEST_CASE("a moving van is one object with its place, size and velocity") {
  const Listed listed = list_objects(passing_van(), 1);
  for (const auto* const found : {&listed.newest, &listed.final}) {
    CHECK(found->size() > 25);
    std::set<std::uint32_t> ids;
    std::set<std::uint64_t> seen;
    std::size_t near = 0, fast = 0;
    for (const auto& [scan, time, object] : *found) {
      CAPTURE(scan, object.id);
      ids.insert(object.id);
      CHECK(seen.insert(scan).second);
      CHECK((scan < 20 || scan >= 25));
      CHECK(object.first_scan <= scan);
      CHECK(object.last_scan >= scan);
      const Eigen::Vector2d error =
          object.centre.head<2>() - Eigen::Vector2d(kStart + kSpeed * time, 3.5);
      CHECK(error.norm() < 1.0);
      near += error.norm() < 0.5 ? 1U : 0U;
      fast += (object.velocity - Eigen::Vector2d(kSpeed, 0.0)).norm() < 1.0 ? 1U : 0U;
      CHECK(std::abs(object.length - 4.2) < 0.6);
      CHECK(std::abs(object.width - 1.8) < 0.6);
      CHECK(object.points > 10);
    }
    CHECK(ids.size() == 1);
    // Points of the wall beside the van, and hidden ends, disturb some scans.
    CHECK(10 * near >= 9 * found->size());
    CHECK(4 * fast >= 3 * found->size());
  }
  CHECK(listed.newest.front().object.id == listed.final.front().object.id);
}

TEST_CASE("two threads list the same objects") {
  const std::vector<Scan> scans = passing_van();
  const Listed one = list_objects(scans, 1), two = list_objects(scans, 2);
  CHECK(numbers_of(one.newest) == numbers_of(two.newest));
  CHECK(numbers_of(one.final) == numbers_of(two.final));
}

TEST_CASE("verdicts on points do not depend on the list of objects") {
  const std::vector<Scan> scans = passing_van();
  DynaInsRemover::Config config =
      GENERATE(DynaInsRemover::Config(), DynaInsRemover::Config::paper());
  DynaInsRemover without(config);
  config.objects = true;
  DynaInsRemover with(config);
  const Run a = run(without, scans), b = run(with, scans);
  CHECK(a.newest == b.newest);
  CHECK(a.final == b.final);
}

}  // namespace
}  // namespace dynains::test
