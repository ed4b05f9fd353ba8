// Range limits of the points that are evaluated.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "dynains/errors.hpp"

namespace dynains::evaluation::detail {

/// Planar range within [min_range, max_range], in metres; max_range 0 is no limit.
class RangeGate {
 public:
  /// Throws ConfigError for ranges that are negative, not finite or crossed.
  RangeGate(double min_range, double max_range)
      : min_squared_(min_range * min_range),
        max_squared_(max_range > 0 ? max_range * max_range : std::numeric_limits<double>::max()) {
    if (!(min_range >= 0) || !(max_range >= 0) || !std::isfinite(min_range) ||
        !std::isfinite(max_range) || (max_range > 0 && max_range < min_range)) {
      throw ConfigError("evaluation ranges [min_range, max_range] = [" + std::to_string(min_range) +
                        ", " + std::to_string(max_range) +
                        "] must be finite, not negative and not crossed (max_range 0 = no limit)");
    }
  }

  /// False for points that are not finite and for "no return" (all zero).
  bool passes(const float* xyz) const {
    const double x = xyz[0], y = xyz[1];
    const double squared = x * x + y * y;
    if (!(squared >= min_squared_ && squared <= max_squared_)) return false;
    return std::isfinite(xyz[2]) && (squared > 0 || xyz[2] != 0);
  }

 private:
  double min_squared_;
  double max_squared_;
};

}  // namespace dynains::evaluation::detail
