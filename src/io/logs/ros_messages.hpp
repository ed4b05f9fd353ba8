// Messages of ROS 1 and ROS 2 that hold scans and poses, decoded without ROS.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/pose.hpp"
#include "log_file.hpp"

namespace dynains {

/// A serialised message and its place, for error messages.
struct SerialisedMessage {
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
  MessageEncoding encoding = MessageEncoding::kCdr;
  std::filesystem::path place;  ///< for example "drive.mcap: /points at 12.5 s"
};

/// Pose of a frame in another one at a time.
struct StampedPose {
  double time = 0.0;  ///< s, stamp of the header
  std::string frame;  ///< the parent, for example "odom"
  std::string child;  ///< for example "base_link"; empty if the type does not name it
  Pose T_frame_child = Pose::Identity();
};

/// Everything about a cloud except its points.
struct CloudInfo {
  double time = 0.0;  ///< s, stamp of the header
  std::string frame;  ///< of the points
  std::size_t points = 0;
  PointColumns columns;
};

/// Which points of a cloud, put together from those of several sensors, are of which one.
struct Concatenation {
  struct Part {
    std::string frame;  ///< of the sensor
    std::size_t begin = 0, length = 0;
  };
  double time = 0.0;  ///< s, stamp of the cloud
  std::vector<Part> parts;
};

/// Whether read_cloud() decodes the type: sensor_msgs/PointCloud2, and CustomMsg of Livox.
bool is_cloud_type(const std::string& type);

/// Whether the type is that of a list of transforms: tf2_msgs/TFMessage, or tf/tfMessage.
bool is_transform_type(const std::string& type);

/// Whether read_concatenation() decodes the type:
/// autoware_sensing_msgs/ConcatenatedPointCloudInfo.
bool is_concatenation_type(const std::string& type);

/// Whether read_poses() decodes the type: transforms, nav_msgs/Odometry, and
/// geometry_msgs/PoseStamped, PoseWithCovarianceStamped and TransformStamped.
bool is_pose_type(const std::string& type);

/// Checks the header and the size of a cloud. Throws IoError that begins with the place of the
/// message.
CloudInfo inspect_cloud(const std::string& type, const SerialisedMessage& message);

/// Decodes a cloud. Points keep their values, NaN included; memory of `scan` is reused. Fields of a
/// PointCloud2 are found by name, those of other names are ignored:
///
///   x y z      float32 or float64
///   intensity  also i, reflectivity: any type
///   ring       also channel, line: any type
///   time       also t, timestamp, time_stamp, offset_time: any type
///
/// Throws IoError that begins with the place of the message.
void read_cloud(const std::string& type, const SerialisedMessage& message, RecordedScan& scan);

/// The field `label` (also class) of a PointCloud2.
std::vector<std::uint32_t> read_cloud_labels(const std::string& type,
                                             const SerialisedMessage& message);

/// Throws IoError that begins with the place of the message.
Concatenation read_concatenation(const SerialisedMessage& message);

/// Decodes all poses of a message. Throws IoError that begins with the place of the message, also
/// if a pose is not finite or a quaternion not of length 1.
std::vector<StampedPose> read_poses(const std::string& type, const SerialisedMessage& message);

}  // namespace dynains
