// Inside an odometry: moving points are removed from the newest scan before its registration.
#include <cstdio>
#include <dynains/remover.hpp>
#include <vector>

using Cloud = std::vector<Eigen::Vector3d>;

// Replaces a sensor: two house fronts along the street and an oncoming car. `x` (m) is the true
// position of the sensor.
Cloud read_scan(double x, double time) {
  Cloud points;
  for (double along = -20.0; along < 40.0; along += 0.1) {
    for (double z = -1.0; z < 3.0; z += 0.4) {
      points.emplace_back(along - x, 8.0, z);
      points.emplace_back(along - x, -8.0, z);
    }
  }
  for (double along = 0.0; along < 4.0; along += 0.1) {
    const double car_x = 25.0 - 10.0 * time + along;
    for (double z = -1.0; z < 0.6; z += 0.2) points.emplace_back(car_x - x, 3.0, z);
  }
  return points;
}

// Replaces a registration, which aligns a scan without moving points with a map without moving
// points.
Eigen::Isometry3d align(const Cloud& /*still*/, const Cloud& /*map*/,
                        const Eigen::Isometry3d& T_world_predicted) {
  return T_world_predicted;
}

int main() {
  using dynains::PointLabel;
  dynains::DynaInsRemover::Config config;
  config.build_map = false;  // pushed poses are not final, and an odometry has its own map
  dynains::DynaInsRemover remover(config);
  const Eigen::Isometry3d T_last_newest(Eigen::Translation3d(0.5, 0.0, 0.0));  // constant speed
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  Cloud map;  // replaces the map of the odometry
  std::size_t removed = 0;

  for (int i = 0; i < 12; ++i) {
    const double time = 0.1 * i;
    const Cloud scan = read_scan(5.0 * time, time);

    // 1. A pose with an error of a few centimetres: the prediction of an IMU, or a first
    // registration with all points (docs/embedding.md). Here the prediction is exact.
    if (i > 0) T_world_sensor = T_world_sensor * T_last_newest;

    // 2. Push the scan for a verdict without latency. Points out of range are not judged and stay.
    // kInvalid marks points that are no measurement (NaN, no return).
    const dynains::FrameResult frame = remover.push(scan, T_world_sensor, time);
    Cloud still;
    for (std::size_t k = 0; k < scan.size(); ++k) {
      const PointLabel label = frame.newest.labels[k];
      if (label != PointLabel::kDynamic && label != PointLabel::kInvalid) still.push_back(scan[k]);
    }
    removed += scan.size() - still.size();
    std::printf("scan %2d: %zu points, %zu of them for registration, %.1f ms\n", i, scan.size(),
                still.size(), frame.times.total());

    // 3. Register the remaining points, starting from the pose of step 1.
    T_world_sensor = align(still, map, T_world_sensor);

    // 4. Insert the remaining points into the map.
    for (const Eigen::Vector3d& p : still) map.push_back(T_world_sensor * p);
  }

  std::printf("%zu points moved and reached neither the registration nor the map of %zu\n", removed,
              map.size());
  return removed > 0 ? 0 : 1;
}
