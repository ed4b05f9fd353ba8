// A node of ROS 1: splits clouds into static and moving points, and builds the static map.
//
//   subscribes  points         sensor_msgs/PointCloud2, in the frame of the sensor, or ~topics
//               /tf, /tf_static
//   publishes   ~static        the static points of each cloud, with all fields; of the second of
//                              several topics ~static_2, and so on
//               ~dynamic       its moving points
//               ~map           the map of scans with a final verdict (30 scans later), latched
//               ~residual      geometry_msgs/PoseWithCovarianceStamped: the aligned motion
//               ~odom          with ~publish_odom: geometry_msgs/PoseStamped, and its transform
//   parameters  ~fixed_frame   a frame without jumps ["odom"]
//               ~topics        topics of clouds, A,B,C; those of one time are one frame ["points"]
//               ~sensor_frames by topic, the frame of the LiDAR, A,B,C [frames of the clouds]
//               ~odometry      poses are found by the clouds alone; then there is no map [false]
//               ~publish_odom  [false]
//               ~tf_timeout    how long a cloud waits for its transform, s [0.2]
//               ~queue         clouds that wait [10]
//               ~map_period    time between two maps, s [2]
//               ~preset        "default", "paper", "published", "offline" or "odometry" ["default"]
//               all parameters of the remover, by their names
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include <cstdint>
#include <exception>
#include <string>
#include <vector>

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
using JoinedClouds = Frame<Cloud::ConstPtr>;

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

Loop::Config read_loop_config(const PrivateParameters& parameters, std::size_t topics) {
  Loop::Config config;
  config.topics = topics;
  config.sensor_frames = names_in(parameters("sensor_frames", std::string()));
  config.patience = parameters("tf_timeout", config.patience);
  config.map_period = parameters("map_period", config.map_period);
  config.odometry = parameters("odometry", config.odometry);
  const int capacity = parameters("queue", static_cast<int>(config.capacity));
  if (capacity < 1) throw dynains::ConfigError("queue = " + std::to_string(capacity) + " < 1");
  config.capacity = static_cast<std::size_t>(capacity);
  return config;
}

class RemoverNode {
 public:
  RemoverNode()
      : fixed_frame_(parameters_("fixed_frame", std::string("odom"))),
        has_odom_(parameters_("publish_odom", false)),
        topics_(names_in(parameters_("topics", std::string("points")))),
        listener_(transforms_),
        static_(advertise("static")),
        dynamic_(advertise("dynamic")),
        residual_(parameters_.node.advertise<Residual>("residual", kQueue)),
        odom_(parameters_.node.advertise<geometry_msgs::PoseStamped>("odom", kQueue)),
        map_(parameters_.node.advertise<Cloud>("map", 1, true)),
        loop_(read_config(parameters_), read_loop_config(parameters_, topics_.size())),
        worker_([this] { return step(); }),
        timer_(public_.createWallTimer(ros::WallDuration(kReportPeriod), &RemoverNode::on_timer,
                                       this)) {
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      const boost::function<void(const Cloud::ConstPtr&)> take =
          [this, i](const Cloud::ConstPtr& cloud) { on_cloud(cloud, i); };
      clouds_.push_back(public_.subscribe<Cloud>(topics_[i], kQueue, take));
    }
  }

 private:
  static constexpr std::uint32_t kQueue = 100;
  static constexpr double kReportPeriod = 1.0;  // s

  /// By topic.
  std::vector<ros::Publisher> advertise(const std::string& name) {
    std::vector<ros::Publisher> result;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      result.push_back(parameters_.node.advertise<Cloud>(numbered(name, i), kQueue));
    }
    return result;
  }

  void on_cloud(const Cloud::ConstPtr& message, std::size_t topic) {
    if (loop_.add(message, ros::Time::now().toSec(), topic)) transforms_.clear();
    worker_.wake();
  }

  Worker::Wait step() {
    const bool has_cleaned = loop_.clean_next(
        ros::Time::now().toSec(), [this](const Cloud::ConstPtr& cloud) { return pose_of(*cloud); },
        [this](const std::string& frame, const std::string& other) {
          return find_extrinsic(transforms_, frame, other, ros::Time(0));
        },
        [this](const JoinedClouds& clouds, const Cleaned& cleaned) { publish(clouds, cleaned); });
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

  /// A cloud that is not judged passes whole.
  void publish(const JoinedClouds& clouds, const Cleaned& cleaned) {
    auto header = clouds.anchor()->header;
    header.frame_id = cleaned.frame_id;
    newest_ = header.stamp;
    const bool is_judged = !cleaned.labels.empty();
    cleaned.for_each_cloud(clouds, [&](std::size_t i, const Cloud& cloud, const auto& labels) {
      static_[i].publish(is_judged ? dynains::static_points(cloud, labels) : cloud);
      if (is_judged) dynamic_[i].publish(dynains::dynamic_points(cloud, labels));
    });
    if (cleaned.frame.pose_residual) {
      residual_.publish(residual_message<Residual>(*cleaned.frame.pose_residual, header));
    }
    if (!has_odom_ || !cleaned.T_odom_sensor) return;
    geometry_msgs::PoseStamped odom;
    odom.header = header;
    odom.header.frame_id = fixed_frame_;
    set_pose(*cleaned.T_odom_sensor, odom.pose);
    odom_.publish(odom);
    broadcaster_.sendTransform(transform_message<geometry_msgs::TransformStamped>(
        *cleaned.T_odom_sensor, fixed_frame_, header));
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
  bool has_odom_;
  std::vector<std::string> topics_;
  tf2_ros::Buffer transforms_;
  tf2_ros::TransformListener listener_;  // runs in a separate thread
  tf2_ros::TransformBroadcaster broadcaster_;
  std::vector<ros::Publisher> static_, dynamic_;  // by topic
  ros::Publisher residual_, odom_, map_;
  ros::Time newest_;
  Loop loop_;
  Worker worker_;
  std::vector<ros::Subscriber> clouds_;
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
