#include "dynains_ros/remover_node.hpp"

#if __has_include(<tf2_ros/buffer.hpp>)  // newer releases
#include <tf2_ros/buffer.hpp>
#include <tf2_ros/transform_broadcaster.hpp>
#include <tf2_ros/transform_listener.hpp>
#else
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>
#endif

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <functional>
#include <geometry_msgs/msg/pose_with_covariance_stamped.hpp>
#include <geometry_msgs/msg/transform_stamped.hpp>
#include <memory>
#include <nav_msgs/msg/odometry.hpp>
#include <optional>
#include <rclcpp_components/register_node_macro.hpp>
#include <sensor_msgs/msg/point_cloud2.hpp>
#include <string>
#include <utility>
#include <vector>
#include <visualization_msgs/msg/marker_array.hpp>

#if __has_include(<vision_msgs/msg/detection3_d_array.hpp>)
#include <vision_msgs/msg/detection3_d_array.hpp>
#endif

#include "dynains/adapters/point_cloud2.hpp"
#include "ros_common/find_pose.hpp"
#include "ros_common/messages.hpp"
#include "ros_common/remover_loop.hpp"
#include "ros_common/remover_parameters.hpp"
#include "ros_common/worker.hpp"

namespace dynains_ros {
namespace {

using Cloud = sensor_msgs::msg::PointCloud2;
using Residual = geometry_msgs::msg::PoseWithCovarianceStamped;
using Diagnostics = diagnostic_msgs::msg::DiagnosticArray;
using Odometry = nav_msgs::msg::Odometry;
using Markers = visualization_msgs::msg::MarkerArray;
using Header = decltype(Cloud::header);
using Transform = geometry_msgs::msg::TransformStamped;
using Loop = RemoverLoop<Cloud::ConstSharedPtr>;
using JoinedClouds = Frame<Cloud::ConstSharedPtr>;

/// Declares parameters that are fixed while the node runs: rclcpp refuses to change them.
class FixedParameters {
 public:
  explicit FixedParameters(rclcpp::Node& node) : node_(node) {}

  template <class Value>
  Value operator()(const ParameterText& text, const Value& value) const {
    rcl_interfaces::msg::ParameterDescriptor descriptor;
    descriptor.description = text.description;
    descriptor.read_only = true;
    if (text.is_bounded) set_range(descriptor, text, value);
    return node_.declare_parameter(text.name, value, descriptor);
  }

 private:
  static void set_range(rcl_interfaces::msg::ParameterDescriptor& descriptor,
                        const ParameterText& text, double) {
    descriptor.floating_point_range.emplace_back();
    descriptor.floating_point_range[0].from_value = text.min;
    descriptor.floating_point_range[0].to_value = text.max;
  }
  static void set_range(rcl_interfaces::msg::ParameterDescriptor& descriptor,
                        const ParameterText& text, std::int64_t) {
    constexpr double kMaxCount = 9e18;  // an integer of 64 bits holds it
    descriptor.integer_range.emplace_back();
    descriptor.integer_range[0].from_value =
        static_cast<std::int64_t>(std::max(text.min, -kMaxCount));
    descriptor.integer_range[0].to_value = static_cast<std::int64_t>(std::min(text.max, kMaxCount));
    descriptor.integer_range[0].step = 1;
  }
  template <class Value>
  static void set_range(rcl_interfaces::msg::ParameterDescriptor&, const ParameterText&,
                        const Value&) {}

  rclcpp::Node& node_;
};

RemoverConfig declare_remover(rclcpp::Node& node) {
  const FixedParameters declare(node);
  RemoverConfig config =
      RemoverConfig::preset(declare({"preset",
                                     "configuration whose values the other parameters replace: "
                                     "default|paper|published|offline|odometry"},
                                    std::string("default")));
  set_parameters(config, declare);
  return config;
}

Loop::Config declare_loop(rclcpp::Node& node, std::size_t topics) {
  const FixedParameters declare(node);
  Loop::Config config;
  config.patience = declare({"tf_timeout",
                             "how long a cloud waits for its transform, by the clock of the node "
                             "[s]",
                             true, 0.0, 60.0},
                            config.patience);
  config.capacity = static_cast<std::size_t>(
      declare({"queue", "clouds that wait; of more, the oldest is left out", true, 1, 1000},
              static_cast<std::int64_t>(config.capacity)));
  config.map_period = declare({"map_period", "least time between two maps [s]", true, 0.0, 3600.0},
                              config.map_period);
  config.odometry = declare({"odometry",
                             "poses are found by the clouds alone, without transforms; then there "
                             "is no map"},
                            config.odometry);
  config.topics = topics;
  config.sensor_frames = names_in(declare(
      {"sensor_frames", "by topic, the frame of the LiDAR, A,B,C; empty: the frames of the clouds"},
      std::string()));
  return config;
}

/// The user may override the quality of service by parameters qos_overrides./TOPIC.
template <class Options>
Options overridable() {
  Options options;
  options.qos_overriding_options = rclcpp::QosOverridingOptions::with_default_policies();
  return options;
}

/// rclcpp has no transient local topics within a process.
rclcpp::SubscriptionOptions between_processes() {
  rclcpp::SubscriptionOptions options;
  options.use_intra_process_comm = rclcpp::IntraProcessSetting::Disable;
  return options;
}

}  // namespace

class RemoverNode::Work {
 public:
  explicit Work(RemoverNode& node)
      : node_(node),
        fixed_frame_(
            FixedParameters(node)({"fixed_frame", "frame without jumps, in which the map is built"},
                                  std::string("odom"))),
        has_odom_(FixedParameters(node)(
            {"publish_odom", "with odometry: publish odom and its transform"}, false)),
        topics_(names_in(FixedParameters(node)(
            {"topics", "topics of clouds, A,B,C; those of one time are one frame of the first one"},
            std::string("points")))),
        loop_(declare_remover(node), declare_loop(node, topics_.size())),
        transforms_(node.get_clock()),
        listener_(transforms_, &node, true, tf2_ros::DynamicListenerQoS(),
                  tf2_ros::StaticListenerQoS(), between_processes(), between_processes()) {
    const auto options = overridable<rclcpp::PublisherOptions>();
    const rclcpp::SensorDataQoS sensor;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      static_.push_back(node.create_publisher<Cloud>(numbered("static", i), sensor, options));
      dynamic_.push_back(node.create_publisher<Cloud>(numbered("dynamic", i), sensor, options));
    }
    residual_ = node.create_publisher<Residual>("~/residual", sensor, options);
    offer_objects("~/objects", objects_message<Markers, Header>);
#if __has_include(<vision_msgs/msg/detection3_d_array.hpp>)
    offer_objects("~/detections", detections_message<vision_msgs::msg::Detection3DArray, Header>);
#endif
    auto map_options = options;
    map_options.use_intra_process_comm = rclcpp::IntraProcessSetting::Disable;
    if (has_odom_) {
      odom_ = node.create_publisher<Odometry>("odom", sensor, options);
      broadcaster_.emplace(node);
    }
    map_ = node.create_publisher<Cloud>("map", rclcpp::QoS(1).reliable().transient_local(),
                                        map_options);
    diagnostics_ = node.create_publisher<Diagnostics>("/diagnostics", 10);
    maps_.emplace([this](std::unique_ptr<Cloud> map) {
      loop_.attempt([&] { map_->publish(std::move(map)); });
    });
    worker_.emplace([this] { return step(); });
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      clouds_.push_back(node.create_subscription<Cloud>(
          topics_[i], sensor,
          [this, i](Cloud::ConstSharedPtr cloud) { on_cloud(std::move(cloud), i); },
          overridable<rclcpp::SubscriptionOptions>()));
    }
    timer_ = node.create_wall_timer(kReportPeriod, [this] { report(); });
  }

 private:
  static constexpr std::chrono::seconds kReportPeriod{1};

  void on_cloud(Cloud::ConstSharedPtr cloud, std::size_t topic) {
    if (loop_.add(std::move(cloud), node_.now().seconds(), topic)) transforms_.clear();
    worker_->wake();
  }

  Worker::Wait step() {
    const bool has_cleaned = loop_.clean_next(
        node_.now().seconds(),
        [this](const Cloud::ConstSharedPtr& cloud) { return pose_of(*cloud); },
        [this](const std::string& frame, const std::string& other) {
          return find_extrinsic(tf(), frame, other, tf2::TimePointZero);
        },
        [this](const JoinedClouds& clouds, const Cleaned& cleaned) { publish(clouds, cleaned); });
    const std::chrono::duration<double> uptime =
        std::chrono::steady_clock::now().time_since_epoch();
    loop_.publish_map(uptime.count(), has_readers(*map_), [this](const auto& map) {
      auto message = std::make_unique<Cloud>(map_message<Cloud>(map, fixed_frame_));
      message->header.stamp = newest_;
      maps_->post(std::move(message));
    });
    return loop_.pause_after(has_cleaned);
  }

  const tf2::BufferCore& tf() const { return transforms_; }

  PoseAnswer pose_of(const Cloud& cloud) const {
    const tf2::TimePoint stamp = tf2_ros::fromMsg(cloud.header.stamp);
    return find_pose(tf(), fixed_frame_, cloud.header.frame_id, stamp, tf2::TimePointZero,
                     [&](const auto& newest) { return tf2_ros::fromMsg(newest) < stamp; });
  }

  /// Messages are moved to readers of this process. A cloud that is not judged passes whole.
  void publish(const JoinedClouds& clouds, const Cleaned& cleaned) {
    auto header = clouds.anchor()->header;
    header.frame_id = cleaned.frame_id;
    newest_ = header.stamp;
    const bool is_judged = !cleaned.labels.empty();
    cleaned.for_each_cloud(clouds, [&](std::size_t i, const Cloud& cloud, const auto& labels) {
      if (has_readers(*static_[i])) {
        static_[i]->publish(
            std::make_unique<Cloud>(is_judged ? dynains::static_points(cloud, labels) : cloud));
      }
      if (is_judged && has_readers(*dynamic_[i])) {
        dynamic_[i]->publish(std::make_unique<Cloud>(dynains::dynamic_points(cloud, labels)));
      }
    });
    if (cleaned.frame.pose_residual) {
      residual_->publish(std::make_unique<Residual>(
          residual_message<Residual>(*cleaned.frame.pose_residual, header)));
    }
    if (is_judged) publish_objects(cleaned, header);
    if (!has_odom_ || !cleaned.T_odom_sensor) return;
    auto odom = std::make_unique<Odometry>();
    odom->header = header;
    odom->header.frame_id = fixed_frame_;
    odom->child_frame_id = header.frame_id;
    set_pose(*cleaned.T_odom_sensor, odom->pose.pose);
    odom_->publish(std::move(odom));
    broadcaster_->sendTransform(
        transform_message<Transform>(*cleaned.T_odom_sensor, fixed_frame_, header));
  }

  using Objects = dynains::Span<const dynains::MovingObject>;
  template <class Message>
  void offer_objects(const char* topic,
                     Message (*make)(Objects, const dynains::Pose&, const Header&)) {
    const auto publisher = node_.create_publisher<Message>(topic, rclcpp::SensorDataQoS(),
                                                           overridable<rclcpp::PublisherOptions>());
    objects_.push_back([publisher, make](Objects objects, const dynains::Pose& T_fixed_world,
                                         const Header& header) {
      if (!has_readers(*publisher)) return;
      publisher->publish(std::make_unique<Message>(make(objects, T_fixed_world, header)));
    });
  }

  void publish_objects(const Cleaned& cleaned, Header header) {
    const dynains::ScanVerdict& verdict = cleaned.frame.newest();
    dynains::Pose T_fixed_world = dynains::Pose::Identity();
    if (cleaned.T_odom_sensor) {  // the own odometry may have begun anew
      T_fixed_world = *cleaned.T_odom_sensor * verdict.T_world_sensor.inverse();
    }
    header.frame_id = fixed_frame_;
    for (const auto& list : objects_) list(verdict.objects, T_fixed_world, header);
  }

  static bool has_readers(const rclcpp::PublisherBase& publisher) {
    return publisher.get_subscription_count() + publisher.get_intra_process_subscription_count() >
           0;
  }

  void report() {
    const std::chrono::duration<double> period = kReportPeriod;
    const Diagnosis diagnosis = loop_.report(period.count());
    auto message = std::make_unique<Diagnostics>();
    message->header.stamp = node_.now();
    message->status.emplace_back();
    auto& status = message->status.back();
    status.level = static_cast<std::uint8_t>(diagnosis.level);
    status.name = std::string(node_.get_fully_qualified_name()) + ": remover";
    status.message = diagnosis.message;
    for (const auto& [name, value] : diagnosis.values) {
      status.values.emplace_back();
      status.values.back().key = name;
      status.values.back().value = value;
    }
    loop_.attempt([&] { diagnostics_->publish(std::move(message)); });
    if (diagnosis.message == told_) return;
    told_ = diagnosis.message;
    if (diagnosis.level == Diagnosis::Level::kOk) {
      RCLCPP_INFO(node_.get_logger(), "%s", told_.c_str());
    } else {
      RCLCPP_WARN(node_.get_logger(), "%s", told_.c_str());
    }
  }

  RemoverNode& node_;
  std::string fixed_frame_;
  bool has_odom_;
  std::vector<std::string> topics_;
  Loop loop_;
  tf2_ros::Buffer transforms_;
  tf2_ros::TransformListener listener_;                                // has a thread of its own
  std::vector<rclcpp::Publisher<Cloud>::SharedPtr> static_, dynamic_;  // by topic
  rclcpp::Publisher<Cloud>::SharedPtr map_;
  rclcpp::Publisher<Residual>::SharedPtr residual_;
  // By type of message.
  std::vector<std::function<void(Objects, const dynains::Pose&, const Header&)>> objects_;
  rclcpp::Publisher<Odometry>::SharedPtr odom_;
  std::optional<tf2_ros::TransformBroadcaster> broadcaster_;
  rclcpp::Publisher<Diagnostics>::SharedPtr diagnostics_;
  builtin_interfaces::msg::Time newest_;  // used by the worker alone
  std::string told_;                      // the last report
  // A reader of the map that hangs holds up further maps, and no clouds.
  std::optional<Outbox<std::unique_ptr<Cloud>>> maps_;
  std::optional<Worker> worker_;
  std::vector<rclcpp::Subscription<Cloud>::SharedPtr> clouds_;
  rclcpp::TimerBase::SharedPtr timer_;
};

RemoverNode::RemoverNode(const rclcpp::NodeOptions& options)
    : Node("remover", options), work_(std::make_unique<Work>(*this)) {}

RemoverNode::~RemoverNode() = default;

}  // namespace dynains_ros

RCLCPP_COMPONENTS_REGISTER_NODE(dynains_ros::RemoverNode)
