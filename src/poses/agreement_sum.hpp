// Mean of agreements.
#pragma once

#include <cstddef>

#include "dynains/poses/diagnosis.hpp"

namespace dynains {

/// Ratio of the gaps of two readings by a few points from which on the larger one is not measured
/// by all points.
inline constexpr double kHopeless = 1.2;

/// Mean of agreements, weighted by their points.
class AgreementSum {
 public:
  void add(const Agreement& one) {
    share_ += one.share * static_cast<double>(one.points);
    gap_ += one.gap * static_cast<double>(one.points);
    points_ += one.points;
  }
  Agreement mean() const {
    if (points_ == 0) return {};
    const auto count = static_cast<double>(points_);
    return {share_ / count, gap_ / count, points_};
  }

 private:
  double share_ = 0.0;
  double gap_ = 0.0;
  std::size_t points_ = 0;
};

}  // namespace dynains
