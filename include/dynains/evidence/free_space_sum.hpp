// How what scans saw of a place adds up to a belief that it was free.
#pragma once

#include <algorithm>

#include "dynains/belief_updater.hpp"

namespace dynains::detail {

/// Steps of a log-odds sum (Eq. 15) in three sizes (the form of Eq. 18), by the share of what a
/// scan saw of a place that it saw free; never below zero (Page's test), so that a place which was
/// hit for long may still be left.
class FreeSpaceSum {
 public:
  static constexpr float kFreeShare = 0.6F;  ///< from which a scan speaks for free space
  static constexpr float kHitShare = 0.3F;   ///< up to which a place counts as hit

  /// Update probabilities of a scan that sees through and of one that hits.
  FreeSpaceSum(double p_free, double p_hit)
      : increment_(static_cast<float>(log_odds(p_free))),
        decrement_(static_cast<float>(log_odds(p_hit))) {}

  float increment() const { return increment_; }

  /// For a share of at least kFreeShare.
  void raise(float& level, float share) const {
    constexpr float kWhollyFree = 0.9F;  // counts twice
    level += (share > kWhollyFree ? 2.0F : 1.0F) * increment_;
  }
  void lower(float& level) const { level = std::max(0.0F, level + decrement_); }

 private:
  float increment_;
  float decrement_;
};

}  // namespace dynains::detail
