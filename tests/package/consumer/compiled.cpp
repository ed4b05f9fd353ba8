// The compiled remover. This unit includes its declaration only.
#include <cstddef>
#include <vector>

#include "dynains/compiled_remover.hpp"

int main() {
  dynains::DynaInsRemover remover;
  const std::vector<Eigen::Vector3f> cloud(100, Eigen::Vector3f(10.0F, 0.0F, 0.0F));
  remover.push(cloud, Eigen::Isometry3d::Identity());
  std::size_t finished = 0;
  remover.flush([&](const dynains::ScanVerdict& verdict) { finished += verdict.labels.size(); });
  return finished == cloud.size() ? 0 : 1;
}
