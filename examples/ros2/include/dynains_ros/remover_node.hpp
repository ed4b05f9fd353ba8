// The component dynains_ros::RemoverNode of ROS 2. Topics and parameters: see docs/embedding.md.
#pragma once

#include <memory>
#include <rclcpp/rclcpp.hpp>

namespace dynains_ros {

/// Splits clouds into static and moving points, and builds the static map. Callbacks return at
/// once; a thread of the node does the work.
class RemoverNode : public rclcpp::Node {
 public:
  /// Throws dynains::ConfigError, or an exception of rclcpp, for an invalid parameter.
  explicit RemoverNode(const rclcpp::NodeOptions& options);
  ~RemoverNode() override;

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

}  // namespace dynains_ros
