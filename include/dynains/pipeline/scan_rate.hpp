// Doubts about the unit of the times of scans.
#pragma once

#include <cstddef>

#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Finds intervals of scans that no LiDAR has.
class ScanRate {
 public:
  /// `interval`: s since the previous scan. `max_gap`: RemoverConfig::max_gap, s.
  TimeDoubt add(double interval, double max_gap) {
    constexpr std::size_t kEnough = 3;  // intervals; a pause is one
    constexpr double kShortest = 1e-3;  // s
    slow_ = interval > max_gap ? slow_ + 1 : 0;
    fast_ = interval < kShortest ? fast_ + 1 : 0;
    if (slow_ >= kEnough) return TimeDoubt::kTooSlow;
    return fast_ >= kEnough ? TimeDoubt::kTooFast : TimeDoubt::kNone;
  }

 private:
  std::size_t slow_ = 0, fast_ = 0;  // of the last intervals, without a break
};

}  // namespace dynains::detail
