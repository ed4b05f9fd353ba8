// Points of scans in their usual forms.
#pragma once

#include "dynains/points.hpp"
#include "support/standard.hpp"

namespace dynains::test {

/// Adds a point of floats or doubles.
template <class Derived>
void add_point(PointBuffer& points, const Eigen::MatrixBase<Derived>& point) {
  const Eigen::Vector3f p = point.template cast<float>();
  points.push_back(p.x(), p.y(), p.z());
}

inline PointBuffer buffer_of(const std::vector<Eigen::Vector3f>& points) {
  PointBuffer result;
  for (const Eigen::Vector3f& p : points) add_point(result, p);
  return result;
}

/// `xyzi`: interleaved.
inline PointBuffer buffer_of(const std::vector<float>& xyzi) {
  PointBuffer result;
  for (std::size_t i = 0; i + 3 < xyzi.size(); i += 4) {
    result.push_back(xyzi[i], xyzi[i + 1], xyzi[i + 2]);
  }
  return result;
}

/// A scan of these points, none of them ground.
inline GroundSplit split_of(const PointBuffer& points) {
  GroundSplit split;
  split.resize(points.size());
  for (std::size_t i = 0; i < split.count; ++i) split.points.set(i, points, i);
  return split;
}

}  // namespace dynains::test
