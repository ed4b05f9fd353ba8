// The real message type of ROS 1.
#include <sensor_msgs/PointCloud2.h>

#include "adapters/message.hpp"
#include "dynains/adapters/point_cloud2.hpp"
#include "support/catch.hpp"

namespace dynains::test {
namespace {

TEST_CASE("sensor_msgs::PointCloud2 is converted in both directions") {
  const std::vector<Eigen::Vector3f> points = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  auto message = make_message<sensor_msgs::PointCloud2>(points, {4, 8, 12, kFloat32, 22});
  message.header.stamp.sec = 3;
  message.header.stamp.nsec = 500000000;
  const PointCloud2View view(message);
  REQUIRE(view.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) CHECK(view.point(i) == points[i]);
  CHECK(message_time(message) == 3.5);

  const std::vector<PointLabel> labels = {PointLabel::kStatic, PointLabel::kDynamic,
                                          PointLabel::kGround};
  const sensor_msgs::PointCloud2 kept = static_points(message, labels);
  REQUIRE(PointCloud2View(kept).size() == 2);
  CHECK(PointCloud2View(kept).point(1) == points[2]);
}

}  // namespace
}  // namespace dynains::test
