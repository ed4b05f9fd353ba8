// Verdicts by all scans of a recording, on raw arrays. A van stands in a street while the robot
// drives past it; when the robot comes back, much later, it is gone. The stream has called it
// static; the second pass removes it.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/recording/second_pass.hpp"

namespace {

struct Scan {
  dynains::PointBuffer points;  // m, sensor frame
  std::vector<bool> is_van;     // by point
  dynains::Pose T_world_sensor = dynains::Pose::Identity();
  double time = 0.0;  // s
};

constexpr double kSensorHeight = 1.8;  // m

/// Scan from (0, y) of a flat street between walls 8 m away, with a pier of 2 m every 10 m; the van
/// is 5 m long and at x = 3. The piers show that scans fit along the street, too.
Scan measure(double y, bool has_van) {
  Scan scan;
  scan.T_world_sensor.translation() = Eigen::Vector3d(0.0, y, kSensorHeight);
  for (double elevation = -0.4; elevation < 0.2; elevation += 0.02) {
    for (double azimuth = -3.14; azimuth < 3.14; azimuth += 0.01) {
      const double dx = std::cos(elevation) * std::cos(azimuth);
      const double dy = std::cos(elevation) * std::sin(azimuth);
      const double dz = std::sin(elevation);
      double range = std::abs(dx) > 0.1 ? 8.0 / std::abs(dx) : 1e9;
      if (dz < 0.0) range = std::min(range, -kSensorHeight / dz);
      for (double pier = -100.0; pier <= 180.0; pier += 10.0) {
        const double at_pier = (pier - y) / dy;
        if (at_pier > 0.0 && at_pier < range && std::abs(at_pier * dx) > 6.0) range = at_pier;
      }
      const double at_van = dx > 0.05 ? 3.0 / dx : 1e9;
      const bool hits_van = has_van && at_van < range && std::abs(y + at_van * dy) < 2.5 &&
                            kSensorHeight + at_van * dz < 2.2;
      if (hits_van) range = at_van;
      if (range > 60.0) continue;
      scan.points.push_back(static_cast<float>(range * dx), static_cast<float>(range * dy),
                            static_cast<float>(range * dz));
      scan.is_van.push_back(hits_van);
    }
  }
  return scan;
}

/// Drives past the van, 80 m on, slows down, and comes back.
std::vector<Scan> drive() {
  std::vector<Scan> scans;
  constexpr int kLast = 100;
  for (int i = 0; i <= 2 * kLast; ++i) {
    const double metres = 30.0 - 50.0 * std::cos(3.141593 * i / kLast);
    scans.push_back(measure(metres, i < kLast));
    scans.back().time = 0.1 * i;
  }
  return scans;
}

/// Share of the points of the van that are moving.
double moving_share(const std::vector<Scan>& scans,
                    const std::vector<dynains::VerdictArrays>& verdicts) {
  std::size_t all = 0, moving = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    for (std::size_t p = 0; p < scans[i].is_van.size(); ++p) {
      if (!scans[i].is_van[p]) continue;
      ++all;
      moving += verdicts[i].labels[p] == dynains::PointLabel::kDynamic ? 1 : 0;
    }
  }
  return static_cast<double>(moving) / static_cast<double>(all);
}

}  // namespace

int main() {
  const std::vector<Scan> scans = drive();
  std::vector<dynains::VerdictArrays> verdicts;  // by scan
  dynains::ByteStore store(std::filesystem::temp_directory_path());
  dynains::SecondPass pass(store);

  dynains::DynaInsRemover::Config config;
  config.build_map = false;
  dynains::DynaInsRemover remover(config);
  const auto take = [&](const dynains::ScanVerdict& verdict) {
    pass.add(scans[verdict.scan].points, verdict);
    verdicts.emplace_back().take(verdict, /*with_beliefs=*/true);
  };
  for (const Scan& scan : scans) {
    const dynains::FrameResult frame =
        remover.push(dynains::PointsView(scan.points), scan.T_world_sensor, scan.time);
    if (frame.finished) take(*frame.finished);
  }
  remover.flush(take);
  const double before = moving_share(scans, verdicts);

  pass.test();
  for (std::uint32_t i = 0; i < scans.size(); ++i) {
    pass.revise(scans[i].points, i, verdicts[i]);
  }
  const double after = moving_share(scans, verdicts);
  std::cout << "moving points of the van: " << 100.0 * before << " % by the stream, "
            << 100.0 * after << " % by all scans\n";
  return before + 0.3 < after && after > 0.9 ? 0 : 1;
}
