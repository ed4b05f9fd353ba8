// Points in cylindrical coordinates about the vertical axis of a sensor: what clustering and
// descriptors work on.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "dynains/detail/arc_tangent.hpp"
#include "dynains/detail/room.hpp"
#include "dynains/detail/wide_lanes.hpp"
#include "dynains/points.hpp"

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

/// Owner of polar points, reused from scan to scan; padded for wide stores.
class PolarBuffer {
 public:
  std::size_t size() const { return size_; }
  void clear() { size_ = 0; }
  void resize(std::size_t size) {
    size_ = size;
    const std::size_t padded = size + detail::kLanes;
    detail::grow(range, padded);
    detail::grow(azimuth, padded);
    detail::grow(z, padded);
  }
  PolarView view() const {
    return {{range.data(), size_}, {azimuth.data(), size_}, {z.data(), size_}};
  }

  /// Appends `points` moved by the rigid transform `T_target_source`, which is applied in floats:
  /// multiply poses in double before.
  void append(PointsView points, const Eigen::Isometry3f& T_target_source) {
    using detail::Constant8;
    const std::size_t begin = size_;
    resize(begin + points.size());
    const auto& m = T_target_source.matrix();
    const Constant8 m00(m(0, 0)), m01(m(0, 1)), m02(m(0, 2)), m03(m(0, 3));
    const Constant8 m10(m(1, 0)), m11(m(1, 1)), m12(m(1, 2)), m13(m(1, 3));
    const Constant8 m20(m(2, 0)), m21(m(2, 1)), m22(m(2, 2)), m23(m(2, 3));
    float* const ranges = range.data() + begin;
    float* const azimuths = azimuth.data() + begin;
    float* const heights = z.data() + begin;
    detail::for_lanes(points.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      const Float x = at.load(points.x.data());
      const Float y = at.load(points.y.data());
      const Float z_source = at.load(points.z.data());
      const Float x_target = (m00 * x + m01 * y) + (m02 * z_source + m03);
      const Float y_target = (m10 * x + m11 * y) + (m12 * z_source + m13);
      const Float z_target = (m20 * x + m21 * y) + (m22 * z_source + m23);
      sqrt(x_target * x_target + y_target * y_target).store(ranges + at.begin);
      detail::arc_tangent2(y_target, x_target).store(azimuths + at.begin);
      z_target.store(heights + at.begin);
    });
  }

  std::vector<float> range;
  std::vector<float> azimuth;
  std::vector<float> z;

 private:
  std::size_t size_ = 0;
};

}  // namespace dynains
