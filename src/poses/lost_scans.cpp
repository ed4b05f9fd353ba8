#include "lost_scans.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "dynains/median.hpp"

namespace dynains {
namespace {

/// Errors of the motions of one chain, m at points 10 m away, each at most kMost.
struct ChainErrors {
  std::size_t first_scan = 0;
  std::vector<double> errors;
};

constexpr double kMostCounted = 0.3;  // m

/// By chain, in the order of the recording. Motions without a pose count as far off.
std::vector<ChainErrors> errors_by_chain(const Recording& recording,
                                         const std::vector<RegisteredMotion>& motions, int shift) {
  PoseConvention convention = recording.convention();
  convention.shift += shift;
  const BodyMotion body = motion_under(recording, convention);
  std::vector<ChainErrors> chains;
  for (const RegisteredMotion& motion : motions) {
    if (chains.empty() || chains.back().first_scan != motion.first) {
      chains.push_back({motion.first, {}});
    }
    const MotionError error = motion_error({motion}, body, Pose::Identity());
    chains.back().errors.push_back(error.pairs == 0 ? kMostCounted
                                                    : std::min(error.at_points, kMostCounted));
  }
  return chains;
}

std::vector<double> joined(const std::vector<ChainErrors>& chains, std::size_t from,
                           std::size_t to) {
  std::vector<double> all;
  for (std::size_t i = from; i < to; ++i) {
    all.insert(all.end(), chains[i].errors.begin(), chains[i].errors.end());
  }
  return all;
}

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Shifts that are tried, the smallest first.
std::vector<int> shifts_of(const Recording& recording) {
  constexpr int kFarthest = 10;
  constexpr std::ptrdiff_t kMostRows = 1000;
  std::vector<int> shifts;
  for (int shift = 1; shift <= kFarthest; ++shift) {
    shifts.push_back(shift);
    shifts.push_back(-shift);
  }
  const auto more = static_cast<std::ptrdiff_t>(recording.pose_count()) -
                    static_cast<std::ptrdiff_t>(recording.scan_file_count());
  if (more > kFarthest && more < kMostRows) shifts.push_back(static_cast<int>(more));
  return shifts;
}

}  // namespace

std::optional<LostScans> find_lost_scans(const Recording& recording,
                                         const std::vector<RegisteredMotion>& motions,
                                         double exact) {
  constexpr std::size_t kFewestChains = 2;   // on both sides
  constexpr std::size_t kFewestMotions = 4;  // on both sides
  const std::vector<ChainErrors> given = errors_by_chain(recording, motions, 0);
  std::optional<LostScans> best;
  double least = sum(joined(given, 0, given.size()));
  for (const int shift : shifts_of(recording)) {
    const std::vector<ChainErrors> shifted = errors_by_chain(recording, motions, shift);
    for (std::size_t c = kFewestChains; c + kFewestChains <= given.size(); ++c) {
      const std::vector<double> before = joined(given, 0, c);
      const std::vector<double> behind = joined(shifted, c, given.size());
      const std::vector<double> wrong = joined(given, c, given.size());
      const double total = sum(before) + sum(behind);
      if (!(total < least) || before.size() < kFewestMotions || behind.size() < kFewestMotions) {
        continue;
      }
      const bool is_explained = median(wrong) > exact && median(before) < exact &&
                                median(behind) < 0.5 * median(wrong) &&
                                sum(before) < sum(joined(shifted, 0, c));
      if (!is_explained) continue;
      least = total;
      best = LostScans{given[c - 1].first_scan, given[c].first_scan, shift};
    }
  }
  return best;
}

}  // namespace dynains
