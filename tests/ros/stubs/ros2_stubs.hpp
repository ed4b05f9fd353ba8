// Declarations of the parts of ROS 2 that the node uses, so that it compiles without ROS 2.
#pragma once

#include <chrono>
#include <functional>
#include <stdexcept>

#include "message_stubs.hpp"

namespace rcl_interfaces::msg {
struct FloatingPointRange {
  double from_value = 0.0, to_value = 0.0;
};
struct IntegerRange {
  std::int64_t from_value = 0, to_value = 0;
  std::uint64_t step = 0;
};
struct ParameterDescriptor {
  std::string description;
  bool read_only = false;
  std::vector<FloatingPointRange> floating_point_range;
  std::vector<IntegerRange> integer_range;
};
}  // namespace rcl_interfaces::msg

namespace rclcpp {
struct NodeOptions {};
struct QoS {
  explicit QoS(int) {}
  QoS& reliable() { return *this; }
  QoS& transient_local() { return *this; }
};
struct SensorDataQoS : QoS {
  SensorDataQoS() : QoS(5) {}
};
struct QosOverridingOptions {
  static QosOverridingOptions with_default_policies() { return {}; }
};
enum class IntraProcessSetting { Disable };
struct PublisherOptions {
  QosOverridingOptions qos_overriding_options;
  IntraProcessSetting use_intra_process_comm = IntraProcessSetting::Disable;
};
using SubscriptionOptions = PublisherOptions;

struct PublisherBase {
  std::size_t get_subscription_count() const { return 0; }
  std::size_t get_intra_process_subscription_count() const { return 0; }
};
template <class Message>
struct Publisher : PublisherBase {
  using SharedPtr = std::shared_ptr<Publisher>;
  void publish(std::unique_ptr<Message>) {}
};
template <class Message>
struct Subscription {
  using SharedPtr = std::shared_ptr<Subscription>;
};
struct TimerBase {
  using SharedPtr = std::shared_ptr<TimerBase>;
};
struct Time {
  double seconds() const { return 0.0; }
  operator builtin_interfaces::msg::Time() const { return {}; }
};
struct Clock {
  using SharedPtr = std::shared_ptr<Clock>;
};
struct Logger {};

class Node {
 public:
  Node(const std::string&, const NodeOptions&) {}
  virtual ~Node() = default;
  template <class Value, class Descriptor>
  Value declare_parameter(const std::string&, const Value& value, const Descriptor&) {
    return value;
  }
  template <class Message>
  std::shared_ptr<Publisher<Message>> create_publisher(const std::string&, const QoS&,
                                                       const PublisherOptions& = {}) {
    return std::make_shared<Publisher<Message>>();
  }
  template <class Message>
  std::shared_ptr<Publisher<Message>> create_publisher(const std::string&, int) {
    return std::make_shared<Publisher<Message>>();
  }
  template <class Message>
  std::shared_ptr<Subscription<Message>> create_subscription(
      const std::string&, const QoS&, const std::function<void(std::shared_ptr<const Message>)>&,
      const SubscriptionOptions& = {}) {
    return std::make_shared<Subscription<Message>>();
  }
  template <class Period>
  TimerBase::SharedPtr create_wall_timer(const Period&, const std::function<void()>&) {
    return std::make_shared<TimerBase>();
  }
  Clock::SharedPtr get_clock() { return std::make_shared<Clock>(); }
  Time now() const { return {}; }
  Logger get_logger() const { return {}; }
  const char* get_fully_qualified_name() const { return ""; }
};

inline void init(int, char**) {}
inline void shutdown() {}
inline void spin(const std::shared_ptr<Node>&) {}
}  // namespace rclcpp

#define RCLCPP_INFO(logger, ...) static_cast<void>(logger)
#define RCLCPP_WARN(logger, ...) static_cast<void>(logger)
#define RCLCPP_COMPONENTS_REGISTER_NODE(name) static_assert(sizeof(name) > 0);

namespace tf2 {
using TimePoint = std::chrono::time_point<std::chrono::system_clock, std::chrono::nanoseconds>;
inline const TimePoint TimePointZero{};
struct TransformException : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct ExtrapolationException : TransformException {
  using TransformException::TransformException;
};
struct InvalidArgumentException : TransformException {
  using TransformException::TransformException;
};
struct BufferCore {
  geometry_msgs::msg::TransformStamped lookupTransform(const std::string&, const std::string&,
                                                       const TimePoint&) const {
    return {};
  }
  void clear() {}
};
}  // namespace tf2

namespace tf2_ros {
struct Buffer : tf2::BufferCore {
  explicit Buffer(const rclcpp::Clock::SharedPtr&) {}
};
struct DynamicListenerQoS : rclcpp::QoS {
  DynamicListenerQoS() : QoS(100) {}
};
using StaticListenerQoS = DynamicListenerQoS;
struct TransformListener {
  TransformListener(tf2::BufferCore&, rclcpp::Node*, bool, const rclcpp::QoS&, const rclcpp::QoS&,
                    const rclcpp::SubscriptionOptions&, const rclcpp::SubscriptionOptions&) {}
};
struct TransformBroadcaster {
  explicit TransformBroadcaster(rclcpp::Node&) {}
  void sendTransform(const geometry_msgs::msg::TransformStamped&) {}
};
inline tf2::TimePoint fromMsg(const builtin_interfaces::msg::Time&) { return {}; }
}  // namespace tf2_ros
