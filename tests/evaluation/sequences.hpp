// Small labelled sequences on disk, for tests of the evaluation commands.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/io/kitti.hpp"
#include "io/files.hpp"
#include "scenes.hpp"

namespace dynains::evaluation::testing {

using test::read_text;
using test::TemporaryFolder;

inline bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

inline std::string scan_name(std::size_t number) {
  const std::string digits = std::to_string(number);
  return std::string(6 - digits.size(), '0') + digits;
}

/// Flat ground, a wall and a box of a car (instance 3) that moves `speed` m per scan along y.
inline OwnedScan street_scan(std::size_t number, double speed) {
  OwnedScan scan;
  for (int ring = 0; ring < 12; ++ring) {
    for (int step = 0; step < 240; ++step) {
      const double angle = step * 2 * 3.14159265358979 / 240;
      const double range = 4.0 + 1.5 * ring;
      scan.add(static_cast<float>(range * std::cos(angle)),
               static_cast<float>(range * std::sin(angle)), -1.7F, kRoad);
    }
  }
  for (int column = 0; column < 120; ++column) {
    for (int row = 0; row < 12; ++row) {
      scan.add(-10.0F, -9.0F + 0.15F * static_cast<float>(column),
               -1.4F + 0.25F * static_cast<float>(row), 50);
    }
  }
  const auto y = static_cast<float>(-4.0 + speed * static_cast<double>(number));
  for (int column = 0; column < 60; ++column) {
    for (int row = 0; row < 8; ++row) {
      scan.add(9.0F, y + 0.05F * static_cast<float>(column),
               -1.3F + 0.15F * static_cast<float>(row), kMovingCar | 3U << 16U);
    }
  }
  scan.time = 0.1 * static_cast<double>(number);
  return scan;
}

/// Writes the scans as a sequence; returns them.
inline std::vector<OwnedScan> write_street(const std::filesystem::path& folder, std::size_t scans,
                                           double speed = 1.0) {
  std::filesystem::create_directories(folder / "velodyne");
  std::filesystem::create_directories(folder / "labels");
  std::vector<OwnedScan> result;
  std::vector<Pose> poses;
  std::vector<double> times;
  for (std::size_t number = 0; number < scans; ++number) {
    result.push_back(street_scan(number, speed));
    const OwnedScan& scan = result.back();
    std::vector<float> xyzi;
    for (std::size_t i = 0; i < scan.truth.size(); ++i) {
      xyzi.insert(xyzi.end(), {scan.xyz[3 * i], scan.xyz[3 * i + 1], scan.xyz[3 * i + 2], 0.5F});
    }
    write_scan(folder / "velodyne" / (scan_name(number) + ".bin"), xyzi);
    write_labels(folder / "labels" / (scan_name(number) + ".label"), scan.truth);
    poses.push_back(scan.T_world_sensor);
    times.push_back(scan.time);
  }
  write_poses(folder / "poses.txt", poses);
  write_times(folder / "times.txt", times);
  return result;
}

/// Labels of a run that is right except for the first `missed` moving points of each scan: final
/// labels, or the verdicts without latency ("online").
inline void write_run(const std::filesystem::path& out, const std::vector<OwnedScan>& scans,
                      std::size_t missed, const std::string& kind = "labels") {
  std::filesystem::create_directories(out / kind);
  for (std::size_t number = 0; number < scans.size(); ++number) {
    std::vector<std::uint32_t> labels;
    std::size_t moving = 0;
    for (const std::uint32_t truth : scans[number].truth) {
      const bool found = semantic_class(truth) == kMovingCar && moving++ >= missed;
      labels.push_back(found ? 251 : 9);
    }
    write_labels(out / kind / (scan_name(number) + ".label"), labels);
  }
}

}  // namespace dynains::evaluation::testing
