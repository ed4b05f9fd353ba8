#include "ros_common/messages.hpp"

#include "dynains/adapters/point_cloud2.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "stubs/message_stubs.hpp"
#include "support/catch.hpp"

namespace dynains_ros {
namespace {

using geometry_msgs::msg::PoseWithCovarianceStamped;
using sensor_msgs::msg::PointCloud2;
using vision_msgs::msg::Detection3DArray;
using visualization_msgs::msg::MarkerArray;

TEST_CASE("a map becomes a message with its points") {
  dynains::PointBuffer points;
  points.push_back(1.0F, 2.0F, 3.0F);
  points.push_back(-4.0F, 5.0F, 0.5F);
  dynains::StaticMapAccumulator map;
  map.insert(points, {}, dynains::Pose::Identity());
  const auto message = map_message<PointCloud2>(map, "odom");
  CHECK(message.header.frame_id == "odom");
  const dynains::PointCloud2View view(message);
  REQUIRE(view.size() == 2);
  CHECK(view.point(0).x() + view.point(1).x() == Approx(-3.0F));
  CHECK(message.data.size() == 24);

  const auto nothing = map_message<PointCloud2>(dynains::StaticMapAccumulator(), "odom");
  CHECK(nothing.width == 0);
  CHECK(nothing.data.empty());
  CHECK(nothing.fields.size() == 3);
}

TEST_CASE("a residual becomes a pose whose covariance has the axes of the previous scan") {
  dynains::PoseResidual residual;
  // The newest scan looks to the left of the previous one: its x is the previous y.
  residual.T_previous_aligned =
      Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ());
  residual.covariance[0] = 4.0;                            // x of the newest scan
  residual.covariance[7 * 3] = 9.0;                        // about x
  residual.covariance[3] = residual.covariance[18] = 5.0;  // x and about x
  std_msgs::msg::Header header;
  header.frame_id = "lidar";
  const auto message = residual_message<PoseWithCovarianceStamped>(residual, header);
  CHECK(message.header.frame_id == "lidar");
  CHECK(message.pose.pose.position.y == 2.0);
  CHECK(message.pose.pose.orientation.z == Approx(std::sqrt(0.5)));
  CHECK(message.pose.pose.orientation.w == Approx(std::sqrt(0.5)));
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t column = 0; column < 6; ++column) {
      double expected = 0.0;
      if (row == 1 && column == 1) expected = 4.0;
      if (row == 4 && column == 4) expected = 9.0;
      if ((row == 1 && column == 4) || (row == 4 && column == 1)) expected = 5.0;
      CHECK(message.pose.covariance[6 * row + column] == Approx(expected).margin(1e-12));
    }
  }
}

TEST_CASE("objects become boxes in the fixed frame that replace the last ones") {
  dynains::MovingObject object;
  object.id = 7;
  object.centre = {2.0, 0.0, 0.5};
  object.length = 4.0;
  object.width = 1.8;
  object.height = 1.5;
  object.yaw = M_PI / 2.0;
  const dynains::Pose T_fixed_world =
      Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ());
  std_msgs::msg::Header header;
  header.frame_id = "map";
  const auto message = objects_message<MarkerArray>(
      dynains::Span<const dynains::MovingObject>(&object, 1), T_fixed_world, header);
  REQUIRE(message.markers.size() == 2);
  CHECK(message.markers[0].action == 3);
  const auto& marker = message.markers[1];
  CHECK(marker.header.frame_id == "map");
  CHECK(marker.id == 7);
  CHECK(marker.pose.position.x == Approx(1.0));
  CHECK(marker.pose.position.y == Approx(4.0));
  CHECK(marker.pose.position.z == Approx(3.5));
  CHECK(std::abs(marker.pose.orientation.z) == Approx(1.0));
  CHECK(marker.scale.x == 4.0);
  CHECK(marker.scale.y == 1.8);
  CHECK(objects_message<MarkerArray>({}, T_fixed_world, header).markers.size() == 1);

  const auto detections = detections_message<Detection3DArray>(
      dynains::Span<const dynains::MovingObject>(&object, 1), T_fixed_world, header);
  CHECK(detections.header.frame_id == "map");
  REQUIRE(detections.detections.size() == 1);
  const auto& detection = detections.detections[0];
  CHECK(detection.header.frame_id == "map");
  CHECK(detection.id == "7");
  CHECK(detection.bbox.center.position.y == marker.pose.position.y);
  CHECK(detection.bbox.center.orientation.z == marker.pose.orientation.z);
  CHECK(detection.bbox.size.x == 4.0);
  CHECK(detection.bbox.size.y == 1.8);
  CHECK(detection.bbox.size.z == 1.5);
}

}  // namespace
}  // namespace dynains_ros
