#include "dynains/poses/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/median.hpp"
#include "dynains/surfaces/landmarks.hpp"
#include "dynains/surfaces/scan_registration.hpp"
#include "dynains/surfaces/surface_grid.hpp"
#include "dynains/threads/in_two_threads.hpp"
#include "io/points/finite_points.hpp"
#include "pose_fit.hpp"

namespace dynains {
namespace {

constexpr double kMinAgreement = 0.5;      // share; wrong poses of a moving sensor stay below it
constexpr std::size_t kMinCompared = 200;  // compared points of a sample
constexpr std::size_t kMinPairs = 3;       // of neighbours, for a statement about their error
constexpr std::size_t kPairs = 8;          // of a sample
constexpr double kRough = 0.4;             // m at points 10 m away; more is not inexact but wrong
constexpr double kInexact =
    0.05;  // m, from one scan to the next, of places and at points 10 m away
constexpr double kNever = std::numeric_limits<double>::infinity();

/// Whether the gap of `a` is clearly smaller than that of `b`.
bool is_clearly_better(const Agreement& a, const Agreement& b) {
  return a.gap < 0.85 * b.gap - 0.01;
}

/// Two scans, some scans apart.
struct Pair {
  std::size_t first;
  std::size_t second;
  const Landmarks& a;
  const Landmarks& b;
};

/// Scans that are compared, each of which is read once. They are described, too.
class ScanSample {
 public:
  explicit ScanSample(const Recording& recording) : recording_(recording) {}

  /// At most `most` evenly spread pairs (i, i + stride) of the scans `first` to `last` that have
  /// enough landmarks; they live as long as this. Throws IoError.
  std::vector<Pair> pairs(std::size_t first, std::size_t last, std::size_t stride,
                          std::size_t most) {
    const std::size_t starts = last - first + 1 - stride;
    const std::size_t count = std::min(most, starts);
    std::vector<std::size_t> scans;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t at = first + (count == 1 ? 0 : k * (starts - 1) / (count - 1));
      scans.insert(scans.end(), {at, at + stride});
    }
    read(scans);
    std::vector<Pair> pairs;
    for (std::size_t k = 0; k < scans.size(); k += 2) {
      const Landmarks &a = scans_.at(scans[k]).landmarks, &b = scans_.at(scans[k + 1]).landmarks;
      if (std::min(a.size(), b.size()) < kMinLandmarks) continue;
      pairs.push_back({scans[k], scans[k + 1], a, b});
    }
    return pairs;
  }

  /// Reads those of `scans` that were not read yet.
  void read(const std::vector<std::size_t>& scans) {
    std::vector<std::size_t> missing;
    for (const std::size_t i : scans) {
      if (scans_.count(i) == 0) missing.push_back(i);
    }
    std::sort(missing.begin(), missing.end());
    missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
    std::vector<Scan> read =
        in_two_threads(missing.size(), [&](std::size_t k) { return Scan(recording_, missing[k]); });
    for (std::size_t k = 0; k < read.size(); ++k) scans_.emplace(missing[k], std::move(read[k]));
  }

  /// Sets the members of `d` that describe points and mounting.
  void describe(Diagnosis& d) const {
    std::size_t size = 0, all = 0, valid = 0, near = 0;  // points
    std::vector<double> ranges, heights;
    Eigen::Vector3d up = Eigen::Vector3d::Zero();
    for (const auto& [i, scan] : scans_) {
      size += scan.size;
      all += scan.all;
      valid += scan.valid;
      near += scan.near;
      ranges.insert(ranges.end(), scan.ranges.begin(), scan.ranges.end());
      if (!scan.mounting.known) continue;
      heights.push_back(scan.mounting.height);
      up += scan.mounting.up_sensor;
    }
    if (!scans_.empty()) d.points = static_cast<double>(size) / static_cast<double>(scans_.size());
    if (all > 0) d.invalid_share = static_cast<double>(all - valid) / static_cast<double>(all);
    if (valid > 0) d.ego_share = static_cast<double>(near) / static_cast<double>(valid);
    if (!ranges.empty()) {
      const auto at = ranges.begin() + static_cast<std::ptrdiff_t>(99 * (ranges.size() - 1) / 100);
      std::nth_element(ranges.begin(), at, ranges.end());
      d.farthest = *at;
    }
    if (2 * heights.size() > scans_.size()) d.mounting = {median(heights), up.normalized(), true};
  }

 private:
  struct Scan {
    std::size_t size = 0;  // points
    std::size_t all = 0;   // sampled
    std::size_t valid = 0;
    std::size_t near = 0;
    std::vector<double> ranges;  // m, of some points
    Mounting mounting;
    Landmarks landmarks;

    Scan(const Recording& recording, std::size_t i) : Scan(recording.read_scan(i)) {}

   private:
    explicit Scan(const RecordedScan& scan) : Scan(sampled_points(scan)) {
      size = scan.size();
      all = (size + sample_step(scan) - 1) / sample_step(scan);
    }
    explicit Scan(const PointBuffer& points)
        : valid(points.size()), mounting(estimate_mounting(points)), landmarks(points, mounting) {
      for (std::size_t k = 0; k < points.size(); ++k) {
        const float x = points.x[k], y = points.y[k], z = points.z[k];
        const double range = std::sqrt(x * x + (y * y + z * z));
        if (range < kMinPoint) ++near;
        if (k % 37 == 0) ranges.push_back(range);
      }
    }
  };

  const Recording& recording_;
  std::map<std::size_t, Scan> scans_;
};

using Pairs = std::vector<Pair>;

Agreement agreement_under(const BodyMotion& motion, const Pairs& pairs) {
  Agreement mean{0.0, 0.0, 0};  // weighted by points
  for (const Pair& pair : pairs) {
    const auto T_a_b = motion(pair.first, pair.second);
    if (!T_a_b) continue;
    const Agreement one = pair.a.compare(pair.b, *T_a_b);
    const auto points = static_cast<double>(one.points);
    mean.share += points * one.share;
    mean.gap += points * one.gap;
    mean.points += one.points;
  }
  if (mean.points == 0) return {};
  const auto points = static_cast<double>(mean.points);
  return {mean.share / points, mean.gap / points, mean.points};
}

std::optional<Pose> no_motion(std::size_t /*first*/, std::size_t /*second*/) {
  return Pose::Identity();
}

/// The turns of a motion without its ways.
BodyMotion turns_of(const BodyMotion& motion) {
  return [motion](std::size_t first, std::size_t second) {
    auto T = motion(first, second);
    if (T) T->translation().setZero();
    return T;
  };
}

struct SampledPairs {
  Pairs pairs;  // (i, i + stride)
  std::size_t stride = 0;
  Agreement neighbours;  // without motion
};

/// Pairs of neighbours if these do not agree without motion, or if the sensor moves or turns so
/// fast that scans farther apart see other places. Else the stride increases until pairs do not
/// agree: scans farther apart show more of the motion of a slow sensor.
SampledPairs sample_pairs(const Recording& recording, ScanSample& sample, double extent,
                          std::size_t most) {
  constexpr std::size_t kStride = 5;       // scans
  constexpr double kFast = 2.0;            // m from scan to scan, at points 10 m away
  constexpr double kFastAgreement = 0.35;  // of neighbours
  const std::size_t scans = recording.size();
  if (scans < 2) return {};
  SampledPairs result{sample.pairs(0, scans - 1, 1, most), 1, {}};
  result.neighbours = agreement_under(no_motion, result.pairs);
  if (extent > kFast || scans < 2 * kStride || result.neighbours.share < kFastAgreement) {
    return result;
  }
  for (std::size_t stride = kStride; stride <= 16 * kStride && 2 * stride <= scans; stride *= 4) {
    result = {sample.pairs(0, scans - 1, stride, most), stride, result.neighbours};
    if (agreement_under(no_motion, result.pairs).share < kMinAgreement) break;
  }
  return result;
}

/// Sets the members of `d` that describe the motion. Returns its median extent from scan to scan,
/// m.
double describe_motion(const Recording& recording, Diagnosis& d) {
  std::vector<double> periods, steps, extents;
  for (std::size_t i = 1; i < recording.size(); ++i) {
    const Pose T = motion_between(recording, i - 1, i);
    periods.push_back(recording.time(i) - recording.time(i - 1));
    steps.push_back(T.translation().norm());
    extents.push_back(extent_of(T));
  }
  if (!steps.empty()) d.longest_step = *std::max_element(steps.begin(), steps.end());
  d.period = median(std::move(periods));
  d.step = median(std::move(steps));
  return median(std::move(extents));
}

/// PoseFlaws::period, by scans in the middle of the recording.
std::size_t period_of_views(const Recording& recording, ScanSample& sample) {
  constexpr std::size_t kMaxPeriod = 80;
  const std::size_t last_period = std::min(kMaxPeriod, recording.size() / 2);
  const std::size_t first = (recording.size() - 2 * last_period) / 2;
  Agreement neighbours;
  for (std::size_t period = 1; period < last_period; ++period) {
    const Pairs pairs = sample.pairs(first, first + last_period + period, period, kPairs);
    const Agreement given = agreement_under(given_motion(recording), pairs);
    const Agreement standing = agreement_under(no_motion, pairs);
    const Agreement& best = is_clearly_better(standing, given) ? standing : given;
    if (period == 1) neighbours = best;
    if (best.share > 2.0 * neighbours.share && is_clearly_better(best, neighbours)) return period;
  }
  return 0;
}

bool have_equal_orientations(const Recording& recording) {
  for (std::size_t i = 1; i < recording.size(); ++i) {
    const Pose T = motion_between(recording, 0, i);
    if (!T.linear().isIdentity(1e-9)) return false;
  }
  return true;
}

/// Whether poses and scans do not move alike at a fourth of the pairs between which one of them
/// moves, as with poses that stand, those of another recording, or points of the world.
bool miss_motion(const std::vector<RegisteredMotion>& motions, const BodyMotion& given) {
  constexpr double kMaxRatio = 0.7;  // ratio
  std::size_t moving = 0, missed = 0;
  for (const RegisteredMotion& motion : motions) {
    const auto T = given(motion.first, motion.second);
    if (!T) continue;
    const double by_poses = extent_of(*T);
    const double by_scans = extent_of(motion.T_first_second);
    if (!(std::max(by_poses, by_scans) > kAgreeing)) continue;
    ++moving;
    missed += error_at_points({motion}, given) > kMaxRatio * std::min(by_poses, by_scans) ? 1 : 0;
  }
  return 4 * missed > moving;
}

/// Whether there are enough motions for a decision, `steps` of neighbours.
bool are_enough(const std::vector<RegisteredMotion>& motions, std::size_t steps) {
  const auto is_step = [](const RegisteredMotion& m) { return m.second == m.first + 1; };
  return motions.size() >= kMinMotions &&
         std::count_if(motions.begin(), motions.end(), is_step) >= std::ptrdiff_t(steps);
}

/// Adds the error of clouds of more than a turn to that of their registrations. From cloud to cloud
/// most points come a whole turn later, which is shorter than the time between the clouds by the
/// overlap; within the overlap they come two turns later. Each shifts the motion by the overlap.
/// Returns whether there is one.
bool add_overlap(const Recording& recording, std::vector<RegisteredMotion>& motions) {
  const double overlap = overlap_of_turns(recording, 0, recording.size() - 1);
  for (RegisteredMotion& motion : motions) {
    motion.deviation = std::max(motion.deviation, 2.0 * overlap * extent_of(motion.T_first_second));
  }
  return overlap > 0.0;
}

/// What scans show: landmarks of pairs, and registered motions.
struct Evidence {
  const Recording& recording;
  Pairs pairs;
  std::vector<RegisteredMotion> motions;
  Agreement as_given, standing;
  bool overlaps = false;  ///< whether clouds are more than a turn

  /// The pairs and motions for which `motion` has poses. Shifted poses are missing for scans at one
  /// end of the recording.
  Evidence where_known(const BodyMotion& motion) const {
    Evidence known{recording, {}, {}, as_given, standing, overlaps};
    for (const Pair& pair : pairs) {
      if (motion(pair.first, pair.second)) known.pairs.push_back(pair);
    }
    for (const RegisteredMotion& one : motions) {
      if (motion(one.first, one.second)) known.motions.push_back(one);
    }
    if (known.pairs.size() < pairs.size()) {
      known.as_given = agreement_under(given_motion(recording), known.pairs);
    }
    return known;
  }
  /// The misfit (m) of a reading, by registered motions. Infinite if it explains no more than no
  /// motion, or too few of the motions, if a mirror explains no more than a drift of the given
  /// poses, its unit or scale no more than turns alone, or if landmarks meet better under the given
  /// poses.
  double misfit_of(const Reading& reading) const {
    const PoseConvention &given = recording.options().convention, &other = reading.convention;
    const bool mirrors = other.left_handed != given.left_handed;
    const bool changes_ways = other.unit != given.unit || other.scale != given.scale;
    const BodyMotion motion = motion_under(recording, reading);
    const Evidence known = where_known(motion);
    const double error = error_at_points(known.motions, motion);
    const auto is_better_than = [&](const BodyMotion& simpler) {
      return is_much_smaller(error, error_at_points(known.motions, simpler));
    };
    const bool is_explained =
        2 * known.motions.size() > motions.size() &&
        error < std::min(kRough, 0.5 * error_at_points(known.motions, no_motion)) &&
        !miss_motion(known.motions, motion) &&
        (!mirrors || is_better_than(with_drift(given_motion(recording), known.motions))) &&
        (!changes_ways || is_better_than(turns_of(motion)));
    const bool is_as_good = agreement_under(motion, known.pairs).gap <= known.as_given.gap;
    return is_explained && is_as_good ? error : kNever;
  }
};

/// The reading with the least misfit; a more complex one must be clearly better. Empty if none is
/// clearly better than the given one, whose misfit is `as_given`.
std::optional<Reading> best_reading(const Evidence& evidence, const std::vector<Reading>& readings,
                                    double as_given) {
  const std::vector<double> misfits = in_two_threads(
      readings.size(), [&](std::size_t i) { return evidence.misfit_of(readings[i]); });
  std::optional<Reading> best;
  double least = as_given;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const bool is_as_simple = best && best->complexity == readings[i].complexity;
    if (!(is_as_simple ? misfits[i] < least : is_much_smaller(misfits[i], least))) continue;
    best = readings[i];
    least = misfits[i];
  }
  return best;
}

/// `share`: of kExact that is allowed.
bool is_exact(const MotionError& error, double share = 1.0) {
  return error.at_points < std::max(share * kExact, 2.0 * error.noise);
}

/// How much registrations may err by the motion within scans (the translation in m, the rotation in
/// rad): medians over scans. De-skewing takes the motion as even between two poses. If a sensor
/// sways, the middle of a scan is off by an eighth of the change of motion, and that of the next
/// scan by as much to the other side.
std::pair<double, double> error_within_scans(const Recording& recording) {
  constexpr double kUneven = 0.25;
  std::vector<double> translations, rotations;
  for (std::size_t i = 1; i + 1 < recording.size(); ++i) {
    const Pose change =
        motion_between(recording, i - 1, i).inverse() * motion_between(recording, i, i + 1);
    translations.push_back(kUneven * change.translation().norm());
    rotations.push_back(kUneven * angle_of(change.linear()));
  }
  return {median(std::move(translations)), median(std::move(rotations))};
}

/// Sets the errors of the poses in `d`, over the least number of scans over which they are inexact,
/// or else from one scan to the next. Returns whether they are inexact: small errors add up, while
/// those of single scans do not grow with the scans between. Smaller ones count if they grow.
/// Motions by other ways must show them, too: where persons cover the surfaces, or these leave a
/// direction open, both directions of one registration agree about what the next one contradicts.
/// Errors that agree within a third of the other one are three quarters of the first at least.
bool measure_errors(const Evidence& evidence, Diagnosis& d) {
  constexpr double kGrowing = 2.5;      // ratio of errors over three scans or more and over one
  constexpr double kConfirming = 0.75;  // ratio to the least errors
  const Recording& recording = evidence.recording;
  const auto within = error_within_scans(recording);
  double translation = kInexact, rotation = kInexact / kLever;  // least
  for (std::size_t gap = 1; gap <= kMaxSpan; gap *= 3) {
    const auto error_of = [&](const std::vector<RegisteredMotion>& motions) {
      return motion_error(motions, given_motion(recording), Pose::Identity(), gap);
    };
    const auto is_inexact = [&](const MotionError& error, double share) {
      const double least_translation = std::max(share * translation, within.first);
      const double least_rotation = std::max(share * rotation, within.second);
      return error.pairs >= kMinPairs && !is_exact(error, share) &&
             (error.translation > std::max(least_translation, 3.0 * error.translation_noise) ||
              error.rotation > std::max(least_rotation, 3.0 * error.rotation_noise));
    };
    const MotionError error = error_of(evidence.motions);
    if (error.pairs < kMinPairs) break;
    const bool is_found =
        is_inexact(error, 1.0) &&
        is_inexact(error_of(by_other_ways(recording, evidence.motions, gap)), kConfirming);
    if (gap > 1 && !is_found) continue;
    translation = std::max(kExact, kGrowing * error.translation);
    rotation = std::max(kExact / kLever, kGrowing * error.rotation);
    d.translation_error = error.translation;
    d.rotation_error = error.rotation;
    d.registered_pairs = error.pairs;
    d.error_span = gap;
    if (is_found) return true;
  }
  return false;
}

/// Whether most of the pairs for which another motion is found (none, or that of a registration
/// from the given one) fit clearly better to the surfaces of each other under it. Motions along
/// surfaces fit equally well.
bool are_refuted(const Evidence& evidence) {
  constexpr double kClearly = 0.6;  // ratio
  constexpr double kMinFit = 0.3;
  const BodyMotion given = given_motion(evidence.recording);
  std::size_t refuted = 0;
  for (const Pair& pair : evidence.pairs) {
    const auto T_given = given(pair.first, pair.second);
    if (!T_given) continue;
    const auto fit_under = [&](const Pose& T) {
      return fit_of(pair.a.surfaces(), pair.b.points(), T);
    };
    double best = fit_under(Pose::Identity());
    const auto found =
        register_scans(pair.a.surfaces(), pair.b.points(), {*T_given, Pose::Identity()});
    if (found) best = std::max(best, fit_under(found->T_a_b));
    refuted += best > kMinFit && fit_under(*T_given) < kClearly * best ? 1 : 0;
  }
  return 2 * refuted > evidence.pairs.size();
}

/// By landmarks alone. Low shares may be due to a sparse pattern, or to a crowd.
PoseVerdict verdict_of_agreement(const Evidence& evidence) {
  const Agreement &given = evidence.as_given, &standing = evidence.standing;
  const bool is_doubtful = given.share < kMinAgreement || is_clearly_better(standing, given);
  if (is_doubtful && are_refuted(evidence)) return PoseVerdict::kDisagree;
  return is_clearly_better(given, standing) ? PoseVerdict::kAgree : PoseVerdict::kNoMotion;
}

void judge_by_motions(const Evidence& evidence, Diagnosis& d) {
  const Recording& recording = evidence.recording;
  const std::vector<RegisteredMotion>& motions = evidence.motions;
  const BodyMotion given = given_motion(recording);
  const MotionError all = motion_error(motions, given);
  const bool are_inexact = measure_errors(evidence, d);
  d.flaws.has_equal_orientations = !is_exact(all) && have_equal_orientations(recording);
  // Overlaps shift motions. This does not prove another reading, but a fit would explain it by one.
  const bool may_differ = evidence.overlaps ? !is_exact(all) : all.at_points > kExact;
  if (may_differ && !d.flaws.has_equal_orientations) {
    std::vector<Reading> readings = usual_readings(recording);
    if (!is_exact(all) && !evidence.overlaps) {
      for (const Reading& fitted : fitted_readings(recording, motions)) readings.push_back(fitted);
    }
    const auto reading = best_reading(evidence, readings, all.at_points);
    if (reading) {
      d.verdict = PoseVerdict::kOtherwise;
      d.proposal.convention = reading->convention;
      d.proposal.time_offset = reading->time_offset;
      return;
    }
  }
  d.verdict = verdict_of_agreement(evidence);
  const auto are_wrong = [&](const std::vector<RegisteredMotion>& some) {
    return some.size() >= kMinPairs &&
           (error_at_points(some, given) > kRough || miss_motion(some, given));
  };
  // Traffic on both lanes of a tunnel moves registrations, now forwards and now backwards.
  if (are_wrong(motions) &&
      (d.verdict == PoseVerdict::kDisagree || are_wrong(by_other_ways(recording, motions, 1)))) {
    d.verdict = PoseVerdict::kDisagree;
  } else if (are_inexact || (d.verdict == PoseVerdict::kDisagree && !is_exact(all))) {
    d.verdict = PoseVerdict::kInexact;
  } else if (d.verdict == PoseVerdict::kDisagree ||
             is_much_smaller(all.at_points, error_at_points(motions, no_motion))) {
    d.verdict = PoseVerdict::kAgree;
  }
  const bool is_uncertain = d.translation_error > kInexact ||
                            kLever * d.rotation_error > kInexact;  // as their noise is large, too
  if (d.verdict != PoseVerdict::kInexact && d.verdict != PoseVerdict::kDisagree && is_uncertain) {
    d.registered_pairs = 0;
  }
}

/// The diagnosis under the options that `recording` has.
Diagnosis diagnose_as_opened(const Recording& recording, std::size_t pairs) {
  Diagnosis d;
  d.scan_files = recording.scan_file_count();
  d.pose_rows = recording.trajectory().poses.size();
  d.scans = recording.size();
  d.proposal = recording.options();
  const double extent = describe_motion(recording, d);
  // Poses that are exact nearly everywhere need no further places.
  const BodyMotion given = given_motion(recording);
  const auto are_exact = [&](const std::vector<RegisteredMotion>& motions) {
    std::map<std::size_t, std::pair<std::size_t, std::size_t>> counts;  // inexact and all, by gap
    for (const RegisteredMotion& one : motions) {
      auto& [inexact, all] = counts[one.second - one.first];
      inexact += error_at_points({one}, given) >= kExact ? 1 : 0;
      ++all;
    }
    return are_enough(motions, pairs) &&
           std::all_of(counts.begin(), counts.end(), [](const auto& of_gap) {
             return 4 * of_gap.second.first <= of_gap.second.second;
           });
  };
  const bool is_world = recording.frame() == PointFrame::kWorld;
  std::vector<RegisteredMotion> motions;
  if (!is_world) motions = register_motions(recording, are_exact);
  ScanSample sample(recording);
  const SampledPairs sampled =
      sample_pairs(recording, sample, extent, are_exact(motions) ? pairs : kPairs);
  if (recording.size() == 1) sample.read({0});
  sample.describe(d);
  d.stride = sampled.stride;
  d.as_given = agreement_under(given, sampled.pairs);
  d.standing = agreement_under(no_motion, sampled.pairs);
  if (d.as_given.points < kMinCompared) return d;
  const bool overlaps = !motions.empty() && !are_exact(motions) && add_overlap(recording, motions);
  const Evidence evidence{recording,  sampled.pairs, std::move(motions),
                          d.as_given, d.standing,    overlaps};
  if (is_world) {
    constexpr double kTellingWay = 5.0;  // m
    d.verdict = follow_sensor(recording, kTellingWay).value_or(true)
                    ? verdict_of_agreement(evidence)
                    : PoseVerdict::kDisagree;
    return d;
  }
  if (are_enough(evidence.motions, kMinPairs)) {
    judge_by_motions(evidence, d);
  } else {
    d.verdict = verdict_of_agreement(evidence);
  }
  const bool is_apart = std::max(evidence.as_given.share, evidence.standing.share) < kMinAgreement;
  if (d.verdict == PoseVerdict::kDisagree || (d.verdict == PoseVerdict::kNoMotion && is_apart)) {
    d.flaws.period = period_of_views(recording, sample);
    if (d.flaws.period > 0) d.verdict = PoseVerdict::kDisagree;
  }
  return d;
}

/// Whether the scans leave less than half of the error of the given motion in `d`.
bool halves_error(const Recording& recording, const Diagnosis& d) {
  const auto suffice = [](const auto& motions) { return are_enough(motions, kMinPairs); };
  const std::vector<RegisteredMotion> motions = register_motions(recording, suffice);
  const MotionError steps = motion_error(motions, given_motion(recording), Pose::Identity(), 1);
  return suffice(motions) && std::hypot(steps.translation, kLever * steps.rotation) <
                                 0.5 * std::hypot(d.translation_error, kLever * d.rotation_error);
}

}  // namespace

Diagnosis diagnose(const Recording& recording, std::size_t pairs) {
  Diagnosis d = diagnose_as_opened(recording, pairs);
  const auto ray_origin = other_ray_origin(recording);
  const bool agrees =
      (d.verdict == PoseVerdict::kAgree || d.verdict == PoseVerdict::kNoMotion) && !ray_origin;
  if (agrees && (!recording.columns().time || recording.is_deskewed())) return d;
  for (const RecordingOptions& options : other_options(recording, ray_origin)) {
    if (agrees && !options.deskew) continue;
    try {
      const Recording other(recording.folder(), options);
      if (agrees && !halves_error(other, d)) continue;
      const PoseVerdict verdict = diagnose_as_opened(other, pairs).verdict;
      const bool is_seen = ray_origin && verdict == PoseVerdict::kNoMotion;  // whatever poses mean
      if (verdict != PoseVerdict::kAgree && !is_seen) continue;
    } catch (const IoError&) {
      continue;  // it cannot be opened in this way
    }
    d.verdict = PoseVerdict::kOtherwise;
    d.proposal = options;
    break;
  }
  return d;
}

}  // namespace dynains
