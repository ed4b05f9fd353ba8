// Pushes three types that are no cloud, and one that is.
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

template <class Cloud>
dynains::FrameResult push(dynains::DynaInsRemover& remover, const Cloud& cloud) {
  return remover.push(cloud, Eigen::Isometry3d::Identity());
}

void push_all(dynains::DynaInsRemover& remover) {
  push(remover, std::vector<float>());
  push(remover, std::vector<MyPoint>());
  push(remover, HalfCloud());
  push(remover, dynains::RawPoints<float>());
}
