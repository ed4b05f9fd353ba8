// Points of a patch to which its plane is fitted.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "dynains/points.hpp"
#include "dynains/sensor/plane_fit.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/simd/point_record.hpp"

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

  PackConstant x0, y0, z0;                    // origin
  PackConstant x = 0.0F, y = 0.0F, z = 1.0F;  // normal
  PackConstant offset;
};

/// All points of a patch, or, of a patch with many, runs of eight points that are spread evenly:
/// they stay in the cache while planes are fitted.
class PatchSample {
 public:
  /// Gets memory for as many points.
  void reserve(std::size_t points) { points_.grow(points + kPackWidth); }

  /// Takes all `count` points, or `max_count` rounded down to runs of eight if there are more.
  /// reserve() must have been called for as many. Eight records must be readable from each one on.
  /// Makes x and y relative to the first record.
  template <class Packs>
  void take(const PointRecord* records, std::size_t count, std::size_t max_count) {
    using Float = typename Packs::Float;
    const bool is_whole = count <= max_count;
    const std::size_t runs =
        is_whole ? (count + kPackWidth - 1) / kPackWidth : max_count / kPackWidth;
    size_ = is_whole ? count : runs * kPackWidth;
    const Float x0(records->x);
    const Float y0(records->y);
    float* const x = points_.x.data();
    float* const y = points_.y.data();
    float* const z = points_.z.data();
    for (std::size_t run = 0; run < runs; ++run) {
      const std::size_t from = is_whole ? run * kPackWidth : run * count / runs;
      const auto columns = load_columns<Packs>(records + from);
      (columns[0] - x0).store(x + run * kPackWidth);
      (columns[1] - y0).store(y + run * kPackWidth);
      columns[2].store(z + run * kPackWidth);
    }
    // Neither among the lowest nor in a half space below a plane.
    Float(std::numeric_limits<float>::infinity()).store(z + size_);
  }

  std::size_t size() const { return size_; }
  /// Heights (m, sensor frame), then eight infinite ones.
  const float* heights() const { return points_.z.data(); }

  /// Moments of the points in a half space, relative to its origin, whose x and y must be those of
  /// the first record.
  template <class Packs>
  PlaneMoments moments(const HalfSpace& space) const {
    static constexpr PackConstant kZero(0.0F), kOne(1.0F);
    using Float = typename Packs::Float;
    Float n = kZero, sx = kZero, sy = kZero, sz = kZero, sxx = kZero, sxy = kZero, sxz = kZero,
          syy = kZero, syz = kZero, szz = kZero;
    for (std::size_t i = 0; i < size_; i += kPackWidth) {
      const auto p = local<Packs>(space, i);
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
    }
    return {sum(n),   sum(sx),  sum(sy),  sum(sz),  sum(sxx),
            sum(sxy), sum(sxz), sum(syy), sum(syz), sum(szz)};
  }

  /// Whether all points are in a half space whose origin is as for moments().
  template <class Packs>
  bool is_inside(const HalfSpace& space) const {
    for (std::size_t i = 0; i < size_; i += kPackWidth) {
      const unsigned all = (1U << std::min(kPackWidth, size_ - i)) - 1U;
      if (space.contains(local<Packs>(space, i)).bits() != all) return false;
    }
    return true;
  }

 private:
  // Eight points, relative to the origin of the half space.
  template <class Packs>
  std::array<typename Packs::Float, 3> local(const HalfSpace& space, std::size_t i) const {
    using Float = typename Packs::Float;
    return {Float::load(&points_.x[i]), Float::load(&points_.y[i]),
            Float::load(&points_.z[i]) - space.z0};
  }

  PointBuffer points_;
  std::size_t size_ = 0;
};

}  // namespace dynains::detail
