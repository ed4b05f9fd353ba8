// Messages of results. The message type is a template parameter, of ROS 1 or ROS 2.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/verdict.hpp"

namespace dynains_ros {

/// A PointCloud2 with the float fields x, y and z of all points of a map, m, in the frame `frame`.
template <class Message, class Map>
Message map_message(const Map& map, const std::string& frame) {
  Message message;
  message.header.frame_id = frame;
  for (const char* name : {"x", "y", "z"}) {
    message.fields.emplace_back();
    auto& field = message.fields.back();
    field.name = name;
    field.offset = static_cast<std::uint32_t>(4 * (message.fields.size() - 1));
    field.datatype = 7;  // FLOAT32
    field.count = 1;
  }
  message.height = 1;
  message.width = static_cast<std::uint32_t>(map.size());
  message.point_step = 12;
  message.row_step = message.point_step * message.width;
  message.is_dense = true;
  message.data.resize(std::size_t{12} * map.size());
  std::uint8_t* to = message.data.data();
  map.for_each([&](const Eigen::Vector3d& point) {
    const Eigen::Vector3f xyz = point.cast<float>();
    std::memcpy(to, xyz.data(), 12);
    to += 12;
  });
  return message;
}

/// Covariance of the aligned motion as geometry_msgs/PoseWithCovariance has it: about the axes of
/// the previous scan, not of the newest one. Row-major: translation (m), rotation (rad).
inline std::array<double, 36> covariance_of_message(const dynains::PoseResidual& residual) {
  using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  Matrix6 to_previous = Matrix6::Zero();
  const Eigen::Matrix3d R = residual.T_previous_aligned.linear();
  to_previous.topLeftCorner<3, 3>() = R;
  to_previous.bottomRightCorner<3, 3>() = R;
  std::array<double, 36> result;
  Eigen::Map<Matrix6>(result.data()) =
      to_previous * Eigen::Map<const Matrix6>(residual.covariance.data()) * to_previous.transpose();
  return result;
}

/// Sets the members of a geometry_msgs/Pose or geometry_msgs/Transform.
template <class Vector, class Quaternion>
void set_rigid(const dynains::Pose& T, Vector& translation, Quaternion& rotation) {
  const Eigen::Vector3d p = T.translation();
  const Eigen::Quaterniond q(Eigen::Matrix3d(T.linear()));
  translation.x = p.x();
  translation.y = p.y();
  translation.z = p.z();
  rotation.x = q.x();
  rotation.y = q.y();
  rotation.z = q.z();
  rotation.w = q.w();
}

/// Sets a geometry_msgs/Pose.
template <class Message>
void set_pose(const dynains::Pose& T, Message& pose) {
  set_rigid(T, pose.position, pose.orientation);
}

/// The transform of a pose of `child` in `frame`, as a geometry_msgs/TransformStamped.
template <class Message, class Header>
Message transform_message(const dynains::Pose& T, const std::string& frame, const Header& child) {
  Message message;
  message.header = child;
  message.header.frame_id = frame;
  message.child_frame_id = child.frame_id;
  set_rigid(T, message.transform.translation, message.transform.rotation);
  return message;
}

/// The aligned motion since the previous scan, with its covariance, as a
/// geometry_msgs/PoseWithCovarianceStamped. `header`: that of the newest cloud. The frame of the
/// message is that of the sensor at the previous scan.
template <class Message, class Header>
Message residual_message(const dynains::PoseResidual& residual, const Header& header) {
  Message message;
  message.header = header;
  set_pose(residual.T_previous_aligned, message.pose.pose);
  const std::array<double, 36> covariance = covariance_of_message(residual);
  for (std::size_t i = 0; i < covariance.size(); ++i) message.pose.covariance[i] = covariance[i];
  return message;
}

/// The middle of an object, with x along its length. `T_fixed_world`: of the objects.
inline dynains::Pose box_pose(const dynains::MovingObject& object,
                              const dynains::Pose& T_fixed_world) {
  dynains::Pose T_world_object = dynains::Pose::Identity();
  T_world_object.translation() = object.centre;
  T_world_object.linear().topLeftCorner<2, 2>() = Eigen::Rotation2Dd(object.yaw).toRotationMatrix();
  return T_fixed_world * T_world_object;
}

/// Sets the geometry_msgs/Vector3 of the edges of a box, m.
template <class Vector>
void set_size(const dynains::MovingObject& object, Vector& size) {
  size.x = object.length;
  size.y = object.width;
  size.z = object.height;
}

/// Boxes of moving objects as a visualization_msgs/MarkerArray, which replaces the one before.
/// `T_fixed_world`: of the objects, in the frame `header.frame_id`.
template <class Message, class Header>
Message objects_message(dynains::Span<const dynains::MovingObject> objects,
                        const dynains::Pose& T_fixed_world, const Header& header) {
  constexpr int kCube = 1, kDeleteAll = 3;
  Message message;
  message.markers.resize(1 + objects.size());
  for (auto& marker : message.markers) marker.header = header;
  message.markers[0].action = kDeleteAll;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    auto& marker = message.markers[1 + i];
    marker.ns = "objects";
    marker.id = static_cast<std::int32_t>(objects[i].id);
    marker.type = kCube;
    set_pose(box_pose(objects[i], T_fixed_world), marker.pose);
    set_size(objects[i], marker.scale);
    marker.color.r = 1.0F;
    marker.color.a = 0.5F;
  }
  return message;
}

/// Boxes of moving objects as a vision_msgs/Detection3DArray, with their ids and no hypotheses.
/// `T_fixed_world`: of the objects, in the frame `header.frame_id`.
template <class Message, class Header>
Message detections_message(dynains::Span<const dynains::MovingObject> objects,
                           const dynains::Pose& T_fixed_world, const Header& header) {
  Message message;
  message.header = header;
  for (const dynains::MovingObject& object : objects) {
    message.detections.emplace_back();
    auto& detection = message.detections.back();
    detection.header = header;
    detection.id = std::to_string(object.id);
    set_pose(box_pose(object, T_fixed_world), detection.bbox.center);
    set_size(object, detection.bbox.size);
  }
  return message;
}

}  // namespace dynains_ros
