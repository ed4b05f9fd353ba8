// Conversion between NumPy and the library: inputs are read in place, results are moved.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "dynains/adapters/matrix_pose.hpp"
#include "dynains/errors.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/pose.hpp"

namespace dynains::python {

namespace py = pybind11;

/// Coordinates in an array of any strides, a point per row.
template <class Scalar>
struct StridedPoints {
  const char* data;
  std::size_t count;
  std::ptrdiff_t row, column;  // bytes

  float coordinate(std::size_t i, std::ptrdiff_t k) const {
    Scalar value;
    std::memcpy(&value, data + static_cast<std::ptrdiff_t>(i) * row + k * column, sizeof value);
    return static_cast<float>(value);
  }
};

inline std::string shape_text(const py::array& array) {
  return py::str(array.attr("shape")).cast<std::string>();
}

inline std::string type_text(const py::handle& object) {
  return py::str(py::type::handle_of(object).attr("__name__")).cast<std::string>();
}

/// Throws CloudError unless `array` has a point in each row. Scans that were handed in by columns
/// have some thousand of them, which no record of a point has.
inline void expect_rows_of_points(const std::string& what, const py::array& array) {
  constexpr py::ssize_t kMaxColumns = 64;
  if (array.ndim() == 2 && array.shape(1) >= 3 && array.shape(1) <= kMaxColumns) return;
  std::string text = what + shape_text(array) + ", expected (N, 3), or (N, 4) and more up to " +
                     std::to_string(kMaxColumns) + " columns, x y z first";
  if (array.ndim() == 2 && array.shape(1) > kMaxColumns) text += ": transpose it, or slice it";
  throw CloudError(text);
}

/// Calls `use` with a view of an (N, 3 or more) array of float32 or float64. Throws CloudError for
/// another shape, TypeError for another type.
template <class Use>
auto with_points(const py::object& points, Use&& use) {
  if (!py::isinstance<py::array>(points)) {
    throw py::type_error("points are " + type_text(points) +
                         ", expected a NumPy array (N, 3) or (N, 4) of float32 or float64");
  }
  if (py::hasattr(points, "mask")) {
    throw py::type_error(
        "points are masked: pass points.filled(numpy.nan) to have the masked ones "
        "as invalid points, or points.data to have them all");
  }
  const auto array = py::reinterpret_borrow<py::array>(points);
  expect_rows_of_points("points have shape ", array);
  const auto* const data = static_cast<const char*>(array.data());
  const auto count = static_cast<std::size_t>(array.shape(0));
  const auto row = static_cast<std::ptrdiff_t>(array.strides(0));
  const auto column = static_cast<std::ptrdiff_t>(array.strides(1));
  if (py::isinstance<py::array_t<float>>(array)) {
    return use(StridedPoints<float>{data, count, row, column});
  }
  if (py::isinstance<py::array_t<double>>(array)) {
    return use(StridedPoints<double>{data, count, row, column});
  }
  throw py::type_error("points are " + py::str(array.dtype()).cast<std::string>() +
                       ", expected float32 or float64 of this machine's byte order");
}

using PoseArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Throws PoseError unless `pose` is a 4 x 4 rigid transform, TypeError if NumPy cannot convert it
/// to an array of numbers.
inline Pose to_pose(const py::handle& pose) {
  const PoseArray array = PoseArray::ensure(pose);
  if (!array) throw py::type_error("a pose is " + type_text(pose) + ", expected (4, 4) numbers");
  if (array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4) {
    throw PoseError("a pose has shape " + shape_text(array) + ", expected (4, 4)");
  }
  return pose_from_row_major(array.data());
}

inline py::array_t<double> to_array(const Pose& T) {
  py::array_t<double> array({4, 4});
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(array.mutable_data()) = T.matrix();
  return array;
}

/// An array over the memory of `values`, with `columns` to a row; 0 columns make it flat.
template <class T>
py::array_t<T> to_array(std::vector<T>&& values, std::size_t columns = 0) {
  auto* const owned = new std::vector<T>(std::move(values));
  const py::capsule owner(owned, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  const auto size = static_cast<py::ssize_t>(owned->size());
  if (columns == 0) return py::array_t<T>(size, owned->data(), owner);
  return py::array_t<T>({owned->size() / columns, columns}, owned->data(), owner);
}

}  // namespace dynains::python

template <class Scalar>
struct dynains::PointCloudTraits<dynains::python::StridedPoints<Scalar>> {
  using Cloud = dynains::python::StridedPoints<Scalar>;
  static std::size_t size(const Cloud& cloud) { return cloud.count; }
  static Eigen::Vector3f point(const Cloud& cloud, std::size_t i) {
    return {cloud.coordinate(i, 0), cloud.coordinate(i, 1), cloud.coordinate(i, 2)};
  }
};
