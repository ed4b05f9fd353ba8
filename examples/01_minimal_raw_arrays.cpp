// Input: scans as plain arrays. Output: labels and a static map.
#include <cstdio>
#include <dynains/compiled_remover.hpp>
#include <vector>

// Replaces a driver: a wall 10 m ahead, and a box that moves to the left at 5 m/s.
std::vector<float> read_scan(int i) {
  std::vector<float> xyzi;  // x y z intensity
  for (float y = -5.0F; y < 5.0F; y += 0.05F) {
    for (float z = -1.0F; z < 2.0F; z += 0.2F) {
      xyzi.insert(xyzi.end(), {10.0F, y, z, 0.5F});
      const bool on_box = y > -1.0F && y < 1.0F && z < 1.0F;
      if (on_box) xyzi.insert(xyzi.end(), {6.0F, y - 2.5F + 0.5F * static_cast<float>(i), z, 0.9F});
    }
  }
  return xyzi;
}

int main() {
  dynains::DynaInsRemover::Config config;
  config.ground.sensor_height = 1.7;  // m; see also DynaInsRemover::Config::paper()
  dynains::DynaInsRemover remover(config);

  const auto report = [](const dynains::ScanVerdict& verdict) {
    int moving = 0;
    for (const dynains::PointLabel label : verdict.labels) {
      moving += label == dynains::PointLabel::kDynamic;
    }
    std::printf("scan %2d: %4d of %zu points move\n", static_cast<int>(verdict.scan), moving,
                verdict.labels.size());
  };

  for (int i = 0; i < 10; ++i) {
    const std::vector<float> xyzi = read_scan(i);
    const Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    const double time = 0.1 * i;  // s
    const dynains::RawPoints cloud{xyzi.data(), xyzi.size() / 4, /*stride=*/4};
    const dynains::FrameResult frame = remover.push(cloud, T_world_sensor, time);
    if (frame.finished) report(*frame.finished);  // a scan whose verdict is now final
  }
  remover.flush(report);  // the last scans

  std::printf("%zu points on the static map\n", remover.map().size());
  return remover.map().empty() ? 1 : 0;
}
