// The part of Sophus::SE3 that the adapter uses, for machines without Sophus.
#pragma once

#include <Eigen/Geometry>

namespace Sophus {

template <class Scalar, int Options = 0>
class SE3 {
 public:
  SE3(const Eigen::Quaternion<Scalar>& q, const Eigen::Matrix<Scalar, 3, 1>& t) : q_(q), t_(t) {}
  const Eigen::Quaternion<Scalar>& unit_quaternion() const { return q_; }
  const Eigen::Matrix<Scalar, 3, 1>& translation() const { return t_; }

 private:
  Eigen::Quaternion<Scalar> q_;
  Eigen::Matrix<Scalar, 3, 1> t_;
};

using SE3d = SE3<double>;
using SE3f = SE3<float>;

}  // namespace Sophus
