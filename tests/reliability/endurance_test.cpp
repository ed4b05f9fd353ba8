// Long runs of small scans: memory and time stay constant, and old scans have no influence.
//
// DYNAINS_ENDURANCE_SCANS=100000 test_reliability "[endurance]" is the long run.
#include <unistd.h>

#include "dynains/median.hpp"
#include "support/catch.hpp"
#include "support/runs.hpp"

namespace dynains::test {
namespace {

using Config = DynaInsRemover::Config;

std::size_t scan_count() {
  const char* const wanted = std::getenv("DYNAINS_ENDURANCE_SCANS");
  constexpr std::size_t kShort = 600;
  return wanted == nullptr ? kShort : static_cast<std::size_t>(std::stoul(wanted));
}

/// Every 60th point of a full scan, about 1,500 points. A car passes repeatedly.
std::vector<Scan> small_round(std::size_t count) {
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2.0 * M_PI * static_cast<double>(i) / static_cast<double>(count);
    const Scene scene = yard_with(van(22.0 - 44.0 * static_cast<double>(i) / 40.0, 4.0));
    const Scan full = scene.scan(sensor_at(2.0 * std::cos(angle), 2.0 * std::sin(angle)),
                                 0.1 * static_cast<double>(i));
    Scan small{full.T_world_sensor, full.time, {}, {}};
    for (std::size_t k = i % 7; k < full.points.size(); k += 60) {
      small.points.push_back(full.points[k]);
    }
    scans.push_back(small);
  }
  return scans;
}

double resident_megabytes() {
  std::ifstream statm("/proc/self/statm");
  double size = 0.0, resident = 0.0;
  statm >> size >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

TEST_CASE("a long run needs constant memory and time, and old scans have no influence",
          "[endurance]") {
  const bool paper = GENERATE(true, false);
  const Config config = paper ? Config::paper() : Config();
  const std::vector<Scan> round = small_round(40);
  const std::size_t count = scan_count();
  const auto push = [&](DynaInsRemover& remover, std::size_t i) {
    const Scan& scan = round[i % round.size()];
    return remover.push(scan.points, scan.T_world_sensor, 0.1 * static_cast<double>(i));
  };

  DynaInsRemover remover(config);
  std::vector<double> first_times, last_times;
  double memory_before = 0.0;
  std::size_t map_before = 0;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    const FrameResult frame = push(remover, i);
    if (i > count / 4 && i <= count / 2) first_times.push_back(frame.times.total());
    if (i > count / 4 * 3) last_times.push_back(frame.times.total());
    if (i == count / 2) {
      memory_before = resident_megabytes();
      map_before = remover.map().memory_bytes();
    }
  }
  const double growth = resident_megabytes() - memory_before -
                        static_cast<double>(remover.map().memory_bytes() - map_before) / 1e6;
  const double slower = median(last_times) / median(first_times);
  WARN((paper ? "paper: " : "default: ")
       << count << " scans, " << growth << " MB more in the second half without the map, time per "
       << "scan " << median(last_times) << " ms, " << slower << " times that of the first half");
  CHECK(growth < 8.0);
  CHECK(slower < 3.0);

  // A new remover that gets only the last scans gives an equal verdict for the newest scan.
  DynaInsRemover fresh(config);
  const std::size_t reach = paper ? static_cast<std::size_t>(config.window) : 200;
  for (std::size_t i = count - std::min(count, reach); i + 1 < count; ++i) push(fresh, i);
  const Verdict expected(push(fresh, count - 1).newest());
  const Verdict newest(push(remover, count - 1).newest());
  if (paper) {
    CHECK((newest.labels == expected.labels));
  } else {
    // Beliefs along tracks have no end, and the two removers adapted to the sensor by different
    // scans.
    CHECK(disagreement({newest}, {expected}) < 0.01);
  }
}

/// About 1,300 points of ground and of a wall with gaps, which are other ones after each metre.
std::vector<Eigen::Vector3f> passing_street(double x) {
  std::vector<Eigen::Vector3f> points;
  for (int ring = 0; ring < 16; ++ring) {
    const double elevation = (2.0 * ring - 15.0) * M_PI / 180.0;
    for (int column = 0; column < 120; ++column) {
      const double azimuth = 2.0 * M_PI * column / 120.0;
      const Eigen::Vector3d ray = ray_of(elevation, azimuth);
      double range = ray.z() < 0.0 ? -1.7 / ray.z() : 40.0;
      const double to_wall = 8.0 / std::max(std::abs(ray.y()), 1e-9);
      const auto place = static_cast<std::uint32_t>(
          static_cast<std::int64_t>(std::floor((x + ray.x() * to_wall) / 3.0)));
      if ((place * 2654435761U >> 8U) % 3U != 0) range = std::min(range, to_wall);
      if (range < 40.0) points.push_back((range * ray).cast<float>());
    }
  }
  return points;
}

TEST_CASE("without a map, memory ends to grow when all reference scans are there", "[endurance]") {
  Config config;
  config.build_map = false;
  DynaInsRemover remover(config);
  constexpr int kWarm = 1000;
  double before = 0.0;
  for (int i = 0; i < 4 * kWarm; ++i) {
    if (i == kWarm) before = resident_megabytes();
    remover.push(passing_street(0.5 * i), sensor_at(0.5 * i), 0.1 * i);
  }
  const double growth = resident_megabytes() - before;
  CAPTURE(growth);
  CHECK(growth < 1.0);  // MB in 3,000 pushes
}

}  // namespace
}  // namespace dynains::test
