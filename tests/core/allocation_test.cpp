// Counts the calls of the global operator new. This test is a separate executable.
#include <atomic>
#include <new>

#include "support/catch.hpp"
#include "support/runs.hpp"

namespace {

std::atomic<std::size_t> allocations{0};

void* counted(std::size_t size) {
  ++allocations;
  if (void* const memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size == 0 ? 1 : size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace dynains::test {
namespace {

TEST_CASE("a warm remover allocates nothing, except for the map when it grows") {
  const auto base = GENERATE(DynaInsRemover::Config::paper(), DynaInsRemover::Config());
  DynaInsRemover::Config config = base;
  const bool build_map = GENERATE(false, true);
  config.build_map = build_map;
  const auto [threads, tilt] = GENERATE(table<int, double>({{1, 0.3}, {2, 0.0}}));
  config.threads = threads;
  config.objects = tilt == 0.0;
  // Short rings: after seven rounds of twelve scans, every place in them has held every scan.
  config.evidence.lookahead_scans = 6;
  config.evidence.lookback_scans = 20;
  // Back and forth over the same ground: the second time, the map contains all of it.
  const Scene scene = yard_with(van(14.0, 3.5, {-6.0, 0.0, 0.0}));
  Eigen::Isometry3d T_world_sensor = sensor_at(0.0);
  T_world_sensor.rotate(Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()));
  std::vector<Scan> scans;
  for (int i = 0; i < 12; ++i) scans.push_back(scene.scan(T_world_sensor, 0.1 * i));
  DynaInsRemover remover(config);
  double start = 0.0;
  std::size_t first = 0;
  std::size_t last = 0;
  for (int round = 0; round < 9; ++round) {
    last = 0;
    for (const Scan& scan : scans) {
      const std::size_t before = allocations;
      remover.push(scan.points, scan.T_world_sensor, start + scan.time);
      last += allocations - before;
    }
    if (round == 0) first = last;
    start += 1.2;
  }
  CHECK(first > 0);
  CHECK(last == 0);
}

TEST_CASE("a remover with reserved memory allocates nothing from the second scan on") {
  // The first scan gives the sensor model.
  DynaInsRemover::Config config =
      GENERATE(DynaInsRemover::Config::paper(), DynaInsRemover::Config());
  config.build_map = false;
  config.threads = GENERATE(1, 2);
  const Scene scene = yard_with(van(14.0, 3.5, {-6.0, 0.0, 0.0}));
  const Scan scan = scene.scan(sensor_at(0.0), 0.0);
  const auto allocations_of_later_scans = [&](DynaInsRemover& remover) {
    remover.push(scan.points, scan.T_world_sensor, 0.0);
    const std::size_t before = allocations;
    for (int i = 1; i < 40; ++i) remover.push(scan.points, scan.T_world_sensor, 0.1 * i);
    return allocations - before;
  };
  DynaInsRemover unprepared(config);
  CHECK(allocations_of_later_scans(unprepared) > 0);
  DynaInsRemover remover(config);
  remover.reserve_like(scan.points);
  CHECK(allocations_of_later_scans(remover) == 0);
}

}  // namespace
}  // namespace dynains::test
