// What lies below a plane near some points.
#pragma once

#include <array>

#include "dynains/sensor/plane_fit.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains::detail {

/// Points p with normal . (p - origin) < offset, in m. The origin lies near them, as floats are
/// exact to a share of what they hold.
struct HalfSpace {
  /// Below a horizontal plane, `distance` above the origin.
  HalfSpace(float origin_x, float origin_y, float origin_z, float distance)
      : x0(origin_x), y0(origin_y), z0(origin_z), offset(distance) {}

  /// Makes it end `distance` above a plane that is relative to the origin.
  void end_above(const Plane& plane, double distance) {
    x = static_cast<float>(plane.normal_x);
    y = static_cast<float>(plane.normal_y);
    z = static_cast<float>(plane.normal_z);
    offset = static_cast<float>(distance + plane.normal_x * plane.mean_x +
                                plane.normal_y * plane.mean_y + plane.normal_z * plane.mean_z);
  }

  /// Of points relative to the origin.
  template <class Float>
  auto contains(const std::array<Float, 3>& local) const {
    return x * local[0] + y * local[1] + z * local[2] < offset;
  }

  PackConstant x0, y0, z0;                    // origin
  PackConstant x = 0.0F, y = 0.0F, z = 1.0F;  // normal
  PackConstant offset;
};

}  // namespace dynains::detail
