// Behind an odometry: the pose of the newest scan is corrected, and its moving points are removed.
#include <cmath>
#include <cstdio>
#include <dynains/odometry/odometry.hpp>
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

// Replaces a registration. Its motion from scan to scan is wrong by 5 cm.
Eigen::Isometry3d register_motion(const Cloud& /*scan*/) {
  return Eigen::Isometry3d(Eigen::Translation3d(0.5, 0.05, 0.0));
}

int main() {
  using dynains::PointLabel;
  dynains::Odometry corrector;
  Eigen::Isometry3d T_odometry = Eigen::Isometry3d::Identity();  // poses of the odometry alone
  double y = 0.0;                                                // m, corrected
  Cloud map;                                                     // replaces the map of the odometry
  std::size_t removed = 0;

  for (int i = 0; i < 12; ++i) {
    const double time = 0.1 * i;
    const Cloud scan = read_scan(5.0 * time, time);

    // 1. Register all points.
    if (i > 0) T_odometry = T_odometry * register_motion(scan);

    // 2. Correct the pose of the odometry.
    const auto result = corrector.push(scan, {}, time, T_odometry);
    y = result.T_world_sensor.translation().y();

    // 3. Insert the static points into the map. Points out of range are not judged and stay.
    // kInvalid marks points that are no measurement (NaN, no return).
    Cloud still;
    for (std::size_t k = 0; k < scan.size(); ++k) {
      const PointLabel label = result.frame.newest().labels[k];
      if (label != PointLabel::kDynamic && label != PointLabel::kInvalid) still.push_back(scan[k]);
    }
    removed += scan.size() - still.size();
    for (const Eigen::Vector3d& p : still) map.push_back(result.T_world_sensor * p);
    std::printf("scan %2d: %zu points, %zu of them static, y = %.3f m, %.1f ms\n", i, scan.size(),
                still.size(), y, result.frame.times.total());
  }

  std::printf("%zu points moved and did not reach the map of %zu\n", removed, map.size());
  const bool is_corrected = std::abs(y) < 0.1;
  return removed > 0 && is_corrected ? 0 : 1;
}
