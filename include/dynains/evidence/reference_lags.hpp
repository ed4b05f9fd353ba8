// Which scans give evidence on which others.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

namespace dynains {

/// Scans back and ahead that are looked at: dense near the scan, sparse far from it. The nearest
/// ones mostly show that something is still there, which later ones have to outweigh.
inline constexpr std::array<int, 19> kReferenceLags = {2,  4,  6,  8,  10,  13,  16,  20,  25, 30,
                                                       40, 50, 65, 80, 100, 125, 150, 175, 200};

/// Where only one of `step` scans can be looked at: kReferenceLags up to `most`, each moved on to
/// the next that leaves `remainder` when divided by `step`, or back where that is beyond `most`.
/// Ascending, each once.
inline std::vector<int> reference_lags(int most, int remainder, int step) {
  const auto behind = [&](int lag) { return ((remainder - lag) % step + step) % step; };
  const int last = most >= 0 ? most + behind(most) - (behind(most) > 0 ? step : 0) : 0;
  std::vector<int> lags;
  for (const int wanted : kReferenceLags) {
    if (wanted >= most + step) break;
    const int lag = std::min(wanted + behind(wanted), last);
    if (lag > (lags.empty() ? 0 : lags.back())) lags.push_back(lag);
  }
  return lags;
}

}  // namespace dynains
