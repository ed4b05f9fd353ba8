// A cloud of any type, seen through one type: the pipeline behind it is compiled once.
#pragma once

#include <cstddef>
#include <type_traits>

#include "dynains/point_cloud_traits.hpp"

namespace dynains::detail {

/// Refers to a cloud that PointCloudTraits describe; valid as long as the cloud.
class CloudView {
 public:
  template <class Cloud>
  explicit CloudView(const Cloud& cloud)
      : cloud_(&cloud), size_(PointCloudTraits<Cloud>::size(cloud)), copy_(&copy_from<Cloud>) {
    if constexpr (std::is_same_v<Cloud, RawPoints<float>>) raw_ = &cloud;
  }

  std::size_t size() const { return size_; }
  /// The cloud itself if it is of that type, else null.
  const RawPoints<float>* raw_floats() const { return raw_; }

  /// Writes the coordinates of points [begin, begin + count): m, sensor frame.
  void copy(std::size_t begin, std::size_t count, float* x, float* y, float* z) const {
    copy_(cloud_, begin, count, x, y, z);
  }

 private:
  template <class Cloud>
  static void copy_from(const void* erased, std::size_t begin, std::size_t count, float* x,
                        float* y, float* z) {
    const Cloud& cloud = *static_cast<const Cloud*>(erased);
    for (std::size_t i = 0; i < count; ++i) {
      const auto p = PointCloudTraits<Cloud>::point(cloud, begin + i);
      x[i] = p.x();
      y[i] = p.y();
      z[i] = p.z();
    }
  }

  const void* cloud_;
  std::size_t size_;
  void (*copy_)(const void*, std::size_t, std::size_t, float*, float*, float*);
  const RawPoints<float>* raw_ = nullptr;
};

}  // namespace dynains::detail
