// A node of ROS 1: splits clouds into static and moving points, and builds the static map.
//
//   subscribes  points         sensor_msgs/PointCloud2, in the frame of the sensor
//               /tf, /tf_static
//   publishes   ~static        the static points of each cloud, with all fields
//               ~dynamic       its moving points
//               ~map           the map of scans with a final verdict (30 scans later), latched
//               ~residual      geometry_msgs/PoseWithCovarianceStamped: the aligned motion
//   parameters  ~fixed_frame   a frame without jumps ["odom"]
//               ~tf_timeout    how long a cloud waits for its transform, s [0.2]
//               ~queue         clouds that wait [10]
//               ~map_period    time between two maps, s [2]
//               ~preset        "default", "paper", "published", "offline" or "odometry" ["default"]
//               all parameters of the remover, by their names
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_ros/transform_listener.h>

#include <cstdint>
#include <exception>
#include <string>

#include "dynains/adapters/point_cloud2.hpp"
#include "dynains/compiled_remover.hpp"
#include "ros_common/find_pose.hpp"
#include "ros_common/messages.hpp"
#include "ros_common/remover_loop.hpp"
#include "ros_common/remover_parameters.hpp"
#include "ros_common/worker.hpp"

namespace dynains_ros {
namespace {

using Cloud = sensor_msgs::PointCloud2;
using Residual = geometry_msgs::PoseWithCovarianceStamped;
using Loop = RemoverLoop<Cloud::ConstPtr>;

/// Reads private parameters. Without a value, the default stays.
struct PrivateParameters {
  ros::NodeHandle node{"~"};

  template <class Value>
  Value operator()(const std::string& name, Value value) const {
    node.param(name, value, value);
    return value;
  }
  std::int64_t operator()(const std::string& name, std::int64_t value) const {
    return (*this)(name, static_cast<int>(value));
  }
  template <class Value>
  Value operator()(const ParameterText& text, const Value& value) const {
    return (*this)(text.name, value);
  }
};

RemoverConfig read_config(const PrivateParameters& parameters) {
  RemoverConfig config = RemoverConfig::preset(parameters("preset", std::string("default")));
  set_parameters(config, parameters);
  return config;
}

Loop::Config read_loop_config(const PrivateParameters& parameters) {
  Loop::Config config;
  config.patience = parameters("tf_timeout", config.patience);
  config.map_period = parameters("map_period", config.map_period);
  const int capacity = parameters("queue", static_cast<int>(config.capacity));
  if (capacity < 1) throw dynains::ConfigError("queue = " + std::to_string(capacity) + " < 1");
  config.capacity = static_cast<std::size_t>(capacity);
  return config;
}

class RemoverNode {
 public:
  RemoverNode()
      : fixed_frame_(parameters_("fixed_frame", std::string("odom"))),
        listener_(transforms_),
        static_(parameters_.node.advertise<Cloud>("static", kQueue)),
        dynamic_(parameters_.node.advertise<Cloud>("dynamic", kQueue)),
        residual_(parameters_.node.advertise<Residual>("residual", kQueue)),
        map_(parameters_.node.advertise<Cloud>("map", 1, true)),
        loop_(read_config(parameters_), read_loop_config(parameters_)),
        worker_([this] { return step(); }),
        clouds_(public_.subscribe("points", kQueue, &RemoverNode::on_cloud, this)),
        timer_(public_.createWallTimer(ros::WallDuration(kReportPeriod), &RemoverNode::on_timer,
                                       this)) {}

 private:
  static constexpr std::uint32_t kQueue = 100;
  static constexpr double kReportPeriod = 1.0;  // s

  void on_cloud(const Cloud::ConstPtr& message) {
    if (loop_.add(message, ros::Time::now().toSec())) transforms_.clear();
    worker_.wake();
  }

  Worker::Wait step() {
    const bool has_cleaned = loop_.clean_next(
        ros::Time::now().toSec(), [this](const Cloud::ConstPtr& cloud) { return pose_of(*cloud); },
        [this](const Cloud::ConstPtr& cloud, const dynains::FrameResult& frame) {
          publish(*cloud, frame);
        });
    loop_.publish_map(ros::WallTime::now().toSec(), map_.getNumSubscribers() > 0,
                      [this](const auto& map) {
                        Cloud message = map_message<Cloud>(map, fixed_frame_);
                        message.header.stamp = newest_;
                        map_.publish(message);
                      });
    return loop_.pause_after(has_cleaned);
  }

  PoseAnswer pose_of(const Cloud& cloud) const {
    const ros::Time stamp = cloud.header.stamp;
    return find_pose(transforms_, fixed_frame_, cloud.header.frame_id, stamp, ros::Time(0),
                     [&](const ros::Time& newest) { return newest < stamp; });
  }

  void publish(const Cloud& cloud, const dynains::FrameResult& frame) {
    newest_ = cloud.header.stamp;
    static_.publish(dynains::static_points(cloud, frame.newest().labels));
    dynamic_.publish(dynains::dynamic_points(cloud, frame.newest().labels));
    if (frame.pose_residual) {
      residual_.publish(residual_message<Residual>(*frame.pose_residual, cloud.header));
    }
  }

  void on_timer(const ros::WallTimerEvent&) {
    const Diagnosis diagnosis = loop_.report(kReportPeriod);
    if (diagnosis.message == told_) return;
    told_ = diagnosis.message;
    if (diagnosis.level != Diagnosis::Level::kOk) ROS_WARN("%s", told_.c_str());
  }

  ros::NodeHandle public_;
  PrivateParameters parameters_;
  std::string fixed_frame_;
  tf2_ros::Buffer transforms_;
  tf2_ros::TransformListener listener_;  // runs in a separate thread
  ros::Publisher static_, dynamic_, residual_, map_;
  ros::Time newest_;
  Loop loop_;
  Worker worker_;
  ros::Subscriber clouds_;
  ros::WallTimer timer_;
  std::string told_;  // the last report
};

}  // namespace
}  // namespace dynains_ros

int main(int argc, char** argv) {
  ros::init(argc, argv, "dynains");
  try {
    const dynains_ros::RemoverNode node;
    ros::spin();
  } catch (const std::exception& error) {  // an invalid parameter
    ROS_FATAL("%s", error.what());
    return 1;
  }
  return 0;
}
