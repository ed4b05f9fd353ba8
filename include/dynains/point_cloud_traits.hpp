// Access to point clouds of any type. To support a type, specialise PointCloudTraits:
//
//   template <> struct dynains::PointCloudTraits<MyCloud> {
//     static std::size_t size(const MyCloud& cloud);
//     static Eigen::Vector3f point(const MyCloud& cloud, std::size_t i);  // metres, sensor frame
//     // Optional, for several sensors: index in RemoverConfig::sensors.
//     static std::uint8_t sensor(const MyCloud& cloud, std::size_t i);
//   };
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/pack.hpp"

namespace dynains {

template <class Cloud, class Enable = void>
struct PointCloudTraits;

/// Non-owning view of interleaved points, m, sensor frame: x, y, z and `stride - 3` ignored values
/// per point. Example: float x y z intensity with stride 4.
template <class Scalar>
struct RawPoints {
  static_assert(std::is_floating_point_v<Scalar>, "coordinates are float or double");

  const Scalar* data;
  std::size_t count;
  std::size_t stride = 3;  ///< scalars per point, at least 3
  /// By point, index of its sensor in RemoverConfig::sensors; null: all are of the first one.
  const std::uint8_t* sensors = nullptr;
};

template <class Scalar>
RawPoints(const Scalar*, std::size_t, std::size_t) -> RawPoints<Scalar>;
template <class Scalar>
RawPoints(const Scalar*, std::size_t) -> RawPoints<Scalar>;

template <class Scalar>
struct PointCloudTraits<RawPoints<Scalar>> {
  /// Throws CloudError for a stride below 3 or missing data.
  static std::size_t size(const RawPoints<Scalar>& cloud) {
    if (cloud.stride < 3) {
      throw CloudError("RawPoints.stride = " + std::to_string(cloud.stride) +
                       " must be at least 3 scalars");
    }
    if (cloud.data == nullptr && cloud.count > 0) {
      throw CloudError("RawPoints.data is null, RawPoints.count = " + std::to_string(cloud.count));
    }
    return cloud.count;
  }
  static Eigen::Vector3f point(const RawPoints<Scalar>& cloud, std::size_t i) {
    const Scalar* const p = cloud.data + i * cloud.stride;
    return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
  }
  static std::uint8_t sensor(const RawPoints<Scalar>& cloud, std::size_t i) {
    return cloud.sensors == nullptr ? std::uint8_t{0} : cloud.sensors[i];
  }
};

template <>
struct PointCloudTraits<PointsView> {
  /// Throws CloudError for arrays of different lengths.
  static std::size_t size(const PointsView& cloud) {
    if (cloud.y.size() != cloud.x.size() || cloud.z.size() != cloud.x.size()) {
      throw CloudError("PointsView has " + std::to_string(cloud.x.size()) + " x, " +
                       std::to_string(cloud.y.size()) + " y and " + std::to_string(cloud.z.size()) +
                       " z; expected equal numbers");
    }
    return cloud.size();
  }
  static Eigen::Vector3f point(const PointsView& cloud, std::size_t i) {
    return {cloud.x[i], cloud.y[i], cloud.z[i]};
  }
};

namespace detail {

template <class Cloud, class = void>
struct IsPointMatrix : std::false_type {};
template <class Cloud>
struct IsPointMatrix<Cloud, std::enable_if_t<std::is_base_of_v<Eigen::MatrixBase<Cloud>, Cloud>>>
    : std::bool_constant<Cloud::RowsAtCompileTime == 3 || Cloud::RowsAtCompileTime == 4 ||
                         Cloud::ColsAtCompileTime == 3 || Cloud::ColsAtCompileTime == 4> {};

}  // namespace detail

/// Dense Eigen matrices, maps and blocks. If the number of rows is 3 or 4 at compile time, each
/// column is a point; else, if the number of columns is 3 or 4, each row is a point. A fourth
/// coordinate is ignored.
template <class Matrix>
struct PointCloudTraits<Matrix, std::enable_if_t<detail::IsPointMatrix<Matrix>::value>> {
  static constexpr bool kColumns = Matrix::RowsAtCompileTime == 3 || Matrix::RowsAtCompileTime == 4;

  static std::size_t size(const Matrix& cloud) {
    return static_cast<std::size_t>(kColumns ? cloud.cols() : cloud.rows());
  }
  static Eigen::Vector3f point(const Matrix& cloud, std::size_t i) {
    const auto at = static_cast<Eigen::Index>(i);
    if constexpr (kColumns) {
      return {static_cast<float>(cloud(0, at)), static_cast<float>(cloud(1, at)),
              static_cast<float>(cloud(2, at))};
    } else {
      return {static_cast<float>(cloud(at, 0)), static_cast<float>(cloud(at, 1)),
              static_cast<float>(cloud(at, 2))};
    }
  }
};

/// Vectors of fixed-size Eigen vectors with at least three coordinates.
template <class Scalar, int kRows, int kOptions, class Allocator>
struct PointCloudTraits<
    std::vector<Eigen::Matrix<Scalar, kRows, 1, kOptions, kRows, 1>, Allocator>> {
  static_assert(kRows >= 3, "a point needs three coordinates");
  using Cloud = std::vector<Eigen::Matrix<Scalar, kRows, 1, kOptions, kRows, 1>, Allocator>;

  static std::size_t size(const Cloud& cloud) { return cloud.size(); }
  static Eigen::Vector3f point(const Cloud& cloud, std::size_t i) {
    return cloud[i].template head<3>().template cast<float>();
  }
};

/// Consecutive points of a cloud that one sensor measured, as in a concatenated cloud.
struct SensorRange {
  std::size_t begin = 0;    ///< index of the first point
  std::size_t length = 0;   ///< number of points
  std::uint8_t sensor = 0;  ///< index in RemoverConfig::sensors
};

}  // namespace dynains

namespace dynains::detail {

template <class Cloud>
using SensorAccessor = decltype(std::uint8_t{
    PointCloudTraits<Cloud>::sensor(std::declval<const Cloud&>(), 0)});

template <class Cloud, class = void>
struct HasPointCloudTraits : std::false_type {};
template <class Cloud>
struct HasPointCloudTraits<
    Cloud,
    std::void_t<
        decltype(std::size_t{PointCloudTraits<Cloud>::size(std::declval<const Cloud&>())}),
        decltype(PointCloudTraits<Cloud>::point(std::declval<const Cloud&>(), std::size_t{}).x())>>
    : std::true_type {};

/// Type-erased view of a cloud with PointCloudTraits. The cloud must outlive the view.
class CloudView {
 public:
  template <class Cloud>
  explicit CloudView(const Cloud& cloud, Span<const SensorRange> sensors = {})
      : cloud_(&cloud), ranges_(sensors) {
    static_assert(HasPointCloudTraits<Cloud>::value,
                  "no cloud of points: specialise dynains::PointCloudTraits<Cloud> with "
                  "static std::size_t size(const Cloud&) and static Eigen::Vector3f point(const "
                  "Cloud&, std::size_t), as in examples/02_own_cloud_type.cpp; for interleaved "
                  "numbers pass dynains::RawPoints{numbers.data(), points, numbers_per_point}");
    if constexpr (HasPointCloudTraits<Cloud>::value) {  // else one error is enough
      size_ = PointCloudTraits<Cloud>::size(cloud);
      copy_ = &copy_from<Cloud>;
      if constexpr (HasSensors<Cloud>::value) copy_sensors_ = &copy_sensors_from<Cloud>;
    }
  }

  std::size_t size() const { return size_; }
  /// Writes the coordinates of points [begin, begin + count), m, sensor frame.
  void copy(std::size_t begin, std::size_t count, float* x, float* y, float* z) const {
    copy_(cloud_, begin, count, x, y, z);
  }
  /// Writes the sensor of each point: 0 where none is given. Throws CloudError for a range beyond
  /// the cloud.
  void copy_sensors(std::uint8_t* sensors) const {
    std::fill_n(sensors, size_, std::uint8_t{0});
    if (copy_sensors_ != nullptr) copy_sensors_(cloud_, size_, sensors);
    for (const SensorRange& range : ranges_) {
      if (range.begin > size_ || range.length > size_ - range.begin) {
        throw CloudError("SensorRange: points " + std::to_string(range.begin) + " + " +
                         std::to_string(range.length) + " of a cloud of " + std::to_string(size_));
      }
      std::fill_n(sensors + range.begin, range.length, range.sensor);
    }
  }

 private:
  template <class Cloud, class = void>
  struct HasSensors : std::false_type {};
  template <class Cloud>
  struct HasSensors<Cloud, std::void_t<SensorAccessor<Cloud>>> : std::true_type {};

  template <class Cloud>
  static void copy_sensors_from(const void* erased, std::size_t count, std::uint8_t* sensors) {
    const Cloud& cloud = *static_cast<const Cloud*>(erased);
    for (std::size_t i = 0; i < count; ++i) sensors[i] = PointCloudTraits<Cloud>::sensor(cloud, i);
  }
  template <class Cloud>
  static void copy_from(const void* erased, std::size_t begin, std::size_t count, float* x,
                        float* y, float* z) {
    const Cloud& cloud = *static_cast<const Cloud*>(erased);
    std::size_t i = 0;
    if constexpr (std::is_same_v<Cloud, RawPoints<float>>) {
      const std::size_t stride = cloud.stride;  // a store could alias the member
      const float* from = cloud.data + begin * stride;
      for (; stride >= 4 && i + 4 <= count; i += 4, from += 4 * stride) {
        transpose(from, stride, x + i, y + i, z + i);
      }
    }
    for (; i < count; ++i) {
      const auto p = PointCloudTraits<Cloud>::point(cloud, begin + i);
      x[i] = p.x();
      y[i] = p.y();
      z[i] = p.z();
    }
  }

  // Writes the coordinates of four points with `stride` floats each, at least four.
  static void transpose(const float* points, std::size_t stride, float* x, float* y, float* z) {
    Floats4 a, b, c, d, ab, cd, axis;
    load(points, a);
    load(points + stride, b);
    load(points + 2 * stride, c);
    load(points + 3 * stride, d);
    shuffle<0, 4, 1, 5>(a, b, ab);
    shuffle<0, 4, 1, 5>(c, d, cd);
    shuffle<0, 1, 4, 5>(ab, cd, axis);
    store(axis, x);
    shuffle<2, 3, 6, 7>(ab, cd, axis);
    store(axis, y);
    shuffle<2, 6, 3, 7>(a, b, ab);
    shuffle<2, 6, 3, 7>(c, d, cd);
    shuffle<0, 1, 4, 5>(ab, cd, axis);
    store(axis, z);
  }

  const void* cloud_;
  std::size_t size_ = 0;
  Span<const SensorRange> ranges_;
  void (*copy_sensors_)(const void*, std::size_t, std::uint8_t*) = nullptr;  // null: none given
  void (*copy_)(const void*, std::size_t, std::size_t, float*, float*, float*) = nullptr;
};

}  // namespace dynains::detail
