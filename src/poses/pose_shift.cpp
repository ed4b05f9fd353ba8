#include "pose_shift.hpp"

#include <algorithm>
#include <cmath>

namespace dynains {
namespace {

constexpr std::size_t kUnshifted = kFarthestShift;

/// Decrease of the gaps under another shift, over all pairs.
struct Gain {
  double mean = 0.0;   // m
  double error = 0.0;  // standard error of the mean, m
  std::size_t better = 0;
  std::size_t worse = 0;
};

Gain gain_of(const std::vector<ShiftedGaps>& pairs, std::size_t shift) {
  constexpr double kEqual = 0.001;  // m
  const auto count = static_cast<double>(pairs.size());
  Gain gain;
  double squares = 0.0;
  for (const ShiftedGaps& gaps : pairs) {
    const double difference = gaps[kUnshifted] - gaps[shift];
    gain.mean += difference / count;
    squares += difference * difference / count;
    gain.better += difference > kEqual ? 1 : 0;
    gain.worse += difference < -kEqual ? 1 : 0;
  }
  gain.error = std::sqrt(std::max(0.0, squares - gain.mean * gain.mean) / (count - 1.0));
  return gain;
}

}  // namespace

int best_shift(const std::vector<ShiftedGaps>& pairs) {
  // Chosen on some hundred drives: none with right poses comes near these bounds. A fourth of those
  // with poses shifted by two scans exceeds them; on the others, speed and heading hardly change.
  constexpr double kLeastGain = 0.03;     // of the gap
  constexpr double kLeastErrors = 2.5;    // ratio of the mean to its standard error
  constexpr std::size_t kLeastRatio = 3;  // pairs with a smaller gap to pairs with a larger gap
  if (pairs.size() < kLeastShiftPairs) return 0;
  ShiftedGaps mean{};
  for (const ShiftedGaps& gaps : pairs) {
    for (std::size_t k = 0; k < gaps.size(); ++k) {
      mean[k] += gaps[k] / static_cast<double>(pairs.size());
    }
  }
  const auto best =
      static_cast<std::size_t>(std::min_element(mean.begin(), mean.end()) - mean.begin());
  // A minimum at the largest shift that was tried is no minimum.
  const bool is_at_end = best == 0 || best + 1 == mean.size();
  if (best == kUnshifted || is_at_end) return 0;
  const Gain gain = gain_of(pairs, best);
  const bool is_certain =
      gain.mean > kLeastGain * mean[kUnshifted] && gain.mean > kLeastErrors * gain.error &&
      gain.better >= kLeastShiftPairs && gain.better >= kLeastRatio * gain.worse;
  return is_certain ? static_cast<int>(best) - kFarthestShift : 0;
}

}  // namespace dynains
