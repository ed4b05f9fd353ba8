// Types of the messages that are written.
#pragma once

#include <string>

#include "log_file.hpp"

namespace dynains {

struct MessageType {
  std::string name;  ///< as in ROS 1, for example "tf2_msgs/TFMessage"
  std::string md5;   ///< of the definition in ROS 1
  std::string body;  ///< definition without std_msgs/Header

  /// Name in ROS 2, for example "tf2_msgs/msg/TFMessage".
  std::string ros2_name() const;
  /// The definition with those of all types in it.
  std::string definition(MessageEncoding encoding) const;
};

const MessageType& point_cloud2_type();
const MessageType& transforms_type();

}  // namespace dynains
