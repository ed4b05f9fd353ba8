// Correction of 1,000 of 10,000 scans in a map, and its memory.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "dynains/map/rebasable_static_map.hpp"
#include "street.hpp"

namespace dynains::bench {
namespace {

constexpr std::size_t kScans = 10000;

/// Scans of about 110,000 points a metre apart, on a drive with a slight bend.
Eigen::Isometry3d pose_of(std::size_t scan) {
  const auto s = static_cast<double>(scan);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(1e-3 * s, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = 1000.0 * Eigen::Vector3d(std::sin(1e-3 * s), 1.0 - std::cos(1e-3 * s), 0.0);
  return T;
}

void BM_UpdatePoses(benchmark::State& state) {
  std::vector<PointBuffer> scans;
  for (const test::Scan& scan : street_scans()) scans.push_back(buffer_of(scan));
  RebasableStaticMap::Config config;
  config.scan_voxel = 1e-3 * static_cast<double>(state.range(0));
  RebasableStaticMap map(config);
  for (std::size_t i = 0; i < kScans; ++i) map.insert(scans[i % scans.size()], {}, pose_of(i));
  double shift = 0.0;
  for (auto _ : state) {
    shift += 0.3;
    std::vector<ScanPose> poses;
    for (std::size_t i = 0; i < kScans / 10; ++i) {
      const std::size_t scan = kScans / 2 + i;
      poses.push_back({scan, pose_of(scan)});
      poses.back().T_world_sensor.translation().y() += shift;
    }
    map.update_poses(poses);
  }
  const auto points = static_cast<double>(map.stored_points());
  state.counters["points_per_scan"] = points / static_cast<double>(kScans);
  state.counters["bytes_per_point"] = static_cast<double>(map.memory_bytes()) / points;
}
BENCHMARK(BM_UpdatePoses)->Arg(200)->Arg(400)->Unit(benchmark::kMillisecond)->Iterations(3);

}  // namespace
}  // namespace dynains::bench
