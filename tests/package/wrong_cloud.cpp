// Pushes a value of type CLOUD.
#include <vector>

#include "dynains/compiled_remover.hpp"

struct MyPoint {
  float x, y, z;
};

/// With one of two functions only.
struct HalfCloud {};
template <>
struct dynains::PointCloudTraits<HalfCloud> {
  static std::size_t size(const HalfCloud&) { return 0; }
};

dynains::FrameResult push(dynains::DynaInsRemover& remover, const CLOUD& cloud) {
  return remover.push(cloud, Eigen::Isometry3d::Identity());
}
