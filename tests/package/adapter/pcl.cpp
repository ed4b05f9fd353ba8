#include <dynains/adapters/pcl.hpp>
#include <dynains/dyna_ins_remover.hpp>

int main() {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  cloud.push_back({5.0F, 0.0F, 0.0F});
  dynains::DynaInsRemover remover;
  const auto frame = remover.push(cloud, Eigen::Isometry3d::Identity(), 0.0);
  return dynains::static_points(cloud, frame.newest.labels).size() == 1 ? 0 : 1;
}
