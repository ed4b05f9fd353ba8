// A small but complete LiDAR odometry (small_odometry.hpp) drives through a simulated street. Its
// poses are refined as in docs/embedding.md, and both trajectories compared with the true poses.
//
//   example_odometry [scene] [sensor] [scans] [seed]
//
// for example: example_odometry crowd os1-64 200 1
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <dynains/odometry/odometry.hpp>
#include <dynains/simulation/simulator.hpp>
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

Points points_of(const dynains::simulation::SimulatedScan& scan) {
  Points points;
  for (std::size_t i = 0; i < scan.xyzi.size(); i += 4) {
    points.push_back(Eigen::Map<const Eigen::Vector3f>(&scan.xyzi[i]).cast<double>());
  }
  return points;
}

int main(int argc, char** argv) {
  dynains::simulation::Config street;
  street.scene =
      dynains::value_of_name<dynains::simulation::Scene>(argc > 1 ? argv[1] : "crowd").value();
  street.sensor =
      dynains::value_of_name<dynains::simulation::Sensor>(argc > 2 ? argv[2] : "os1-64").value();
  street.scans = argc > 3 ? std::atoi(argv[3]) : 100;
  street.seed = argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 1;
  dynains::simulation::Simulator simulator(street);

  Odometry odometry;
  dynains::Odometry corrector;
  const Eigen::Isometry3d T_first_world = simulator.scan(0).T_world_sensor.inverse();
  Errors of_odometry, refined;
  std::size_t points = 0, dynamic = 0;
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    const dynains::simulation::SimulatedScan scan = simulator.scan(i);
    const Points cloud = points_of(scan);
    const Eigen::Isometry3d T_odometry = odometry.register_scan(cloud);
    const auto result = corrector.push(cloud, {}, scan.time, T_odometry);
    for (const dynains::PointLabel label : result.frame.newest.labels) {
      dynamic += label == dynains::PointLabel::kDynamic ? 1 : 0;
    }
    points += result.frame.newest.labels.size();
    of_odometry.add(T_odometry, T_first_world * scan.T_world_sensor);
    refined.add(result.T_world_sensor, T_first_world * scan.T_world_sensor);
  }
  of_odometry.print("odometry");
  refined.print("refined");
  std::printf("%.1f %% of points are dynamic\n",
              100.0 * static_cast<double>(dynamic) / static_cast<double>(points));
  return dynamic > 0 && refined.rms() <= 1.02 * of_odometry.rms() + 0.01 ? 0 : 1;
}
