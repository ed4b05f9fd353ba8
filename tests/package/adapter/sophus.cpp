#include <dynains/adapters/sophus.hpp>

int main() {
  const Sophus::SE3d pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1.0, 2.0, 3.0));
  return dynains::to_isometry(pose).translation().y() == 2.0 ? 0 : 1;
}
