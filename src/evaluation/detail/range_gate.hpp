// Range limits of the points that are evaluated.
#pragma once

#include <cmath>
#include <limits>

namespace dynains::evaluation::detail {

/// Planar range within [min_range, max_range], in metres; max_range 0 is no limit.
class RangeGate {
 public:
  RangeGate(double min_range, double max_range)
      : min_squared_(min_range * min_range),
        max_squared_(max_range > 0 ? max_range * max_range : std::numeric_limits<double>::max()) {}

  /// False for points that are not finite and for "no return" (all zero).
  bool passes(double x, double y, double z) const {
    const double squared = x * x + y * y;
    const bool is_inside = (squared >= min_squared_) & (squared <= max_squared_);
    const bool is_return = (squared > 0) | (z != 0);
    return is_inside & is_return & (std::abs(z) <= std::numeric_limits<double>::max());
  }
  bool passes(const float* xyz) const { return passes(xyz[0], xyz[1], xyz[2]); }

 private:
  double min_squared_;
  double max_squared_;
};

}  // namespace dynains::evaluation::detail
