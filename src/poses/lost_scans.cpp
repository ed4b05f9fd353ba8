#include "lost_scans.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "dynains/median.hpp"
#include "landmarks.hpp"

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

/// The scan behind `from` with which it is compared: a few metres away, so that all scans of a long
/// recording are covered, or the last one.
std::size_t next_compared(const Recording& recording, std::size_t from) {
  constexpr double kWay = 4.0;  // m
  constexpr std::size_t kMost = 10;
  const Eigen::Vector3d& start = recording.T_world_sensor(from).translation();
  std::size_t to = from + 1;
  while (to + 1 < recording.size() && to < from + kMost &&
         (recording.T_world_sensor(to + 1).translation() - start).norm() < kWay) {
    ++to;
  }
  return to;
}

struct PlacedLandmarks {
  std::size_t scan;
  const Landmarks& landmarks;
};

/// Rows by which the pose of the later scan is too early, and the gap that the right one saves, m.
struct ShiftGain {
  int shift = 0;
  double gain = 0.0;
};

ShiftGain best_later_rows(const Recording& recording, const PlacedLandmarks& a,
                          const PlacedLandmarks& b) {
  constexpr std::size_t kMost = 10;
  constexpr std::size_t kFewestPoints = 200;
  const Pose T_a_world = recording.T_world_sensor(a.scan).inverse();
  const auto compare = [&](const Pose& T_world_b) {
    return a.landmarks.compare(b.landmarks, T_a_world * T_world_b);
  };
  const Agreement given = compare(recording.T_world_sensor(b.scan));
  ShiftGain best;
  if (given.points < kFewestPoints) return best;
  const std::size_t more = recording.pose_count() - recording.scan_file_count();
  PoseConvention convention = recording.convention();
  for (std::size_t shift = 1; shift <= std::min(kMost, more); ++shift) {
    ++convention.shift;
    const auto T_world_b = recording.pose_under(convention, b.scan);
    if (!T_world_b) break;
    const Agreement shifted = compare(*T_world_b);
    const double gain = given.gap - shifted.gap;
    if (is_clearly_better(shifted, given) && gain > best.gain) {
      best = {static_cast<int>(shift), gain};
    }
  }
  return best;
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

bool may_have_lost_clouds(const Recording& recording) {
  const std::size_t rows = recording.pose_count(), scans = recording.scan_file_count();
  return recording.frame() == PointFrame::kSensor && recording.missing_pose_count() == 0 &&
         scans < rows && 2 * rows <= 3 * scans;
}

std::optional<LostScans> find_lost_clouds(const Recording& recording) {
  if (!may_have_lost_clouds(recording) || recording.size() < 2) return std::nullopt;
  std::optional<LostScans> found;
  double largest_gain = 0.0;
  std::size_t pairs = 0, doubtful = 0;
  RecordedScan scan;
  Landmarks a = landmarks_of(recording, 0, scan);
  for (std::size_t from = 0; from + 1 < recording.size(); ++pairs) {
    const std::size_t to = next_compared(recording, from);
    Landmarks b = landmarks_of(recording, to, scan);
    const ShiftGain best = best_later_rows(recording, {from, a}, {to, b});
    doubtful += best.shift > 0 ? 1 : 0;
    if (best.gain > largest_gain) {
      largest_gain = best.gain;
      found = LostScans{from, to, best.shift};
    }
    from = to;
    a = std::move(b);
  }
  // Poses that are wrong everywhere are no sign of lost clouds.
  return 4 * doubtful <= pairs ? found : std::nullopt;
}

}  // namespace dynains
