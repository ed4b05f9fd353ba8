// Log-odds of probabilities, and the sum of log-odds that a voxel is free.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace dynains {

/// l(p) = log(p / (1 - p)), the log-odds of a probability p in (0, 1).
inline double log_odds(double probability) { return std::log(probability / (1.0 - probability)); }

/// Inverse of log_odds(), in (0, 1) (below Eq. 19).
inline double probability(double log_odds) { return 1.0 / (1.0 + std::exp(-log_odds)); }

}  // namespace dynains

namespace dynains::detail {

/// Updates the log-odds that a voxel, supervoxel or instance is free (Eq. 15). Each reference scan
/// adds one of three increments (form of Eq. 18), by the ratio of its free to visible samples. The
/// sum is never below zero (Page, Continuous inspection schemes, Biometrika 41, 1954): early hits
/// do not cancel later free samples, since an object that moves leaves its place late.
class FreeSpaceSum {
 public:
  /// Limits of the ratio of free to visible samples in one reference scan: raise() from kFreeRatio
  /// on, lower() up to kHitRatio.
  static constexpr float kFreeRatio = 0.6F;
  static constexpr float kHitRatio = 0.3F;

  /// `p_free`, in (0.5, 1): update probability of raise(). `p_hit`, in (0, 0.5): update probability
  /// of lower().
  FreeSpaceSum(double p_free, double p_hit)
      : increment_(static_cast<float>(log_odds(p_free))),
        decrement_(static_cast<float>(log_odds(p_hit))) {}

  /// Ratio of free to visible samples of a block in one reference scan. Empty if too few of its
  /// `samples` are visible: less than 30 %, or less than two unless it has only one.
  static std::optional<float> free_ratio(std::uint32_t free, std::uint32_t hit,
                                         std::uint32_t samples) {
    const auto visible = static_cast<float>(free + hit);
    const auto least = static_cast<float>(std::min(2U, samples));
    if (free + hit == 0 || visible < std::max(least, 0.3F * static_cast<float>(samples))) {
      return std::nullopt;
    }
    return static_cast<float>(free) / visible;
  }
  /// 1 if so many free and hit samples show that a block is free, -1 if it is hit, else 0.
  static int judge(std::uint32_t free, std::uint32_t hit, std::uint32_t samples) {
    const std::optional<float> ratio = free_ratio(free, hit, samples);
    if (!ratio) return 0;
    return *ratio >= kFreeRatio ? 1 : *ratio <= kHitRatio ? -1 : 0;
  }

  /// Adds the increment once, or twice if nearly all visible samples are free (the weight 2 of
  /// Eq. 18). `level`: log-odds, >= 0. `free_ratio`: ratio of free to visible samples, [0, 1].
  /// `weight`: factor of the increment.
  void raise(float& level, float free_ratio, float weight = 1.0F) const {
    level += (free_ratio > 0.9F ? 2.0F : 1.0F) * weight * increment_;
  }
  /// Adds the negative increment of a hit; stops at zero.
  void lower(float& level) const { level = std::max(0.0F, level + decrement_); }

 private:
  float increment_;
  float decrement_;
};

}  // namespace dynains::detail
