// Log-odds of probabilities, and their sum over the scans that test a place.
#pragma once

#include <algorithm>
#include <cmath>

namespace dynains {

/// l(p) = log(p / (1 - p)), the log-odds of a probability in (0, 1).
inline double log_odds(double probability) { return std::log(probability / (1.0 - probability)); }

/// Inverse of log_odds (below Eq. 19).
inline double probability(double log_odds) { return 1.0 / (1.0 + std::exp(-log_odds)); }

}  // namespace dynains

namespace dynains::detail {

/// Increments of the log-odds that a place was free (Eq. 15), by the ratio of free to visible
/// samples of the place in one scan (three sizes, as in Eq. 18). The sum is never below zero
/// (Page's test), so that a place which was hit for long may still become free.
class FreeSpaceSum {
 public:
  static constexpr float kFreeRatio = 0.6F;  ///< from which the place counts as free
  static constexpr float kHitRatio = 0.3F;   ///< up to which the place counts as hit

  /// `p_free`, `p_hit`: update probabilities of a scan that finds the place free, or hits it.
  FreeSpaceSum(double p_free, double p_hit)
      : increment_(static_cast<float>(log_odds(p_free))),
        decrement_(static_cast<float>(log_odds(p_hit))) {}

  float increment() const { return increment_; }

  /// `free_ratio`: at least kFreeRatio.
  void raise(float& level, float free_ratio) const {
    constexpr float kWhollyFree = 0.9F;  // counts twice
    level += (free_ratio > kWhollyFree ? 2.0F : 1.0F) * increment_;
  }
  void lower(float& level) const { level = std::max(0.0F, level + decrement_); }

 private:
  float increment_;
  float decrement_;
};

}  // namespace dynains::detail
