// The node of ROS 2, with its messages through the middleware.
#include "dynains_ros/remover_node.hpp"

#include <atomic>
#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <mutex>
#include <sensor_msgs/msg/point_cloud2.hpp>
#include <tf2_msgs/msg/tf_message.hpp>
#include <thread>

#include "adapters/message.hpp"
#include "dynains/compiled_remover.hpp"
#include "support/catch.hpp"
#include "support/scene.hpp"

namespace dynains_ros {
namespace {

using Cloud = sensor_msgs::msg::PointCloud2;
using Diagnostics = diagnostic_msgs::msg::DiagnosticArray;
using dynains::test::Scan;
using Counts = std::map<std::int64_t, std::size_t>;  // points by stamp, ns

std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

std::vector<Scan> scans(int count) {
  return dynains::test::drive(dynains::test::oncoming(), count, 5.0);
}

/// A robot with a lidar and an odometry, and a reader of all that the remover publishes.
class Robot {
 public:
  explicit Robot(const std::string& name, const std::vector<rclcpp::Parameter>& parameters = {})
      : node_(std::make_shared<rclcpp::Node>("robot", name)) {
    remover_ = add_remover(name, "points", parameters);
    const rclcpp::QoS sensor = rclcpp::SensorDataQoS().keep_last(100);
    points_ = node_->create_publisher<Cloud>("points", sensor);
    transforms_ = node_->create_publisher<tf2_msgs::msg::TFMessage>("/tf", 100);
    static_ = node_->create_subscription<Cloud>(
        "static", sensor, [this](const Cloud& cloud) { count(static_counts_, cloud); });
    dynamic_ = node_->create_subscription<Cloud>(
        "dynamic", sensor, [this](const Cloud& cloud) { count(dynamic_counts_, cloud); });
    diagnostics_ = node_->create_subscription<Diagnostics>(
        "/diagnostics", 10, [this](const Diagnostics& message) { keep(message); });
    executor_.add_node(node_);
    spinning_ = std::thread([this] { executor_.spin(); });
    wait_for([this] {
      return points_->get_subscription_count() > 0 && static_->get_publisher_count() > 0 &&
             dynamic_->get_publisher_count() > 0 && transforms_->get_subscription_count() > 0;
    });
  }

  ~Robot() {
    executor_.cancel();
    spinning_.join();
  }

  std::shared_ptr<RemoverNode> add_remover(const std::string& name, const std::string& points,
                                           const std::vector<rclcpp::Parameter>& parameters = {}) {
    std::vector<rclcpp::Parameter> all = {
        {"preset", "paper"}, {"tf_timeout", 1.0}, {"map_period", 0.1}};
    all.insert(all.end(), parameters.begin(), parameters.end());
    auto remover = std::make_shared<RemoverNode>(
        rclcpp::NodeOptions().use_intra_process_comms(true).parameter_overrides(all).arguments(
            {"--ros-args", "-r", "__ns:=/" + name, "-r", "points:=" + points}));
    executor_.add_node(remover);
    removers_.push_back(remover);
    return remover;
  }

  rclcpp::Node& node() { return *node_; }
  RemoverNode& remover() { return *remover_; }

  void send_pose(const Scan& scan, double stamp) {
    tf2_msgs::msg::TFMessage message;
    message.transforms.emplace_back();
    auto& T = message.transforms.back();
    T.header.stamp = rclcpp::Time(nanoseconds(stamp));
    T.header.frame_id = "odom";
    T.child_frame_id = "lidar";
    T.transform.translation.x = scan.T_world_sensor.translation().x();
    T.transform.translation.y = scan.T_world_sensor.translation().y();
    T.transform.translation.z = scan.T_world_sensor.translation().z();
    transforms_->publish(message);
  }

  void send_cloud(const Scan& scan, double stamp) {
    auto message = std::make_unique<Cloud>(dynains::test::make_message<Cloud>(scan.points));
    message->header.frame_id = "lidar";
    message->header.stamp = rclcpp::Time(nanoseconds(stamp));
    points_->publish(std::move(message));
  }

  /// Waits until `condition()` holds, at most half a minute.
  static bool wait_for(const std::function<bool()>& condition) {
    for (int i = 0; i < 3000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  Counts static_counts() const { return copy(static_counts_); }
  Counts dynamic_counts() const { return copy(dynamic_counts_); }

  /// Whether a report of the remover has a value, or its message begins with a text.
  bool was_told(const std::string& text) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const std::string& told : told_) {
      if (told.rfind(text, 0) == 0) return true;
    }
    return false;
  }

 private:
  void count(Counts& counts, const Cloud& cloud) {
    const std::lock_guard<std::mutex> lock(mutex_);
    counts[rclcpp::Time(cloud.header.stamp).nanoseconds()] = cloud.width;
  }
  Counts copy(const Counts& counts) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return counts;
  }
  void keep(const Diagnostics& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& status : message.status) {
      if (status.name != std::string(remover_->get_fully_qualified_name()) + ": remover") continue;
      told_.push_back(status.message);
      for (const auto& value : status.values) told_.push_back(value.key + " = " + value.value);
    }
  }

  rclcpp::Node::SharedPtr node_;
  std::shared_ptr<RemoverNode> remover_;
  std::vector<std::shared_ptr<RemoverNode>> removers_;
  rclcpp::executors::MultiThreadedExecutor executor_;
  rclcpp::Publisher<Cloud>::SharedPtr points_;
  rclcpp::Publisher<tf2_msgs::msg::TFMessage>::SharedPtr transforms_;
  rclcpp::Subscription<Cloud>::SharedPtr static_, dynamic_;
  rclcpp::Subscription<Diagnostics>::SharedPtr diagnostics_;
  mutable std::mutex mutex_;
  Counts static_counts_, dynamic_counts_;
  std::vector<std::string> told_;
  std::thread spinning_;
};

/// ROS is started once for all tests.
void start_ros() {
  static const bool is_started = [] {
    rclcpp::init(0, nullptr);
    return true;
  }();
  REQUIRE(is_started);
}

/// Numbers of static and of moving points by the remover itself.
std::pair<Counts, Counts> expected_counts(const std::vector<Scan>& scans, double begin) {
  dynains::DynaInsRemover remover(dynains::DynaInsRemover::Config::paper());
  std::pair<Counts, Counts> result;
  for (const Scan& scan : scans) {
    const double stamp = begin + scan.time;
    const auto frame = remover.push(scan.points, scan.T_world_sensor, stamp);
    auto& still = result.first[nanoseconds(stamp)];
    auto& moving = result.second[nanoseconds(stamp)];
    for (const dynains::PointLabel label : frame.newest().labels) {
      still += dynains::is_static(label) ? 1 : 0;
      moving += label == dynains::PointLabel::kDynamic ? 1 : 0;
    }
  }
  return result;
}

TEST_CASE("a node publishes the points that the remover labels, also when transforms are late") {
  start_ros();
  Robot robot("late");
  const std::vector<Scan> drive = scans(8);
  for (const Scan& scan : drive) {
    robot.send_cloud(scan, 100.0 + scan.time);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    robot.send_pose(scan, 100.0 + scan.time);
  }
  CHECK(Robot::wait_for([&] { return robot.dynamic_counts().size() == drive.size(); }));
  const auto [still, moving] = expected_counts(drive, 100.0);
  CHECK(robot.static_counts() == still);
  CHECK(robot.dynamic_counts() == moving);
  CHECK(Robot::wait_for([&] { return robot.was_told("cleaned since the start = 8"); }));
  CHECK_FALSE(robot.was_told("no cloud is taken"));
}

TEST_CASE("a reader that comes late gets the map") {
  start_ros();
  Robot robot("map");
  for (const Scan& scan : scans(6)) {
    robot.send_pose(scan, 100.0 + scan.time);
    robot.send_cloud(scan, 100.0 + scan.time);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  for (int i = 0; i < 2; ++i) {
    std::atomic<std::size_t> points{0};
    const auto reader = robot.node().create_subscription<Cloud>(
        "map", rclcpp::QoS(1).reliable().transient_local(), [&](const Cloud& map) {
          CHECK(map.header.frame_id == "odom");
          points = map.width;
        });
    CHECK(Robot::wait_for([&] { return points > 1000; }));
  }
}

TEST_CASE("without transforms nothing is cleaned, the node tells why, and goes on with the first") {
  start_ros();
  Robot robot("missing", {rclcpp::Parameter("tf_timeout", 0.1)});
  const std::vector<Scan> drive = scans(6);
  for (int i = 0; i < 3; ++i) {
    robot.send_cloud(drive[0], 100.0 + 0.1 * i);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  CHECK(Robot::wait_for([&] { return robot.was_told("no cloud is taken: "); }));
  CHECK(robot.was_told("left out: no transform = "));
  CHECK(robot.static_counts().empty());
  robot.send_pose(drive[1], 200.0);
  robot.send_cloud(drive[1], 200.0);
  CHECK(Robot::wait_for([&] { return robot.static_counts().size() == 1; }));
}

TEST_CASE("parameters have their bounds, and are fixed while the node runs") {
  start_ros();
  const auto start = [](const rclcpp::Parameter& parameter) {
    return std::make_shared<RemoverNode>(rclcpp::NodeOptions().parameter_overrides({parameter}));
  };
  CHECK_THROWS_WITH(start({"window", 65}), ContainsSubstring("window"));
  CHECK_THROWS_WITH(start({"decision", "best"}), ContainsSubstring("window|free_space"));
  CHECK_THROWS_WITH(start({"preset", "best"}), ContainsSubstring("default|paper"));
  CHECK_THROWS_WITH(start({"queue", 0}), ContainsSubstring("queue"));
  const auto node = start({"window", 64});
  CHECK(node->get_parameter("window").as_int() == 64);
  const auto descriptor = node->describe_parameter("max_range");
  CHECK_FALSE(descriptor.description.empty());
  REQUIRE(descriptor.floating_point_range.size() == 1);
  CHECK(node->describe_parameter("p_free").floating_point_range[0].from_value > 0.5);
  const auto result = node->set_parameter({"max_range", 50.0});
  CHECK_FALSE(result.successful);
  CHECK_THAT(result.reason, ContainsSubstring("read-only"));
}

}  // namespace
}  // namespace dynains_ros
