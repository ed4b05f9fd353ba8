// Views and buffers of points, and labels of points.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "dynains/simd/pack.hpp"

namespace dynains {

/// Verdict on one input point.
enum class PointLabel : std::uint8_t {
  kInvalid,     ///< NaN, infinity, or no return (all coordinates zero); never in the map
  kOutOfRange,  ///< not between min_range and max_range, or below noise_depth; never in the map
  kGround,      ///< static, and part of the ground
  kStatic,      ///< static, above the ground
  kDynamic,     ///< part of a moving instance; not inserted into the map
};

/// Whether a point with this label belongs to the static map.
constexpr bool is_static(PointLabel label) {
  return label == PointLabel::kGround || label == PointLabel::kStatic;
}

/// Instance id of points without an instance.
inline constexpr std::uint32_t kNoInstance = 0;

/// Cluster number of points without a cluster.
inline constexpr std::uint32_t kNoCluster = 0xFFFFFFFFU;

/// Non-owning view of a contiguous range (std::span is C++20).
template <class T>
class Span {
 public:
  constexpr Span() = default;
  constexpr Span(T* data, std::size_t size) : data_(data), size_(size) {}
  /// Implicit conversion from contiguous containers, as in std::span.
  template <class Container,
            class = std::enable_if_t<std::is_convertible_v<
                std::remove_pointer_t<decltype(std::declval<Container&>().data())> (*)[], T (*)[]>>>
  constexpr Span(Container& container) : data_(container.data()), size_(container.size()) {}

  constexpr T* data() const { return data_; }
  constexpr std::size_t size() const { return size_; }
  constexpr bool empty() const { return size_ == 0; }
  constexpr T* begin() const { return data_; }
  constexpr T* end() const { return data_ + size_; }
  constexpr T& operator[](std::size_t i) const {
    assert(i < size_);
    return data_[i];
  }
  /// `offset` + `count` is at most size().
  constexpr Span subspan(std::size_t offset, std::size_t count) const {
    assert(offset + count <= size_);
    return {data_ + offset, count};
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Non-owning view of points: three coordinate arrays of equal length, m.
struct PointsView {
  Span<const float> x;
  Span<const float> y;
  Span<const float> z;

  std::size_t size() const { return x.size(); }
  bool empty() const { return x.empty(); }
  /// Points [offset, offset + count), within size().
  PointsView subview(std::size_t offset, std::size_t count) const {
    return {x.subspan(offset, count), y.subspan(offset, count), z.subspan(offset, count)};
  }
};

namespace detail {

/// Largest integer that is not above `value`, which must be within the range of Int. Without
/// SSE4.1, std::floor() is a function call, whereas compilers vectorize this code.
template <class Int, class Real>
Int floor_to(Real value) {
  const auto truncated = static_cast<Int>(value);
  return truncated - (static_cast<Real>(truncated) - value > Real(0) ? 1 : 0);
}

/// Ensures capacity for `size` values, with a margin of 1/8, because scans differ in size by a few
/// percent.
template <class T>
void ensure_capacity(std::vector<T>& values, std::size_t size) {
  if (values.capacity() < size) values.reserve(size + size / 8);
}

/// Resizes `values` to `size`, with the capacity of ensure_capacity().
template <class T>
void resize_with_margin(std::vector<T>& values, std::size_t size) {
  ensure_capacity(values, size);
  values.resize(size);
}

/// Resizes `values` to at least `size`.
template <class T>
void grow(std::vector<T>& values, std::size_t size) {
  if (values.size() < size) resize_with_margin(values, size);
}

}  // namespace detail

/// Owning, reusable buffer of points: three coordinate arrays of equal length, m.
struct PointBuffer {
  std::vector<float> x;
  std::vector<float> y;
  std::vector<float> z;

  std::size_t size() const { return x.size(); }
  void clear() { resize(0); }
  void resize(std::size_t size) {
    x.resize(size);
    y.resize(size);
    z.resize(size);
  }
  /// Resizes the arrays to at least `size`.
  void grow(std::size_t size) {
    detail::grow(x, size);
    detail::grow(y, size);
    detail::grow(z, size);
  }
  /// Replaces point `to` by point `i` of `from`.
  void set(std::size_t to, const PointsView& from, std::size_t i) {
    x[to] = from.x[i];
    y[to] = from.y[i];
    z[to] = from.z[i];
  }
  void push_back(float px, float py, float pz) {
    x.push_back(px);
    y.push_back(py);
    z.push_back(pz);
  }
  operator PointsView() const { return {x, y, z}; }
};

/// One scan, reordered: ground points first, then all other points. Later stages use views of it
/// and copy no points.
struct GroundSplit {
  PointBuffer points;  ///< m, sensor frame; padded for packs beyond `count`
  /// Index of each point in the input of the remover; empty after the push of the scan.
  std::vector<std::uint32_t> input;
  /// By point of that input, index of its sensor; empty for one sensor, and after the push.
  Span<const std::uint8_t> sensor_of_input;
  std::size_t ground_count = 0;  ///< number of ground points
  std::size_t count = 0;         ///< number of all points; those behind them are not judged

  /// Views of all points, of those on the ground and of the others, m, sensor frame; valid until
  /// the split changes.
  PointsView all() const { return PointsView(points).subview(0, count); }
  PointsView ground() const { return PointsView(points).subview(0, ground_count); }
  PointsView non_ground() const {
    return PointsView(points).subview(ground_count, count - ground_count);
  }
  /// Sensor of point `i`.
  std::uint8_t sensor_of(std::size_t i) const {
    return sensor_of_input.empty() ? std::uint8_t{0} : sensor_of_input[input[i]];
  }
  /// Makes room for `size` points, with the padding. New points are not initialized.
  void resize(std::size_t size) {
    count = size;
    const std::size_t padded = size + detail::kPackWidth;
    points.grow(padded);
    detail::grow(input, padded);
  }
};

}  // namespace dynains
