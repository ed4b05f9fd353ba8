// Foreign clouds on their way in.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/ground/point_record.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Takes a foreign cloud in: good points as floats, and a label for each of all points. Good ones
/// count as ground until something else is known of them.
class Ingest {
 public:
  /// Points outside [min_range, max_range] (m, in the sensor's x-y plane), higher or lower than
  /// max_range or without finite coordinates stay out; a point at the origin is a beam that did not
  /// return. What is taken in is turned by `R`, unless there is none.
  void read(const CloudView& cloud, float min_range, float max_range, const Eigen::Matrix3d* R,
            std::vector<PointLabel>& labels) {
    const auto rotation = PackTransform::rotation(R != nullptr ? *R : Eigen::Matrix3d::Identity());
    const std::size_t count = cloud.size();
    ensure_capacity(labels, count);
    labels.resize(count);
    points_.grow(count + kMaxPackWidth);
    grow(input_, count + kMaxPackWidth);
    count_ = 0;
    for (std::size_t begin = 0; begin < count; begin += kPiece) {
      const std::size_t length = std::min(kPiece, count - begin);
      copy(cloud, begin, length);
      const std::size_t taken =
          sort_out(begin, length, min_range * min_range, max_range * max_range, labels.data());
      if (R != nullptr) {
        transform_points(PointsView(points_).subview(count_, taken), rotation, points_, count_);
      }
      count_ += taken;
    }
  }

  /// Turns the points that were taken in.
  void turn(const Eigen::Matrix3d& R) { rotate(points(), R, points_); }

  PointsView points() const { return PointsView(points_).subview(0, count_); }
  /// Position in the input of each point that was taken in.
  const std::vector<std::uint32_t>& input() const { return input_; }

 private:
  // Points that are worked off at once: they stay in the nearest cache, and are so few that reading
  // ahead goes on meanwhile.
  static constexpr std::size_t kPiece = 128;

  // Puts points behind those that were taken in, whatever they are.
  void copy(const CloudView& cloud, std::size_t begin, std::size_t length) {
    if (cloud.raw_floats() != nullptr) {
      copy(*cloud.raw_floats(), begin, length);
    } else {
      cloud.copy(begin, length, points_.x.data() + count_, points_.y.data() + count_,
                 points_.z.data() + count_);
    }
  }

  // Interleaved floats four points at a time, and fetched ahead: who wrote them did so long ago.
  void copy(const RawPoints<float>& cloud, std::size_t begin, std::size_t length) {
    constexpr std::size_t kAhead = 128;  // points
    float* const x = points_.x.data() + count_;
    float* const y = points_.y.data() + count_;
    float* const z = points_.z.data() + count_;
    const auto point = [&cloud](std::size_t i) { return cloud.data + i * cloud.stride; };
    std::size_t i = 0;
    // Nothing need lie behind the coordinates of the last point.
    for (; cloud.stride >= 4 && i + 4 <= length && begin + i + 4 < cloud.count; i += 4) {
      const std::size_t at = begin + i;
      __builtin_prefetch(point(std::min(at + kAhead, cloud.count - 1)));
      const auto columns = transposed({load_four(point(at)), load_four(point(at + 1)),
                                       load_four(point(at + 2)), load_four(point(at + 3))});
      detail::store(columns[0], x + i);
      detail::store(columns[1], y + i);
      detail::store(columns[2], z + i);
    }
    for (; i < length; ++i) {
      x[i] = point(begin + i)[0];
      y[i] = point(begin + i)[1];
      z[i] = point(begin + i)[2];
    }
  }

  // Labels the bad ones among these and closes the gaps that they leave; counts the good ones.
  // Mostly, all of them are.
  std::size_t sort_out(std::size_t begin, std::size_t length, float min_squared, float max_squared,
                       PointLabel* label_of) {
    std::size_t result = 0;
    run_max_packs([&](auto packs) {
      using Packs = decltype(packs);
      using Float = typename Packs::Float;
      using Int = typename Packs::Int;
      // Read once: stores may change anything, as far as the compiler knows.
      const Float nearest(min_squared), farthest(max_squared), zero(0.0F);
      float* const xs = points_.x.data() + count_;
      float* const ys = points_.y.data() + count_;
      float* const zs = points_.z.data() + count_;
      std::uint32_t* const input = input_.data() + count_;
      PointLabel* const labels = label_of;
      std::size_t taken = 0;
      for_slices<Packs>(length, [&](auto at) {
        const Float x = at.load(xs);
        const Float y = at.load(ys);
        const Float z = at.load(zs);
        const Float squared = x * x + y * y;
        // Comparisons with NaN are false, so that one test admits only good points; zeros behind
        // the end are bad.
        const unsigned good = ((squared >= nearest) & (squared <= farthest) & (z * z <= farthest) &
                               (squared + abs(z) > zero))
                                  .bits();
        const std::size_t first = begin + at.begin;
        if (good == Packs::kAll) {
          x.store(xs + taken);
          y.store(ys + taken);
          z.store(zs + taken);
          (pack_indices<Int>() + Int(static_cast<std::int32_t>(first)))
              .store(reinterpret_cast<std::int32_t*>(input + taken));
          std::fill_n(labels + first, Packs::kCount, PointLabel::kGround);
          taken += Packs::kCount;
          return;
        }
        const Float infinity(std::numeric_limits<float>::infinity());
        const unsigned returns = ((abs(x) < infinity) & (abs(y) < infinity) & (abs(z) < infinity) &
                                  (abs(x) + abs(y) + abs(z) > zero))
                                     .bits();
        for (std::size_t k = 0; k < at.size(); ++k) {
          xs[taken] = xs[at.begin + k];
          ys[taken] = ys[at.begin + k];
          zs[taken] = zs[at.begin + k];
          input[taken] = static_cast<std::uint32_t>(first + k);
          const unsigned is_good = (good >> k) & 1U;
          taken += is_good;
          const PointLabel bad =
              ((returns >> k) & 1U) != 0 ? PointLabel::kOutOfRange : PointLabel::kInvalid;
          labels[first + k] = is_good != 0 ? PointLabel::kGround : bad;
        }
      });
      result = taken;
    });
    return result;
  }

  std::size_t count_ = 0;
  PointBuffer points_;
  std::vector<std::uint32_t> input_;
};

}  // namespace dynains::detail
