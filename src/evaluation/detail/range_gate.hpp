// Range limits of the points that are evaluated.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

#include "dynains/evaluation/scan.hpp"

namespace dynains::evaluation::detail {

/// Planar range from the sensor of a point within [min_range, max_range], in metres; max_range 0 is
/// no limit.
class RangeGate {
 public:
  RangeGate(double min_range, double max_range)
      : min_squared_(min_range * min_range),
        max_squared_(max_range > 0 ? max_range * max_range : std::numeric_limits<double>::max()) {}

  /// False for points that are not finite and for "no return" (all zero).
  bool passes(const LabelledScan& scan, std::size_t i) const {
    const Eigen::Vector3d p = scan.point(i);
    const bool is_return = (p.x() != 0) | (p.y() != 0) | (p.z() != 0);
    double x = p.x(), y = p.y();
    if (!scan.origins.empty()) {
      const Eigen::Vector3d& origin = scan.origins[scan.sensors == nullptr ? 0 : scan.sensors[i]];
      x -= origin.x();
      y -= origin.y();
    }
    const double squared = x * x + y * y;
    const bool is_inside = (squared >= min_squared_) & (squared <= max_squared_);
    return is_inside & is_return & (std::abs(p.z()) <= std::numeric_limits<double>::max());
  }

 private:
  double min_squared_;
  double max_squared_;
};

}  // namespace dynains::evaluation::detail
