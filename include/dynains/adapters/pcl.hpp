// Support for pcl::PointCloud. Only this header requires PCL.
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <cstddef>
#include <stdexcept>

#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Clouds of any point type with x, y, z; m, sensor frame. Organized clouds and NaN are supported.
/// Labels have the order of the cloud. For a ConstPtr, push `*cloud`.
template <class Point>
struct PointCloudTraits<pcl::PointCloud<Point>> {
  static std::size_t size(const pcl::PointCloud<Point>& cloud) { return cloud.size(); }
  static Eigen::Vector3f point(const pcl::PointCloud<Point>& cloud, std::size_t i) {
    const Point& p = cloud[i];
    return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
  }
};

/// Copy of the points of `cloud` with a static label, with all fields, header and sensor pose.
/// `labels`: by point of `cloud`. Throws std::invalid_argument if the sizes differ.
template <class Point>
pcl::PointCloud<Point> static_points(const pcl::PointCloud<Point>& cloud,
                                     Span<const PointLabel> labels) {
  if (labels.size() != cloud.size()) {
    throw std::invalid_argument("static_points: as many labels as points are needed");
  }
  pcl::PointCloud<Point> result;
  result.header = cloud.header;
  result.sensor_origin_ = cloud.sensor_origin_;
  result.sensor_orientation_ = cloud.sensor_orientation_;
  result.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (is_static(labels[i])) result.push_back(cloud[i]);
  }
  result.is_dense = cloud.is_dense;
  return result;
}

}  // namespace dynains
