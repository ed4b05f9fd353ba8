#include <dynains/adapters/pcl.hpp>
#include <vector>

int main() {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  cloud.push_back({5.0F, 0.0F, 0.0F});
  const std::vector<dynains::PointLabel> labels(cloud.size(), dynains::PointLabel::kStatic);
  return dynains::static_points(cloud, labels).size() == 1 ? 0 : 1;
}
