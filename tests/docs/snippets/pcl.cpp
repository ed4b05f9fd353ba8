// The block of embedding.md that needs PCL, with no other headers than it includes itself.
#include "embedding_2.hpp"

void on_scan(dynains::DynaInsRemover& remover,
             const pcl::PointCloud<pcl::PointXYZI>::Ptr& undistorted,
             const Eigen::Matrix3d& R_world_imu, const Eigen::Matrix3d& R_imu_lidar,
             const Eigen::Vector3d& t_imu_lidar, const Eigen::Vector3d& t_world_imu,
             double lidar_end_time) {
#include "embedding_2.inc"
}
