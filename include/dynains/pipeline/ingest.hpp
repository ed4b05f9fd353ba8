// Input filter: copies the valid points of a cloud and lists the others.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// The points of a cloud that are judged.
struct JudgedRegion {
  float min_range = 0.0F;  ///< m, from the sensor of a point, in the x-y plane of the cloud
  float max_range = 0.0F;  ///< m, in that plane, and along its normal
  /// Position of the sensor in the frame of the cloud, m, or the mean of several sensors.
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  std::vector<Eigen::Vector3f> sensors;  ///< m, of several sensors, relative to `origin`
};

/// Copies the valid points of a cloud as floats. A valid point has finite coordinates and lies
/// within the judged region. The copies are relative to JudgedRegion::origin.
class Ingest {
 public:
  /// `cloud`: m. Points at the origin of the cloud or at the sensor are beams without a return and
  /// get kInvalid, as do NaN and infinity. `R`: rotation of the valid points after the range test,
  /// or null for none. Throws CloudError for a sensor that is not in the region.
  void read(const CloudView& cloud, const JudgedRegion& region, const Eigen::Matrix3d* R) {
    const auto rotation = PackTransform::rotation(R != nullptr ? *R : Eigen::Matrix3d::Identity());
    const std::size_t count = cloud.size();
    for (auto* list : {&out_of_range_, &invalid_}) {
      list->clear();
      ensure_capacity(*list, count);
    }
    points_.grow(count + kPackWidth);
    grow(input_, count + kPackWidth);
    count_ = 0;
    read_sensors(cloud, region.sensors.size());
    for (std::size_t begin = 0; begin < count; begin += kStepPoints) {
      const std::size_t length = std::min(kStepPoints, count - begin);
      cloud.copy(begin, length, points_.x.data() + count_, points_.y.data() + count_,
                 points_.z.data() + count_);
      if (!region.origin.isZero(0.0F)) subtract(region.origin, length);
      if (!region.sensors.empty()) subtract_sensors(begin, length, region.sensors);
      const float nearest = region.min_range * region.min_range;
      const float farthest = region.max_range * region.max_range;
      const std::size_t valid_count = region.sensors.empty()
                                          ? filter<false>(begin, length, nearest, farthest)
                                          : filter<true>(begin, length, nearest, farthest);
      if (R != nullptr) {
        transform_points(PointsView(points_).subview(count_, valid_count), rotation, points_,
                         count_);
      }
      count_ += valid_count;
    }
  }

  /// Rotates the valid points by `R`.
  void turn(const Eigen::Matrix3d& R) { rotate(points(), R, points_); }

  /// Valid points, m.
  PointsView points() const { return PointsView(points_).subview(0, count_); }
  /// Input index of each valid point; longer than points().
  const std::vector<std::uint32_t>& input() const { return input_; }
  /// Sensor of each input point; empty for one sensor.
  Span<const std::uint8_t> sensors() const { return sensors_; }
  /// Number of input points by sensor; empty for one sensor.
  Span<const std::size_t> counts() const { return counts_; }
  /// Sensor of each valid point; empty for one sensor. Valid until the next call.
  Span<const std::uint8_t> valid_sensors() {
    valid_sensors_.clear();
    for (std::size_t i = 0; i < count_ && !sensors_.empty(); ++i) {
      valid_sensors_.push_back(sensors_[input_[i]]);
    }
    return valid_sensors_;
  }
  /// Input indices of the other points: kOutOfRange and kInvalid.
  const std::vector<std::uint32_t>& out_of_range() const { return out_of_range_; }
  const std::vector<std::uint32_t>& invalid() const { return invalid_; }

 private:
  // Moves the appended points, except beams without a return, which stay at the origin.
  void subtract(const Eigen::Vector3f& origin, std::size_t length) {
    float* const x = points_.x.data() + count_;
    float* const y = points_.y.data() + count_;
    float* const z = points_.z.data() + count_;
    for (std::size_t i = 0; i < length; ++i) {
      const bool is_return = x[i] != 0.0F || y[i] != 0.0F || z[i] != 0.0F;
      x[i] -= is_return ? origin.x() : 0.0F;
      y[i] -= is_return ? origin.y() : 0.0F;
      z[i] -= is_return ? origin.z() : 0.0F;
    }
  }

  void read_sensors(const CloudView& cloud, std::size_t sensor_count) {
    counts_.assign(sensor_count, 0);
    resize_with_margin(sensors_, sensor_count == 0 ? 0 : cloud.size());
    if (sensors_.empty()) return;
    cloud.copy_sensors(sensors_.data());
    std::array<std::size_t, 256> counts = {};
    for (const std::uint8_t sensor : sensors_) ++counts[sensor];
    for (std::size_t i = sensor_count; i < counts.size(); ++i) {
      if (counts[i] == 0) continue;
      throw CloudError("a point of the cloud is of sensor " + std::to_string(i) +
                       ", DynaInsRemover.sensors has " + std::to_string(sensor_count));
    }
    std::copy_n(counts.begin(), sensor_count, counts_.begin());
  }

  // Positions of the appended points relative to the sensor of each.
  void subtract_sensors(std::size_t begin, std::size_t length,
                        Span<const Eigen::Vector3f> sensors) {
    own_.grow(kStepPoints + kPackWidth);
    for (std::size_t i = 0; i < length; ++i) {
      const Eigen::Vector3f& sensor = sensors[sensors_[begin + i]];
      own_.x[i] = points_.x[count_ + i] - sensor.x();
      own_.y[i] = points_.y[count_ + i] - sensor.y();
      own_.z[i] = points_.z[count_ + i] - sensor.z();
    }
  }

  // Compacts the valid points among the appended ones and lists the others. Returns the number of
  // valid points. The branch for a whole valid pack is the common case. `kHasOwn`: ranges are those
  // of own_.
  template <bool kHasOwn>
  std::size_t filter(std::size_t begin, std::size_t length, float min_squared, float max_squared) {
    std::size_t result = 0;
    with_packs([&](auto packs) {
      using Packs = decltype(packs);
      using Float = typename Packs::Float;
      using Int = typename Packs::Int;
      // Local copies of members avoid reloads after stores that could alias them.
      const Float nearest(min_squared), farthest(max_squared), zero(0.0F);
      float* const xs = points_.x.data() + count_;
      float* const ys = points_.y.data() + count_;
      float* const zs = points_.z.data() + count_;
      std::uint32_t* const input = input_.data() + count_;
      std::size_t valid_count = 0;
      for_slices<Packs>(0, length, [&](auto at) {
        const Float x = at.load(xs);
        const Float y = at.load(ys);
        const Float z = at.load(zs);
        const Float own_x = kHasOwn ? at.load(own_.x.data()) : x;
        const Float own_y = kHasOwn ? at.load(own_.y.data()) : y;
        const Float own_z = kHasOwn ? at.load(own_.z.data()) : z;
        const Float squared = own_x * own_x + own_y * own_y;
        // Comparisons with NaN are false, so NaN fails this test. Zeros behind the end fail it,
        // too.
        auto is_good = (squared >= nearest) & (squared <= farthest) & (own_z * own_z <= farthest) &
                       (squared + abs(own_z) > zero);
        if (kHasOwn) is_good = is_good & (abs(x) + abs(y) + abs(z) > zero);
        const unsigned good = is_good.bits();
        const std::size_t first = begin + at.begin;
        if (good == Packs::kAll) {
          x.store(xs + valid_count);
          y.store(ys + valid_count);
          z.store(zs + valid_count);
          (pack_indices<Int>() + Int(static_cast<std::int32_t>(first)))
              .store(reinterpret_cast<std::int32_t*>(input + valid_count));
          valid_count += Packs::kCount;
          return;
        }
        const Float infinity(std::numeric_limits<float>::infinity());
        auto is_return = (abs(x) < infinity) & (abs(y) < infinity) & (abs(z) < infinity) &
                         (abs(x) + abs(y) + abs(z) > zero);
        if (kHasOwn) is_return = is_return & (squared + abs(own_z) > zero);
        const unsigned returns = is_return.bits();
        const unsigned bad = ~good & ((1U << at.size()) - 1U);
        for_each_bit(bad, [&](std::size_t k) {
          const bool is_hit = (returns >> k & 1U) != 0;
          (is_hit ? out_of_range_ : invalid_).push_back(static_cast<std::uint32_t>(first + k));
        });
        for (std::size_t k = 0; k < at.size(); ++k) {
          xs[valid_count] = xs[at.begin + k];
          ys[valid_count] = ys[at.begin + k];
          zs[valid_count] = zs[at.begin + k];
          input[valid_count] = static_cast<std::uint32_t>(first + k);
          valid_count += (good >> k) & 1U;
        }
      });
      result = valid_count;
    });
    return result;
  }

  std::size_t count_ = 0;
  PointBuffer points_;
  PointBuffer own_;  // some points, relative to the sensor of each
  std::vector<std::uint32_t> input_, out_of_range_, invalid_;
  std::vector<std::uint8_t> sensors_, valid_sensors_;
  std::vector<std::size_t> counts_;
};

}  // namespace dynains::detail
