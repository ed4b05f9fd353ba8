// The block of embedding.md that needs PCL.
#include "dynains/adapters/pcl.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Geometry>

#include "dynains/compiled_remover.hpp"

void on_scan(dynains::DynaInsRemover& remover,
             const pcl::PointCloud<pcl::PointXYZI>::Ptr& undistorted,
             const Eigen::Matrix3d& R_world_imu, const Eigen::Matrix3d& R_imu_lidar,
             const Eigen::Vector3d& t_imu_lidar, const Eigen::Vector3d& t_world_imu,
             double lidar_end_time) {
#include "embedding_1.inc"
}
