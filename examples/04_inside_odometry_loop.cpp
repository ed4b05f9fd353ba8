// Inside an odometry: what moves is taken out of the newest scan before it is registered.
#include <cstdio>
#include <dynains/dyna_ins_remover.hpp>
#include <vector>

using Cloud = std::vector<Eigen::Vector3d>;

// Stands for your sensor: two house fronts along the street and a car that comes towards us.
// `x` is where the sensor really is.
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

// Stands for your registration: here it simply trusts the prediction. Yours gets a scan in which
// nothing moves, to be aligned with what it knows.
Eigen::Isometry3d align(const Cloud& still, const Eigen::Isometry3d& T_world_predicted) {
  return still.empty() ? Eigen::Isometry3d::Identity() : T_world_predicted;
}

int main() {
  dynains::DynaInsRemover::Config config;
  config.build_map = false;  // poses are predictions here; the map of an odometry is its own
  dynains::DynaInsRemover remover(config);
  const Eigen::Isometry3d T_last_newest(Eigen::Translation3d(0.5, 0.0, 0.0));  // constant speed
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  std::size_t removed = 0;

  for (int i = 0; i < 12; ++i) {
    const double time = 0.1 * i;
    const Cloud scan = read_scan(5.0 * time, time);

    // 1. Predict. The window needs a pose to within the size of a voxel, not the final one.
    if (i > 0) T_world_sensor = T_world_sensor * T_last_newest;

    // 2. Ask what moves, known now, without latency.
    const dynains::FrameResult frame = remover.push(scan, T_world_sensor, time);
    Cloud still;
    for (std::size_t k = 0; k < scan.size(); ++k) {
      if (dynains::is_static(frame.newest.labels[k])) still.push_back(scan[k]);
    }
    removed += scan.size() - still.size();
    std::printf("scan %2d: %zu points, %zu of them for registration, %.1f ms\n", i, scan.size(),
                still.size(), frame.times.total());

    // 3. Register what stands still.
    T_world_sensor = align(still, T_world_sensor);
  }

  std::printf("%zu points moved and never reached the registration\n", removed);
  return removed > 0 ? 0 : 1;
}
