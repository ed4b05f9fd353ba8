// A filter before FAST-LIO or a similar SLAM, called for each cloud. It needs no pose and no IMU.
#include <dynains/odometry/odometry.hpp>
#include <vector>

// In the place of pcl::PointXYZINormal: such code holds the time of a point (ms) as its curvature.
struct PointType {
  float x, y, z, intensity, curvature;
};
using PointCloudXYZI = std::vector<PointType>;

class MovingPointFilter {
 public:
  // Removes what moves. `begin`: s, of the cloud. False if track is lost: then all points stay.
  bool filter(PointCloudXYZI& cloud, double begin) {
    offsets_.clear();
    for (const PointType& point : cloud) offsets_.push_back(1e-3 * point.curvature);
    const dynains::RawPoints<float> points{&cloud.data()->x, cloud.size(), /*stride=*/5};
    const dynains::OdometryResult result = odometry_.push(points, offsets_, begin);
    if (result.loss != dynains::OdometryLoss::kNone) return false;
    const auto& labels = result.frame.newest().labels;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (labels[i] != dynains::PointLabel::kDynamic) cloud[kept++] = cloud[i];
    }
    cloud.resize(kept);
    return true;
  }

 private:
  dynains::Odometry odometry_;
  std::vector<double> offsets_;  // s
};

// A yard of 40 m, and a van that drives 8 m/s.
PointCloudXYZI read_cloud(int scan) {
  PointCloudXYZI cloud;
  for (float a = -20.0F; a < 20.0F; a += 0.2F) {
    for (float b = -20.0F; b < 20.0F; b += 0.4F) cloud.push_back({a, b, -1.7F, 0, 0});
    for (float z = -1.5F; z < 4.0F; z += 0.25F) {
      cloud.push_back({a, 20.0F, z, 0, 0});
      cloud.push_back({-20.0F, a, z, 0, 0});
      const float van = a - 10.0F + 0.8F * static_cast<float>(scan);
      if (a > 0.0F && a < 4.0F && z < 0.5F) cloud.push_back({van, 6.0F, z, 0, 0});
    }
  }
  return cloud;
}

int main() {
  MovingPointFilter filter;
  std::size_t removed = 0;
  for (int scan = 0; scan < 15; ++scan) {
    PointCloudXYZI cloud = read_cloud(scan);
    removed += cloud.size();
    if (!filter.filter(cloud, 0.1 * scan)) return 1;
    removed -= cloud.size();
  }
  return removed > 0 ? 0 : 1;  // they do not reach the SLAM
}
