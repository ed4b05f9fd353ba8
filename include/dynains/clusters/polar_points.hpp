// Points in cylindrical coordinates about the z axis of a sensor frame, for clusters and
// descriptors.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains {

/// Points as three arrays of equal length.
struct PolarView {
  Span<const float> range;    ///< m, horizontal distance r(p) (Eq. 8)
  Span<const float> azimuth;  ///< rad, theta(p) in [-pi, pi] (Eq. 8)
  Span<const float> z;        ///< m, height in the sensor frame

  std::size_t size() const { return range.size(); }
  bool empty() const { return range.empty(); }
  PolarView subview(std::size_t offset, std::size_t count) const {
    return {range.subspan(offset, count), azimuth.subspan(offset, count), z.subspan(offset, count)};
  }
};

/// Polar points in three arrays, which are padded for packs beyond size(). A buffer is reused from
/// scan to scan.
class PolarBuffer {
 public:
  std::size_t size() const { return size_; }
  void clear() { size_ = 0; }
  void resize(std::size_t size) {
    size_ = size;
    const std::size_t padded = size + detail::kPackWidth;
    detail::grow(range, padded);
    detail::grow(azimuth, padded);
    detail::grow(z, padded);
  }
  PolarView view() const {
    return {{range.data(), size_}, {azimuth.data(), size_}, {z.data(), size_}};
  }

  /// Appends `points` (m, source frame), transformed to the target frame in single precision.
  void append(PointsView points, const Pose& T_target_source) {
    const std::size_t begin = size_;
    resize(begin + points.size());
    const detail::PackTransform transform(T_target_source);
    float* const ranges = range.data() + begin;
    float* const azimuths = azimuth.data() + begin;
    float* const heights = z.data() + begin;
    detail::for_packs(points.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      const Float x = at.load(points.x.data());
      const Float y = at.load(points.y.data());
      const Float z_source = at.load(points.z.data());
      const Float x_target = transform(0, x, y, z_source);
      const Float y_target = transform(1, x, y, z_source);
      const Float range_target = sqrt(x_target * x_target + y_target * y_target);
      range_target.store(ranges + at.begin);
      detail::azimuth_of(y_target, x_target, range_target).store(azimuths + at.begin);
      transform(2, x, y, z_source).store(heights + at.begin);
    });
  }

  std::vector<float> range;
  std::vector<float> azimuth;
  std::vector<float> z;

 private:
  std::size_t size_ = 0;
};

}  // namespace dynains
