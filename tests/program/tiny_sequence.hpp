// A small recording on disk: a floor, a wall, and a box that drives past.
#pragma once

#include "dynains/io/kitti.hpp"
#include "support/standard.hpp"

namespace dynains::test {

/// Points of scan i, sensor frame (1.7 m over the floor), with an intensity of 0.5.
inline std::vector<float> tiny_scan(std::size_t i) {
  std::vector<float> xyzi;
  const auto add = [&](double x, double y, double z) {
    for (const double value : {x, y, z, 0.5}) xyzi.push_back(static_cast<float>(value));
  };
  for (int a = 0; a < 120; ++a) {
    for (int r = 0; r < 40; ++r) {
      const double angle = 0.05236 * a;
      const double range = 4.0 + 0.25 * r;
      add(range * std::cos(angle), range * std::sin(angle), -1.7);
    }
  }
  for (int y = -20; y <= 20; ++y) {
    for (int z = 0; z < 8; ++z) add(16.0, 0.25 * y, -1.2 + 0.3 * z);
  }
  for (int y = 0; y < 24; ++y) {
    for (int z = 0; z < 8; ++z) {
      add(10.0, -8.0 + 1.5 * static_cast<double>(i % 10) + 0.07 * y, -1.3 + 0.15 * z);
    }
  }
  return xyzi;
}

inline std::string scan_name(std::size_t i) {
  const std::string digits = std::to_string(i);
  return std::string(6 - digits.size(), '0') + digits;
}

/// Writes velodyne/ and poses.txt. The sensor stands still at `position`.
inline void write_tiny_sequence(const std::filesystem::path& folder, std::size_t scans,
                                const Eigen::Vector3d& position = Eigen::Vector3d::Zero()) {
  std::filesystem::create_directories(folder / "velodyne");
  for (std::size_t i = 0; i < scans; ++i) {
    const std::vector<float> scan = tiny_scan(i);
    write_scan(folder / "velodyne" / (scan_name(i) + ".bin"), scan);
  }
  const std::vector<Pose> poses(scans, Pose(Eigen::Translation3d(position)));
  write_poses(folder / "poses.txt", poses);
}

}  // namespace dynains::test
