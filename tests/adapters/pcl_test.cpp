#include "dynains/adapters/pcl.hpp"

#include <pcl/PCLPointCloud2.h>

#include "adapters/message.hpp"
#include "dynains/adapters/point_cloud2.hpp"
#include "support/catch.hpp"
#include "support/runs.hpp"

namespace dynains::test {
namespace {

template <class Point>
std::vector<Verdict> verdicts_of(const std::vector<Scan>& scans) {
  DynaInsRemover remover(DynaInsRemover::Config::paper());
  const auto to_pcl = [](const std::vector<Eigen::Vector3f>& points) {
    pcl::PointCloud<Point> cloud;
    for (const auto& p : points) {
      Point point;
      point.x = p.x();
      point.y = p.y();
      point.z = p.z();
      cloud.push_back(point);
    }
    return cloud;
  };
  return run(remover, scans, to_pcl).final;
}

TEST_CASE("PCL clouds of any point type get the labels of their points") {
  const std::vector<Scan> scans = drive(oncoming(), 6, 5.0);
  const std::vector<Verdict> expected = run_paper(scans).final;
  CHECK((verdicts_of<pcl::PointXYZ>(scans) == expected));
  CHECK((verdicts_of<pcl::PointXYZI>(scans) == expected));
  CHECK((verdicts_of<pcl::PointNormal>(scans) == expected));
}

TEST_CASE("NaN points of an organized PCL cloud are labelled, not dropped") {
  pcl::PointCloud<pcl::PointXYZ> cloud(2, 2);
  cloud(0, 0) = {5, 0, 0};
  cloud(1, 0).x = std::numeric_limits<float>::quiet_NaN();
  cloud(0, 1) = {5, 1, 0};
  cloud(1, 1) = {0, 0, 0};
  cloud.is_dense = false;
  DynaInsRemover remover;
  const auto labels = remover.push(cloud, Eigen::Isometry3d::Identity(), 0.0).newest().labels;
  REQUIRE(labels.size() == 4);
  CHECK(labels[0] != PointLabel::kInvalid);
  CHECK(labels[1] == PointLabel::kInvalid);
  CHECK(labels[2] != PointLabel::kInvalid);
  CHECK(labels[3] == PointLabel::kInvalid);
}

TEST_CASE("the static points of a PCL cloud keep their fields and header") {
  pcl::PointCloud<pcl::PointXYZI> cloud;
  for (int i = 0; i < 4; ++i) {
    pcl::PointXYZI point;
    point.x = static_cast<float>(i);
    point.intensity = 10.0F + static_cast<float>(i);
    cloud.push_back(point);
  }
  cloud.header.frame_id = "os_lidar";
  cloud.header.stamp = 77;
  const std::vector<PointLabel> labels = {PointLabel::kGround, PointLabel::kDynamic,
                                          PointLabel::kInvalid, PointLabel::kStatic};
  const auto kept = static_points(cloud, labels);
  REQUIRE(kept.size() == 2);
  CHECK(kept[0].intensity == 10.0F);
  CHECK(kept[1].intensity == 13.0F);
  CHECK(kept.header.frame_id == "os_lidar");
  CHECK(kept.header.stamp == 77);
  CHECK_THROWS_AS(static_points(cloud, Span<const PointLabel>(labels.data(), 3)),
                  std::invalid_argument);
}

TEST_CASE("pcl::PCLPointCloud2 is read as any other message") {
  const std::vector<Eigen::Vector3f> points = {{1, 2, 3}, {4, 5, 6}};
  const auto message = make_message<pcl::PCLPointCloud2>(points);
  CHECK(PointCloud2View(message).point(1) == points[1]);
}

}  // namespace
}  // namespace dynains::test
