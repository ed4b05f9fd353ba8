// A small but complete LiDAR odometry: point-to-plane registration of each scan to a map of earlier
// scans. It drives through a simulated street, refines its poses as in docs/embedding.md, and
// compares both trajectories with the true poses.
//
//   example_odometry [scene] [sensor] [scans] [seed]
//
// for example: example_odometry crowd os1-64 200 1
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <dynains/remover.hpp>
#include <dynains/simulation/simulator.hpp>
#include <map>
#include <nanoflann.hpp>
#include <vector>

#include "odometry_loop.hpp"

using odometry_loop::Points;

// Keeps the first point of each voxel of `edge` m.
Points thin_out(const Points& points, double edge) {
  std::map<std::array<int, 3>, Eigen::Vector3d> voxels;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3i v = (p / edge).array().floor().cast<int>();
    voxels.try_emplace({v.x(), v.y(), v.z()}, p);
  }
  Points result;
  for (const auto& [voxel, p] : voxels) result.push_back(p);
  return result;
}

// Points around the sensor in the world frame, with a search tree.
class LocalMap {
 public:
  // Interface for nanoflann.
  std::size_t kdtree_get_point_count() const { return points_.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t k) const {
    return points_[i][static_cast<Eigen::Index>(k)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }

  bool empty() const { return points_.empty(); }

  void insert(const Points& points_world, const Eigen::Vector3d& sensor) {
    constexpr double kReach = 80.0;  // m
    points_.insert(points_.end(), points_world.begin(), points_world.end());
    points_ = thin_out(points_, 0.4);
    const auto is_far = [&](const Eigen::Vector3d& p) { return (p - sensor).norm() > kReach; };
    points_.erase(std::remove_if(points_.begin(), points_.end(), is_far), points_.end());
    tree_.buildIndex();
  }

  // Fits a plane to the neighbours of `p`: unit normal and signed distance of `p`. False if it
  // fails.
  bool plane_at(const Eigen::Vector3d& p, Eigen::Vector3d& normal, double& distance) const {
    constexpr std::size_t kNeighbours = 8;
    constexpr double kFarthest = 1.5;   // m
    constexpr double kThickness = 0.1;  // m, largest thickness of a plane
    std::array<std::size_t, kNeighbours> near{};
    std::array<double, kNeighbours> squared{};
    const std::size_t found = tree_.knnSearch(p.data(), kNeighbours, near.data(), squared.data());
    if (found < kNeighbours || squared.back() > kFarthest * kFarthest) return false;

    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const std::size_t i : near) mean += points_[i] / double{kNeighbours};
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const std::size_t i : near) {
      scatter += (points_[i] - mean) * (points_[i] - mean).transpose() / double{kNeighbours};
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(scatter);
    const Eigen::Vector3d spread = solver.eigenvalues();  // ascending
    const bool is_line = spread[1] < 0.1 * spread[2];     // one ring of the sensor
    if (spread[0] > kThickness * kThickness || is_line) return false;
    normal = solver.eigenvectors().col(0);
    distance = normal.dot(p - mean);
    return true;
  }

 private:
  using Distance = nanoflann::L2_Simple_Adaptor<double, LocalMap, double, std::size_t>;
  Points points_;
  nanoflann::KDTreeSingleIndexAdaptor<Distance, LocalMap, 3, std::size_t> tree_{3, *this};
};

// Gauss-Newton on point-to-plane distances, from an initial pose.
Eigen::Isometry3d align(const Points& scan, const LocalMap& map, Eigen::Isometry3d T_world_sensor) {
  constexpr int kIterations = 20;
  constexpr double kScale = 0.2;  // m; larger distances have less weight (Geman-McClure)
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Identity() * 1e-6;
    Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
    for (const Eigen::Vector3d& p : scan) {
      const Eigen::Vector3d rotated = T_world_sensor.linear() * p;
      Eigen::Vector3d normal;
      double distance;
      if (!map.plane_at(rotated + T_world_sensor.translation(), normal, distance)) continue;
      const double loss = kScale / (kScale + distance * distance / kScale);
      Eigen::Matrix<double, 6, 1> J;
      J << normal, rotated.cross(normal);
      A += loss * loss * J * J.transpose();
      b -= loss * loss * J * distance;
    }
    const Eigen::Matrix<double, 6, 1> step = A.ldlt().solve(b);
    const Eigen::Vector3d turn = step.tail<3>();
    T_world_sensor.translation() += step.head<3>();
    const Eigen::Quaterniond turned = Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()) *
                                      Eigen::Quaterniond(T_world_sensor.linear());
    T_world_sensor.linear() = turned.normalized().toRotationMatrix();
    if (step.norm() < 1e-4) break;
  }
  return T_world_sensor;
}

// Odometry on its own: prediction at constant velocity, registration, and insertion into the map.
class Odometry {
 public:
  Eigen::Isometry3d register_scan(const Points& scan) {
    Eigen::Isometry3d T_world_sensor = T_world_last_ * T_last_newest_;
    if (!map_.empty()) T_world_sensor = align(thin_out(scan, 1.0), map_, T_world_sensor);
    Points in_world = thin_out(scan, 0.4);
    for (Eigen::Vector3d& p : in_world) p = T_world_sensor * p;
    map_.insert(in_world, T_world_sensor.translation());
    T_last_newest_ = T_world_last_.inverse() * T_world_sensor;
    T_world_last_ = T_world_sensor;
    return T_world_sensor;
  }

 private:
  LocalMap map_;
  Eigen::Isometry3d T_world_last_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_last_newest_ = Eigen::Isometry3d::Identity();
};

// Distances between estimated and true positions.
class Errors {
 public:
  void add(const Eigen::Isometry3d& estimated, const Eigen::Isometry3d& truth) {
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
  street.scene = dynains::simulation::scene_from_name(argc > 1 ? argv[1] : "crowd");
  street.sensor = dynains::simulation::sensor_from_name(argc > 2 ? argv[2] : "os1-64");
  street.scans = argc > 3 ? std::atoi(argv[3]) : 100;
  street.seed = argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 1;
  dynains::simulation::Simulator simulator(street);

  Odometry odometry;
  Eigen::Isometry3d T_odometry;
  odometry_loop::RefinedOdometry loop(
      [&](const Points& scan) { return T_odometry = odometry.register_scan(scan); });
  const Eigen::Isometry3d T_first_world = simulator.scan(0).T_world_sensor.inverse();
  Errors of_odometry, refined;
  std::size_t points = 0, dynamic = 0;
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    const dynains::simulation::SimulatedScan scan = simulator.scan(i);
    const auto result = loop.push(points_of(scan), scan.time);
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
