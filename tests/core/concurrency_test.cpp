// Permitted and forbidden use of a remover by several threads. Run it with ThreadSanitizer, see
// docs/reliability.md.
#include <atomic>
#include <mutex>
#include <thread>

#include "dynains/errors.hpp"
#include "support/catch.hpp"
#include "support/runs.hpp"

namespace dynains::test {
namespace {

using Config = DynaInsRemover::Config;

std::vector<Scan> passing_van() { return drive(oncoming(), 6, 5.0); }

TEST_CASE("with a lock of the caller, the map is read while another thread pushes") {
  const Config config = GENERATE(Config::paper(), Config());
  const std::vector<Scan> scans = passing_van();
  DynaInsRemover alone(config);
  run(alone, scans);

  DynaInsRemover remover(config);
  std::mutex mutex;
  std::atomic<bool> done{false};
  std::vector<Eigen::Vector3d> copy;
  std::size_t shrunk = 0;
  std::thread viewer([&] {
    bool last_look = false;
    while (!last_look) {
      last_look = done;
      std::vector<Eigen::Vector3d> points;
      {
        const std::lock_guard<std::mutex> lock(mutex);
        points = map_points(remover);
      }
      if (points.size() < copy.size()) ++shrunk;
      copy = points;
      std::this_thread::yield();
    }
  });
  for (const Scan& scan : scans) {
    const std::lock_guard<std::mutex> lock(mutex);
    push(remover, scan);
  }
  {
    const std::lock_guard<std::mutex> lock(mutex);
    remover.flush([](const ScanVerdict&) {});
  }
  done = true;
  viewer.join();
  CHECK(shrunk == 0);
  CHECK((copy == map_points(alone)));
}

TEST_CASE("an object may go from thread to thread") {
  const Config config = GENERATE(Config::paper(), Config());
  const std::vector<Scan> scans = passing_van();
  const Run expected = run(config, scans);
  DynaInsRemover remover(config);
  std::vector<Verdict> newest;
  for (const Scan& scan : scans) {
    std::thread([&] { newest.emplace_back(push(remover, scan).newest()); }).join();
  }
  CHECK((newest == expected.newest));
}

TEST_CASE("a call during another call is refused and changes nothing") {
  const Config config = GENERATE(Config::paper(), Config());
  const std::vector<Scan> scans = passing_van();
  const Run expected = run(config, scans);
  DynaInsRemover remover(config);
  std::vector<Verdict> final;
  for (const Scan& scan : scans) {
    const FrameResult frame = push(remover, scan);
    if (frame.finished) final.emplace_back(*frame.finished);
  }
  std::atomic<int> refused{0};
  const auto expect_refusal = [&](auto&& call) {
    try {
      call();
    } catch (const UsageError&) {
      ++refused;
    }
  };
  int calls = 0;
  remover.flush([&](const ScanVerdict& verdict) {
    const auto misuse = [&] {
      expect_refusal([&] { push(remover, scans[0]); });
      expect_refusal([&] { remover.push(scans[0].points, scans[0].T_world_sensor); });
      expect_refusal([&] { remover.flush([](const ScanVerdict&) {}); });
      expect_refusal([&] { remover.reset(); });
    };
    misuse();
    std::thread(misuse).join();
    calls += 8;
    final.emplace_back(verdict);
  });
  CHECK(calls >= 8);
  CHECK(refused == calls);
  CHECK((final == expected.final));
  remover.reset();  // at rest again
  CHECK((Verdict(push(remover, scans[0]).newest()) == expected.newest[0]));
}

TEST_CASE("threads that push into one object at once get answers or UsageError, no data race") {
  const std::vector<Scan> scans = drive(yard(), 1, 0.0);
  DynaInsRemover remover(Config::paper());
  std::atomic<std::size_t> answers{0}, refusals{0};
  const auto work = [&] {
    for (int i = 0; i < 10; ++i) {
      try {
        remover.push(scans[0].points, scans[0].T_world_sensor);
        ++answers;
      } catch (const UsageError&) {
        ++refusals;
      }
    }
  };
  std::thread first(work);
  std::thread second(work);
  first.join();
  second.join();
  CHECK(answers + refusals == 20);
  std::size_t final = 0;
  remover.flush([&](const ScanVerdict&) { ++final; });
  // Verdicts that are final already were given by push.
  const std::size_t open = std::min<std::size_t>(answers, remover.latency());
  CHECK(final == open);
}

}  // namespace
}  // namespace dynains::test
