#include "pose_proof.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "agreement_sum.hpp"
#include "given_motion.hpp"
#include "in_two_threads.hpp"
#include "io/finite_points.hpp"
#include "landmarks.hpp"
#include "merged_scans.hpp"

namespace dynains {
namespace {

constexpr std::size_t kSteps = 5;     // scans
constexpr double kLongWay = 4.0;      // m; scans farther apart see other surfaces
constexpr double kProofLever = 10.0;  // m

double proof_extent(const Pose& T) { return extent_of(T, kProofLever); }

/// Scans at which a tested motion may begin, and their distance to its end.
struct Starts {
  std::size_t first;
  std::size_t last;
  std::size_t step;
};

/// Empty if there are too few scans.
std::optional<Starts> starts_between(const Recording& recording, std::size_t first,
                                     std::size_t last, std::size_t merged) {
  const std::size_t count = last - first + 1;
  if (count < 2 * merged) return std::nullopt;
  const double way = motion_between(recording, first, last).translation().norm() /
                     static_cast<double>(std::max<std::size_t>(1, last - first));
  std::size_t step = kSteps;
  while (step > 1 && way * static_cast<double>(step) > kLongWay) --step;
  step = std::min(step + merged - 1, count - 2 * merged + 1);
  return Starts{first + merged - 1, last + 1 - merged - step, step};
}

/// The start with the largest `score`.
std::size_t best_start(const Starts& starts, const std::function<double(std::size_t)>& score) {
  constexpr std::size_t kMost = 400;  // starts that are looked at
  const std::size_t stride = 1 + (starts.last - starts.first) / kMost;
  std::size_t best = starts.first;
  double most = -1.0;
  for (std::size_t i = starts.first; i <= starts.last; i += stride) {
    const double value = score(i);
    if (!(value > most)) continue;
    best = i;
    most = value;
  }
  return best;
}

/// Where a mistake would show best.
std::vector<std::size_t> telling_starts(const Recording& recording, const Starts& starts) {
  const std::size_t step = starts.step;
  const auto motion = [&](std::size_t i) { return motion_between(recording, i, i + step); };
  std::vector<std::size_t> result = {
      best_start(starts, [&](std::size_t i) { return angle_of(motion(i).linear()); }),
      best_start(starts,
                 [&](std::size_t i) {
                   if (i < starts.first + step) return 0.0;
                   return proof_extent(motion(i - step).inverse() * motion(i));
                 }),
      best_start(starts, [&](std::size_t i) { return motion(i).translation().norm(); })};
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

/// From the first to the last one; the middle one if `count` is 1.
std::vector<std::size_t> even_starts(const Starts& starts, std::size_t count) {
  std::vector<std::size_t> result;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t way = starts.last - starts.first;
    const std::size_t i = starts.first + (count == 1 ? way / 2 : k * way / (count - 1));
    if (result.empty() || i > result.back()) result.push_back(i);
  }
  return result;
}

/// A place of the comparison: consecutive scans, and as many some scans later.
struct Place {
  std::vector<std::size_t> scans_a, scans_b;
  std::vector<Landmarks> a, b;
};

std::vector<Landmarks> landmarks_of(const Recording& recording,
                                    const std::vector<std::size_t>& scans,
                                    const Mounting& mounting) {
  std::vector<Landmarks> result;
  result.reserve(scans.size());
  for (const std::size_t i : scans) {
    result.emplace_back(finite_points(recording.read_scan(i)), mounting);
  }
  return result;
}

using PoseOfScan = std::function<std::optional<Pose>(std::size_t)>;

/// `most`: compared points, about.
Agreement agreement_at(const Place& place, const PoseOfScan& pose_of, std::size_t most) {
  constexpr double kMostGap = 0.3;  // m
  std::size_t points = 0;
  for (const Landmarks& b : place.b) points += b.size();
  const std::size_t stride = 1 + points / most;
  Agreement sum{0.0, 0.0, 0};
  for (std::size_t k = 0; k < place.b.size(); ++k) {
    const auto T_world_b = pose_of(place.scans_b[k]);
    if (!T_world_b) continue;
    std::vector<Pose> T_a_b;
    for (const std::size_t a : place.scans_a) {
      const auto T_world_a = pose_of(a);
      if (T_world_a) T_a_b.push_back(T_world_a->inverse() * *T_world_b);
    }
    if (T_a_b.size() != place.a.size()) continue;
    for (std::size_t i = 0; i < place.b[k].size(); i += stride) {
      double gap = 1.0;
      for (std::size_t a = 0; a < place.a.size(); ++a) {
        gap = std::min(gap, place.a[a].distance_to(T_a_b[a] * place.b[k].points()[i]));
      }
      sum.share += gap < kMostGap ? 1.0 : 0.0;
      sum.gap += gap;
      ++sum.points;
    }
  }
  if (sum.points == 0) return {};
  const auto count = static_cast<double>(sum.points);
  return {sum.share / count, sum.gap / count, sum.points};
}

Agreement agreement_of(const std::vector<Place>& places, const PoseOfScan& pose_of,
                       std::size_t most = 600) {
  AgreementSum sum;
  for (const Place& place : places) sum.add(agreement_at(place, pose_of, most));
  return sum.mean();
}

PoseOfScan poses_under(const Recording& recording, const PoseConvention& convention) {
  return [&recording, convention](std::size_t i) { return recording.pose_under(convention, i); };
}

/// Largest difference of motions under a reading and as given, at points 10 m away.
double difference_from_given(const std::vector<Place>& places, const Recording& recording,
                             const PoseConvention& convention) {
  double most = 0.0;
  for (const Place& place : places) {
    const auto T_world_a = recording.pose_under(convention, place.scans_a.back());
    const auto T_world_b = recording.pose_under(convention, place.scans_b.front());
    if (!T_world_a || !T_world_b) continue;
    const Pose given = motion_between(recording, place.scans_a.back(), place.scans_b.front());
    most = std::max(most, proof_extent(given.inverse() * T_world_a->inverse() * *T_world_b));
  }
  return most;
}

}  // namespace

GivenMotions register_given(const Recording& recording, std::size_t first, std::size_t last,
                            std::size_t neighbours) {
  GivenMotions motions;
  const std::size_t merged = scans_to_merge(recording);
  const auto starts = starts_between(recording, first, last, merged);
  if (!starts) return motions;
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const std::size_t i : telling_starts(recording, *starts)) {
    pairs.emplace_back(i, i + starts->step);
  }
  for (const std::size_t i : even_starts(*starts, neighbours)) {
    const std::pair pair(i, i + 1);
    if (std::find(pairs.begin(), pairs.end(), pair) == pairs.end()) pairs.push_back(pair);
  }
  motions.tested = pairs.size();
  const auto registered = in_two_threads(pairs.size(), [&](std::size_t pair) {
    const auto [i, k] = pairs[pair];
    const PointBuffer a = merged_scans(recording, i, i + 1 - merged, i);
    const PointBuffer b = merged_scans(recording, k, k, k + merged - 1);
    return register_from(a, b, motion_between(recording, i, k), i, k);
  });
  for (const auto& motion : registered) {
    if (motion) motions.certain.push_back(*motion);
  }
  return motions;
}

bool agrees_best(const Recording& recording, const std::vector<PoseReading>& readings,
                 const Mounting& mounting) {
  constexpr std::size_t kEvenPlaces = 4;
  constexpr double kDistinct = 0.1;  // m at points 10 m away
  constexpr double kClearly = 0.02;  // share of a gap
  constexpr std::size_t kPointsAtFirst = 75;
  const std::size_t merged = scans_to_merge(recording);
  if (recording.size() < 2) return false;
  const auto starts = starts_between(recording, 0, recording.size() - 1, merged);
  if (!starts) return false;
  std::vector<std::size_t> begins = telling_starts(recording, *starts);
  for (const std::size_t i : even_starts(*starts, kEvenPlaces)) begins.push_back(i);
  const auto places = in_two_threads(begins.size(), [&](std::size_t number) {
    const std::size_t i = begins[number];
    Place place;
    for (std::size_t k = 0; k < merged; ++k) {
      place.scans_a.push_back(i + 1 - merged + k);
      place.scans_b.push_back(i + starts->step + k);
    }
    place.a = landmarks_of(recording, place.scans_a, mounting);
    place.b = landmarks_of(recording, place.scans_b, mounting);
    return place;
  });
  const Agreement given = agreement_of(places, poses_under(recording, recording.convention()));
  const Agreement standing =
      agreement_of(places, [](std::size_t) { return std::optional<Pose>(Pose::Identity()); });
  if (given.points < 200 || !fits(given, standing) || given.gap > standing.gap) return false;
  const auto are_worse = in_two_threads(readings.size(), [&](std::size_t i) {
    const PoseConvention& convention = readings[i].convention;
    if (difference_from_given(places, recording, convention) < kDistinct) return true;
    const PoseOfScan pose_of = poses_under(recording, convention);
    return agreement_of(places, pose_of, kPointsAtFirst).gap > kHopeless * given.gap ||
           agreement_of(places, pose_of).gap > (1.0 - kClearly) * given.gap;
  });
  return std::find(are_worse.begin(), are_worse.end(), false) == are_worse.end();
}

}  // namespace dynains
