// Points of a patch below a plane: the seeds of its plane, and the moments for the fit.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numeric>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/sensor/plane_fit.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Points p with normal . (p - origin) < offset (m). The origin must be near the points, to keep
/// floats accurate.
struct HalfSpace {
  /// The points less than `distance` above the origin.
  HalfSpace(float origin_x, float origin_y, float origin_z, float distance)
      : x0(origin_x), y0(origin_y), z0(origin_z), offset(distance) {}

  /// Sets it to the points less than `distance` above a plane, which is relative to the origin.
  void set_below(const Plane& plane, double distance) {
    x = static_cast<float>(plane.normal_x);
    y = static_cast<float>(plane.normal_y);
    z = static_cast<float>(plane.normal_z);
    offset = static_cast<float>(distance + plane.normal_x * plane.mean_x +
                                plane.normal_y * plane.mean_y + plane.normal_z * plane.mean_z);
  }

  /// `local`: coordinates relative to the origin.
  template <class Float>
  auto contains(const std::array<Float, 3>& local) const {
    return x * local[0] + y * local[1] + z * local[2] < offset;
  }

  /// The points of a slice, relative to the origin; then points outside of all half spaces below
  /// a plane.
  template <class Slice>
  auto local(const Slice& at, PointsView points) const {
    using Float = typename Slice::Float;
    const Float infinity(std::numeric_limits<float>::infinity());
    return std::array<Float, 3>{at.load(points.x.data()) - x0, at.load(points.y.data()) - y0,
                                at.padded(at.load(points.z.data()) - z0, infinity)};
  }

  PackConstant x0, y0, z0;                    // origin
  PackConstant x = 0.0F, y = 0.0F, z = 1.0F;  // normal
  PackConstant offset;
};

/// Moments of the points in a half space, relative to its origin. For use within with_packs.
template <class Packs>
PlaneMoments moments_within(const HalfSpace& space, PointsView points) {
  static constexpr PackConstant kZero(0.0F), kOne(1.0F);
  using Float = typename Packs::Float;
  Float n = kZero, sx = kZero, sy = kZero, sz = kZero, sxx = kZero, sxy = kZero, sxz = kZero,
        syy = kZero, syz = kZero, szz = kZero;
  for_slices<Packs>(points.size(), [&](const auto& at) {
    const std::array<Float, 3> p = space.local(at, points);
    const auto member = space.contains(p);
    const Float x = keep(member, p[0]);
    const Float y = keep(member, p[1]);
    const Float z = keep(member, p[2]);
    n = n + keep(member, Float(kOne));
    sx = sx + x;
    sy = sy + y;
    sz = sz + z;
    sxx = sxx + x * x;
    sxy = sxy + x * y;
    sxz = sxz + x * z;
    syy = syy + y * y;
    syz = syz + y * z;
    szz = szz + z * z;
  });
  return {sum(n),   sum(sx),  sum(sy),  sum(sz),  sum(sxx),
          sum(sxy), sum(sxz), sum(syy), sum(syz), sum(szz)};
}

/// Mean of the `wanted` lowest values that are at least `floor`: of all if there are fewer, and
/// `floor` if there are none. `kept`: working memory.
inline float mean_of_lowest(Span<const float> values, std::size_t wanted, float floor,
                            std::vector<float>& kept) {
  kept.clear();
  std::copy_if(values.begin(), values.end(), std::back_inserter(kept),
               [floor](float value) { return value >= floor; });
  if (kept.empty()) return floor;
  const std::size_t count = std::min(wanted, kept.size());
  const auto end = kept.begin() + static_cast<std::ptrdiff_t>(count);
  std::partial_sort(kept.begin(), end, kept.end());
  return std::accumulate(kept.begin(), end, 0.0F) / static_cast<float>(count);
}

}  // namespace dynains::detail
