// A node of ROS 1: splits clouds into static and moving points, and builds the static map.
//
//   subscribes  points         sensor_msgs/PointCloud2, in the frame of the sensor
//               /tf, /tf_static
//   publishes   ~static        the static points of each cloud, with all fields
//               ~dynamic       its moving points
//               ~map           the map of scans with a final verdict (30 scans later), latched
//   parameters  ~fixed_frame   a frame without jumps ["odom"]
//               ~tf_timeout    how long a cloud waits for its transform, s [0.2]
//               ~map_period    time between two maps, s [2]
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_ros/transform_listener.h>

#include <Eigen/Geometry>
#include <cstring>
#include <exception>
#include <string>

#include "dynains/adapters/point_cloud2.hpp"
#include "dynains/compiled_remover.hpp"

namespace {

Eigen::Isometry3d to_isometry(const geometry_msgs::Transform& transform) {
  const auto& p = transform.translation;
  const auto& q = transform.rotation;
  return Eigen::Translation3d(p.x, p.y, p.z) * Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized();
}

/// The map as a message with float x y z.
sensor_msgs::PointCloud2 map_message(const dynains::DynaInsRemover& remover,
                                     const std::string& frame, ros::Time time) {
  sensor_msgs::PointCloud2 message;
  message.header.frame_id = frame;
  message.header.stamp = time;
  for (const char* name : {"x", "y", "z"}) {
    sensor_msgs::PointField field;
    field.name = name;
    field.offset = static_cast<std::uint32_t>(4 * message.fields.size());
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    message.fields.push_back(field);
  }
  message.height = 1;
  message.width = static_cast<std::uint32_t>(remover.map().size());
  message.point_step = 12;
  message.row_step = message.point_step * message.width;
  message.is_dense = 1;
  message.data.resize(message.row_step);
  std::uint8_t* to = message.data.data();
  remover.map().for_each([&](const Eigen::Vector3d& point) {
    const Eigen::Vector3f xyz = point.cast<float>();
    std::memcpy(to, xyz.data(), message.point_step);
    to += message.point_step;
  });
  return message;
}

class RemoverNode {
 public:
  RemoverNode() : listener_(transforms_) {
    private_.param("fixed_frame", fixed_frame_, fixed_frame_);
    private_.param("tf_timeout", tf_timeout_, tf_timeout_);
    private_.param("map_period", map_period_, map_period_);
    static_ = private_.advertise<sensor_msgs::PointCloud2>("static", kQueue);
    dynamic_ = private_.advertise<sensor_msgs::PointCloud2>("dynamic", kQueue);
    map_ = private_.advertise<sensor_msgs::PointCloud2>("map", 1, true);
    clouds_ = public_.subscribe("points", kQueue, &RemoverNode::on_cloud, this);
    timer_ = public_.createWallTimer(ros::WallDuration(map_period_), &RemoverNode::on_timer, this);
  }

 private:
  static constexpr std::uint32_t kQueue = 100;

  void on_cloud(const sensor_msgs::PointCloud2& message) {
    try {
      const geometry_msgs::TransformStamped T_fixed_sensor = transforms_.lookupTransform(
          fixed_frame_, message.header.frame_id, message.header.stamp, ros::Duration(tf_timeout_));
      const dynains::FrameResult frame =
          remover_.push(dynains::PointCloud2View(message), to_isometry(T_fixed_sensor.transform),
                        dynains::message_time(message));
      static_.publish(dynains::static_points(message, frame.newest.labels));
      dynamic_.publish(dynains::dynamic_points(message, frame.newest.labels));
      newest_ = message.header.stamp;
    } catch (const std::exception& error) {  // no transform, or an invalid cloud or pose
      ROS_WARN("cloud left out: %s", error.what());
    }
  }

  void on_timer(const ros::WallTimerEvent&) {
    if (!remover_.map().empty()) map_.publish(map_message(remover_, fixed_frame_, newest_));
  }

  ros::NodeHandle public_;
  ros::NodeHandle private_{"~"};
  std::string fixed_frame_ = "odom";
  double tf_timeout_ = 0.2;
  double map_period_ = 2.0;
  tf2_ros::Buffer transforms_;
  tf2_ros::TransformListener listener_;  // runs in a separate thread
  ros::Publisher static_, dynamic_, map_;
  ros::Subscriber clouds_;
  ros::WallTimer timer_;
  dynains::DynaInsRemover remover_;
  ros::Time newest_;
};

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "dynains");
  const RemoverNode node;
  ros::spin();  // one thread: no call of the remover during another one
  return 0;
}
