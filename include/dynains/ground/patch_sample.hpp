// The points of a patch that its plane is fitted to.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "dynains/ground/half_space.hpp"
#include "dynains/ground/point_record.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/plane_fit.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains::detail {

/// All points of a patch if they are few, else runs of eight that are spread over them: arrays that
/// stay in the nearest cache.
class PatchSample {
 public:
  /// Gets the memory for that many points.
  void reserve(std::size_t points) { points_.grow(points + kPackWidth); }

  /// Takes all of `count` points, or `most` of them, rounded down to runs of eight. What was
  /// reserved suffices, and the records are padded for wide loads; x and y become relative to the
  /// first one.
  template <class Packs>
  void take(const PointRecord* records, std::size_t count, std::size_t most) {
    using Float = typename Packs::Float;
    const bool is_whole = count <= most;
    const std::size_t runs = is_whole ? (count + kPackWidth - 1) / kPackWidth : most / kPackWidth;
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
    // Behind the last one, there is nothing that is low or below a plane.
    Float(std::numeric_limits<float>::infinity()).store(z + size_);
  }

  std::size_t size() const { return size_; }
  /// Heights (m), with infinite ones behind the last to fill up eight lanes.
  const float* heights() const { return points_.z.data(); }

  /// Moments of the points in a half space whose origin is above or below the first record.
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

  /// Whether all points are in such a half space.
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
