// A small LiDAR odometry: point-to-plane registration of each scan to a map of earlier scans.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <nanoflann.hpp>
#include <vector>

namespace small_odometry {

using Points = std::vector<Eigen::Vector3d>;  // m, sensor frame

// Keeps the first point of each voxel of `edge` m.
inline Points thin_out(const Points& points, double edge) {
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

  explicit LocalMap(double reach) : reach_(reach) {}

  void insert(const Points& points_world, const Eigen::Vector3d& sensor) {
    points_.insert(points_.end(), points_world.begin(), points_world.end());
    points_ = thin_out(points_, 0.4);
    const auto is_far = [&](const Eigen::Vector3d& p) { return (p - sensor).norm() > reach_; };
    points_.erase(std::remove_if(points_.begin(), points_.end(), is_far), points_.end());
    tree_.buildIndex();
  }

  // Fits a plane to the neighbours of `p`: unit normal and signed distance of `p`. False if it
  // fails.
  bool plane_at(const Eigen::Vector3d& p, Eigen::Vector3d& normal, double& distance) const {
    constexpr std::size_t kNeighbours = 8;
    constexpr double kMaxRange = 1.5;   // m
    constexpr double kThickness = 0.1;  // m, largest thickness of a plane
    std::array<std::size_t, kNeighbours> near{};
    std::array<double, kNeighbours> squared{};
    const std::size_t found = tree_.knnSearch(p.data(), kNeighbours, near.data(), squared.data());
    if (found < kNeighbours || squared.back() > kMaxRange * kMaxRange) return false;

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
  double reach_;  // m, of points around the sensor
  Points points_;
  nanoflann::KDTreeSingleIndexAdaptor<Distance, LocalMap, 3, std::size_t> tree_{3, *this};
};

// Gauss-Newton on point-to-plane distances, from an initial pose.
inline Eigen::Isometry3d align(const Points& scan, const LocalMap& map,
                               Eigen::Isometry3d T_world_sensor) {
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

// Share of the points that lie within 0.2 m of a plane of the map.
inline double overlap(const Points& scan, const LocalMap& map,
                      const Eigen::Isometry3d& T_world_sensor) {
  constexpr double kNear = 0.2;  // m
  std::size_t near = 0;
  for (const Eigen::Vector3d& p : scan) {
    Eigen::Vector3d normal;
    double distance;
    const bool is_met = map.plane_at(T_world_sensor * p, normal, distance);
    near += is_met && std::abs(distance) < kNear ? 1 : 0;
  }
  return static_cast<double>(near) / static_cast<double>(std::max<std::size_t>(1, scan.size()));
}

// Odometry on its own: prediction at constant velocity, registration, and insertion into the map.
class Odometry {
 public:
  // `reach`: m, of the map around the sensor; what lies farther away is forgotten.
  explicit Odometry(double reach = 80.0) : map_(reach) {}

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

}  // namespace small_odometry
