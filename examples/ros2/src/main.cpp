#include <cstdio>
#include <exception>
#include <memory>

#include "dynains_ros/remover_node.hpp"

int main(int argc, char** argv) {
  rclcpp::init(argc, argv);
  try {
    rclcpp::spin(std::make_shared<dynains_ros::RemoverNode>(rclcpp::NodeOptions()));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "dynains_ros: %s\n", error.what());
    rclcpp::shutdown();
    return 1;
  }
  rclcpp::shutdown();
  return 0;
}
