// Types of the messages that are written.
#pragma once

#include <memory>
#include <string>

#include "log_file.hpp"

namespace dynains {

/// Schema of a message of ROS 2, for example "tf2_msgs/msg/TFMessage"; with its definition if it is
/// one of the types below.
std::shared_ptr<const LogSchema> ros2_schema(const std::string& name);

/// A topic of sensor_msgs/msg/PointCloud2.
LogTopic cloud_topic(const std::string& name);
/// A topic of tf2_msgs/msg/TFMessage.
LogTopic transforms_topic(const std::string& name);

}  // namespace dynains
