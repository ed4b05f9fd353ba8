// A small but complete LiDAR odometry (small_odometry.hpp) estimates the poses of a recording. They
// are refined as in docs/embedding.md, and both trajectories compared with the poses of the
// recording.
//
//   example_odometry RECORDING
//
// for example after: dynains_simulate RECORDING --scene crowd --sensor os1-64
#include <cmath>
#include <cstdio>
#include <dynains/io/recording.hpp>
#include <dynains/odometry/odometry.hpp>
#include <vector>

#include "small_odometry.hpp"

using small_odometry::Odometry;
using small_odometry::Points;

// Distances between estimated and true positions.
class Errors {
 public:
  void add(const dynains::Pose& estimated, const Eigen::Isometry3d& truth) {
    last_ = (estimated.translation() - truth.translation()).norm();
    sum_of_squares_ += last_ * last_;
    ++count_;
  }
  double rms() const { return std::sqrt(sum_of_squares_ / count_); }  // m
  void print(const char* name) const {
    std::printf("%-22s drift %.3f m, rms %.3f m\n", name, last_, rms());
  }

 private:
  double last_ = 0.0;  // m
  double sum_of_squares_ = 0.0;
  int count_ = 0;
};

Points points_of(const std::vector<float>& xyzi) {
  Points points;
  for (std::size_t i = 0; i < xyzi.size(); i += 4) {
    points.push_back(Eigen::Map<const Eigen::Vector3f>(&xyzi[i]).cast<double>());
  }
  return points;
}

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  dynains::Recording recording(argv[1]);

  Odometry odometry;
  dynains::Odometry corrector;
  const Eigen::Isometry3d T_first_world = recording.T_world_sensor(0).inverse();
  Errors of_odometry, refined;
  std::size_t points = 0, dynamic = 0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const Points cloud = points_of(recording.read_scan(i).xyzi);
    const Eigen::Isometry3d T_first_sensor = T_first_world * recording.T_world_sensor(i);
    const Eigen::Isometry3d T_odometry = odometry.register_scan(cloud);
    const auto result = corrector.push(cloud, {}, recording.time(i), T_odometry);
    for (const dynains::PointLabel label : result.frame.newest().labels) {
      dynamic += label == dynains::PointLabel::kDynamic ? 1 : 0;
    }
    points += result.frame.newest().labels.size();
    of_odometry.add(T_odometry, T_first_sensor);
    refined.add(result.T_world_sensor, T_first_sensor);
  }
  of_odometry.print("odometry");
  refined.print("refined");
  std::printf("%.1f %% of points are dynamic\n",
              100.0 * static_cast<double>(dynamic) / static_cast<double>(points));
  return dynamic > 0 && refined.rms() <= 1.02 * of_odometry.rms() + 0.01 ? 0 : 1;
}
