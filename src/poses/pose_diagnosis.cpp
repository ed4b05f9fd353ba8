#include "pose_diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynains/io/extrinsic.hpp"
#include "dynains/median.hpp"
#include "given_motion.hpp"
#include "lost_scans.hpp"
#include "merged_scans.hpp"
#include "point_time_faults.hpp"
#include "pose_fit.hpp"
#include "pose_proof.hpp"

namespace dynains {
namespace {

constexpr double kExact = 0.03;            // m at points 10 m away; registrations are worse rarely
constexpr std::size_t kFewestMotions = 6;  // for any estimate
constexpr std::size_t kFewestPairs = 3;    // neighbouring scans, for a statement about their error
constexpr std::size_t kFewestFirstPairs = 2;  // at the start of the recording
constexpr double kClearlyWorse = 3.0;         // ratio of errors at the start and elsewhere
constexpr double kInexactTranslation = 0.05;  // m, from one scan to the next
constexpr double kInexactRotation = 0.0045;   // rad
constexpr double kSmaller = 0.75;             // ratio of errors, beside a proof by single motions
constexpr double kFarOff = 1.0;               // m at points 10 m away
constexpr double kRough = 0.4;  // m at points 10 m away; more is not inexact but wrong

/// Largest errors from one scan to the next that exact poses leave, m and rad.
struct UsualError {
  double translation, rotation;
};

/// Median change of the motion from one step to the next, m and rad.
UsualError change_of_motion(const Recording& recording) {
  std::vector<double> translations, rotations;
  for (std::size_t i = 1; i + 1 < recording.size(); ++i) {
    const Pose change =
        motion_between(recording, i - 1, i).inverse() * motion_between(recording, i, i + 1);
    translations.push_back(change.translation().norm());
    rotations.push_back(angle_of(change.linear()));
  }
  return {median(std::move(translations)), median(std::move(rotations))};
}

/// By the noise of `steps`, and by the motion within de-skewed scans: between two poses it is taken
/// as even. If a sensor sways, the middle of a scan is off by an eighth of the change of motion or
/// slightly more, and that of the next scan by as much to the other side.
UsualError usual_error(const Recording& recording, const MotionError& steps) {
  constexpr double kUneven = 1.0 / 3.0;
  UsualError usual{std::max(kInexactTranslation, 3.0 * steps.translation_noise),
                   std::max(kInexactRotation, 3.0 * steps.rotation_noise)};
  if (!recording.is_deskewed()) return usual;
  const UsualError change = change_of_motion(recording);
  return {std::max(usual.translation, kUneven * change.translation),
          std::max(usual.rotation, kUneven * change.rotation)};
}

bool is_inexact(const MotionError& error, const UsualError& usual) {
  return error.translation > usual.translation || error.rotation > usual.rotation;
}

std::optional<Pose> no_motion(const RegisteredMotion& /*motion*/) { return Pose::Identity(); }

BodyMotion motion_after(const Recording& recording, double offset) {
  return [&recording, offset](const RegisteredMotion& m) -> std::optional<Pose> {
    const auto T_world_a = recording.pose_after(m.first, offset);
    const auto T_world_b = recording.pose_after(m.second, offset);
    if (!T_world_a || !T_world_b) return std::nullopt;
    return T_world_a->inverse() * *T_world_b;
  };
}

double error_at_points(const std::vector<RegisteredMotion>& motions, const BodyMotion& body,
                       const Pose& T_body_sensor = Pose::Identity()) {
  return motion_error(motions, body, T_body_sensor).at_points;
}

/// An estimate from one half of the motions must hold on the other half.
bool is_much_better(double error, double before) {
  return error < 0.5 * before && before - error > 0.02;
}

/// A meaning of the poses, and the error that remains under it.
struct Explanation {
  PoseVerdict verdict = PoseVerdict::kBodyFrame;
  double error = 0.0;  // m at points 10 m away
  PoseConvention convention;
  double time_offset = 0.0;
  std::string option;
};

/// Without parts that explain nothing: a rotation or translation near 0, or one that the motions do
/// not determine.
Pose simplified(const std::vector<RegisteredMotion>& motions, const BodyMotion& body,
                const Pose& T_body_sensor) {
  const double error = error_at_points(motions, body, T_body_sensor);
  const auto is_enough = [&](const Pose& simpler) {
    return error_at_points(motions, body, simpler) < 1.1 * error + 0.002;
  };
  Pose unturned = T_body_sensor;
  unturned.linear().setIdentity();
  Pose result = is_enough(unturned) ? unturned : T_body_sensor;
  Pose unmoved = result;
  unmoved.translation().setZero();
  if (is_enough(unmoved)) return unmoved;
  Pose level = result;
  level.translation().z() = 0.0;
  return is_enough(level) ? level : result;
}

std::optional<Explanation> explain_by_body(const Recording& recording,
                                           const std::vector<RegisteredMotion>& motions,
                                           const PoseConvention& convention,
                                           const std::string& flags, double before) {
  const BodyMotion body = motion_under(recording, convention);
  const auto of_half = fit_extrinsic(half_of(motions, 0), body);
  if (!of_half) return std::nullopt;
  const std::vector<RegisteredMotion> others = half_of(motions, 1);
  if (!is_much_better(error_at_points(others, body, *of_half), before)) return std::nullopt;
  const auto fitted = fit_extrinsic(motions, body);
  if (!fitted) return std::nullopt;
  const Pose T_body_sensor = simplified(motions, body, *fitted);
  Explanation result;
  result.error = error_at_points(motions, body, T_body_sensor);
  if (!is_much_better(result.error, before)) return std::nullopt;
  result.convention = convention;
  // The convention gives the pose of the frame of the clouds, in which the sensor has a position.
  const Eigen::Translation3d origin(recording.sensor_origin());
  result.convention.T_body_sensor =
      convention.T_body_sensor * origin * T_body_sensor * origin.inverse();
  result.time_offset = recording.time_offset();
  result.option = flags + "--extrinsic \"" + extrinsic_text(result.convention.T_body_sensor) + '"';
  return result;
}

/// The best of all bodies, also for poses that have a usual mistake in addition.
std::optional<Explanation> explain_by_body(const Recording& recording,
                                           const std::vector<RegisteredMotion>& motions,
                                           double before) {
  const PoseConvention& given = recording.convention();
  std::vector<std::pair<PoseConvention, std::string>> conventions = {{given, ""}};
  if (!given.invert) {
    conventions.emplace_back(given, "--invert-poses ");
    conventions.back().first.invert = true;
  }
  if (recording.has_quaternions() && given.quaternion == QuaternionOrder::kNone) {
    const bool to_wxyz = recording.quaternion_order() == QuaternionOrder::kXyzw;
    conventions.emplace_back(given,
                             to_wxyz ? "--quaternion-order wxyz " : "--quaternion-order xyzw ");
    conventions.back().first.quaternion = to_wxyz ? QuaternionOrder::kWxyz : QuaternionOrder::kXyzw;
  }
  std::optional<Explanation> best;
  for (const auto& [convention, flags] : conventions) {
    const auto found = explain_by_body(recording, motions, convention, flags, before);
    // A further flag must explain clearly more.
    if (found && (!best || found->error < 0.5 * best->error)) best = found;
  }
  return best;
}

/// Offset (s, added to the given one) with the least error; 0 if it is at an end of the range.
double best_offset(const Recording& recording, const std::vector<RegisteredMotion>& motions) {
  constexpr double kFarthest = 0.6;
  constexpr double kCoarse = 0.02;
  constexpr double kFine = 0.005;
  double best = 0.0;
  double least = error_at_points(motions, motion_after(recording, 0.0));
  const auto look = [&](double from, double to, double step) {
    for (double offset = from; offset < to + 0.5 * step; offset += step) {
      const MotionError error =
          motion_error(motions, motion_after(recording, offset), Pose::Identity());
      if (2 * error.pairs < motions.size() || !(error.at_points < least)) continue;
      least = error.at_points;
      best = offset;
    }
  };
  look(-kFarthest, kFarthest, kCoarse);
  look(best - kCoarse, best + kCoarse, kFine);
  return std::abs(best) < kFarthest - kCoarse ? best : 0.0;
}

std::optional<Explanation> explain_by_offset(const Recording& recording,
                                             const std::vector<RegisteredMotion>& motions,
                                             double before) {
  if (!recording.pose_after(motions.front().first, 0.0)) return std::nullopt;
  const double of_half = best_offset(recording, half_of(motions, 0));
  const std::vector<RegisteredMotion> others = half_of(motions, 1);
  const double error_then = error_at_points(others, motion_after(recording, of_half));
  const double error_now = error_at_points(others, motion_after(recording, 0.0));
  if (of_half == 0.0 || !(error_then < 0.6 * error_now && error_now - error_then > 0.01)) {
    return std::nullopt;
  }
  const double offset = best_offset(recording, motions);
  Explanation result;
  result.verdict = PoseVerdict::kTimeOffset;
  result.convention = recording.convention();
  result.error = error_at_points(motions, motion_after(recording, offset));
  if (offset == 0.0 || !(result.error < 0.6 * before)) return std::nullopt;
  result.time_offset = recording.time_offset() + offset;
  char text[32];
  std::snprintf(text, sizeof(text), "%.3f", result.time_offset);
  result.option = std::string("--time-offset ") + text;
  return result;
}

/// Factor of the translations under which most motions agree; 1 without motion.
double fitted_scale(const std::vector<RegisteredMotion>& motions, const BodyMotion& body) {
  constexpr double kLeastWay = 0.2;  // m
  std::vector<double> scales;
  for (const RegisteredMotion& motion : motions) {
    const auto T_body = body(motion);
    if (!T_body || !(T_body->translation().norm() > kLeastWay)) continue;
    const Eigen::Vector3d way = T_body->translation();
    scales.push_back(way.dot(motion.T_first_second.translation()) / way.squaredNorm());
  }
  return scales.empty() ? 1.0 : median(std::move(scales));
}

/// Ways that are too long or too short throughout, as by a wrong radius of wheels.
std::optional<Explanation> explain_by_scale(const Recording& recording,
                                            const std::vector<RegisteredMotion>& motions,
                                            double before) {
  constexpr double kLeastFactor = 0.5;
  const auto scaled = [&](double factor) {
    PoseConvention convention = recording.convention();
    convention.scale = std::clamp(convention.scale * factor, kLeastPoseScale, kLargestPoseScale);
    return convention;
  };
  const auto error_under = [&](const std::vector<RegisteredMotion>& some, double factor) {
    return error_at_points(some, motion_under(recording, scaled(factor)));
  };
  const BodyMotion given = motion_under(recording, recording.convention());
  const double of_half = fitted_scale(half_of(motions, 0), given);
  if (!is_much_better(error_under(half_of(motions, 1), of_half), before)) return std::nullopt;
  // Three digits: more are not known.
  const double factor = std::round(1e3 * fitted_scale(motions, given)) / 1e3;
  Explanation result;
  result.verdict = PoseVerdict::kScaled;
  result.error = error_under(motions, factor);
  // Ways of nearly nothing agree with a sensor that stands, and with points of the world.
  const bool is_usual = kLeastFactor < factor && factor < 1.0 / kLeastFactor;
  const bool is_motion = result.error < 0.5 * error_at_points(motions, no_motion);
  if (!is_usual || !is_motion || !is_much_better(result.error, before)) return std::nullopt;
  result.convention = scaled(factor);
  result.time_offset = recording.time_offset();
  char text[32];
  std::snprintf(text, sizeof(text), "%.4g", result.convention.scale);
  result.option = std::string("--pose-scale ") + text;
  return result;
}

/// The usual mistake under which poses and motions agree best; it becomes the first of `readings`.
std::optional<Explanation> explain_by_reading(const Recording& recording,
                                              const std::vector<RegisteredMotion>& motions,
                                              std::vector<PoseReading>& readings, double before) {
  const auto error_of = [&](const PoseReading& reading) {
    return error_at_points(motions, motion_under(recording, reading.convention));
  };
  const auto flags_of = [](const PoseReading& reading) {
    return std::count(reading.option.begin(), reading.option.end(), '-');
  };
  std::vector<std::size_t> order(readings.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return flags_of(readings[a]) < flags_of(readings[b]);
  });
  // An error that noise of the registration nearly hides must be smaller at most motions.
  const auto explains_more = [&](double error, const PoseReading& reading) {
    return is_much_better(error, before) ||
           (error < kSmaller * before &&
            is_mostly_better(motions, motion_under(recording, reading.convention),
                             motion_under(recording, recording.convention())));
  };
  std::size_t best = 0;
  double least = before;
  for (const std::size_t i : order) {
    const double error = error_of(readings[i]);
    const bool is_first = !(least < before);
    const bool has_as_few_flags = !is_first && flags_of(readings[i]) == flags_of(readings[best]);
    // A further flag must explain clearly more.
    const bool is_better = is_first ? explains_more(error, readings[i])
                                    : error < (has_as_few_flags ? 1.0 : 0.5) * least;
    if (!is_better) continue;
    best = i;
    least = error;
  }
  // Small motions differ little from any others, so no motion must be clearly worse, too.
  const double standing =
      error_at_points(motions, [](const RegisteredMotion&) { return Pose::Identity(); });
  if (!(least < before && least < std::min(kRough, 0.5 * standing))) return std::nullopt;
  const auto found = readings.begin() + static_cast<std::ptrdiff_t>(best);
  std::rotate(readings.begin(), found, found + 1);
  return Explanation{PoseVerdict::kOtherwise, least, readings.front().convention,
                     recording.time_offset(), readings.front().option};
}

void take(const Explanation& explanation, Diagnosis& d) {
  d.verdict = explanation.verdict;
  d.convention = explanation.convention;
  d.time_offset = explanation.time_offset;
  d.option = explanation.option;
}

/// Errors of the given poses by registered motions.
struct ErrorsAsGiven {
  MotionError all, steps, first_steps;
  UsualError usual;
  double exact = kExact;  // m at points 10 m away; errors of exact poses are smaller

  ErrorsAsGiven(const Recording& recording, const std::vector<RegisteredMotion>& motions) {
    const BodyMotion given = motion_under(recording, recording.convention());
    const auto identity = Pose::Identity();
    all = motion_error(motions, given, identity);
    steps = motion_error(motions, given, identity, Motions::kSteps);
    first_steps = motion_error(motions, given, identity, Motions::kFirstSteps);
    usual = usual_error(recording, steps);
    exact = std::max(kExact, 2.0 * all.noise);
  }
};

/// The meaning of the poses that explains their error best, in the order of fitted numbers: a usual
/// mistake has none, a scale or an offset one, an extrinsic six. A later one must be clearly
/// better.
std::optional<Explanation> explain(const Recording& recording,
                                   const std::vector<RegisteredMotion>& motions,
                                   std::vector<PoseReading>& readings, double before,
                                   double exact) {
  auto reading = explain_by_reading(recording, motions, readings, before);
  std::optional<Explanation> scale, offset, body;
  if (before > exact) {
    scale = explain_by_scale(recording, motions, before);
    offset = explain_by_offset(recording, motions, before);
    body = explain_by_body(recording, motions, before);
  }
  // A shift by scans is a coarse offset.
  const bool is_shift = reading && reading->convention.shift != recording.convention().shift;
  if (is_shift && offset && offset->error < reading->error) reading.reset();
  std::optional<Explanation> best;
  for (const auto* candidate : {&std::as_const(reading), &std::as_const(scale),
                                &std::as_const(offset), &std::as_const(body)}) {
    if (!*candidate) continue;
    if (!best || (best->error > exact && (*candidate)->error < 0.6 * best->error)) {
      best = *candidate;
    }
  }
  return best;
}

/// Finds poses that are inexact only in the first scans.
void judge_start(const ErrorsAsGiven& errors, Diagnosis& d) {
  const MotionError& first = errors.first_steps;
  const MotionError& steps = errors.steps;
  const bool is_worse = first.translation > kClearlyWorse * steps.translation ||
                        first.rotation > kClearlyWorse * steps.rotation;
  d.is_inexact_at_start = first.pairs >= kFewestFirstPairs && is_worse &&
                          is_inexact(first, errors.usual) && !is_inexact(steps, errors.usual);
  if (!d.is_inexact_at_start) return;
  d.start_translation_error = first.translation;
  d.start_rotation_error = first.rotation;
}

/// Corrects the verdict by the errors of poses that nothing explains.
void judge_exactness(const std::vector<RegisteredMotion>& motions, const ErrorsAsGiven& errors,
                     Diagnosis& d) {
  const double error = errors.all.at_points;
  if (d.verdict == PoseVerdict::kDisagree && error < errors.exact) d.verdict = PoseVerdict::kAgree;
  if (d.verdict == PoseVerdict::kDisagree && error < kRough) d.verdict = PoseVerdict::kInexact;
  if (d.verdict == PoseVerdict::kNoMotion && error > kRough) d.verdict = PoseVerdict::kDisagree;
  const bool may_be_inexact =
      d.verdict == PoseVerdict::kAgree || d.verdict == PoseVerdict::kNoMotion;
  if (may_be_inexact && (is_inexact(errors.steps, errors.usual) || d.is_inexact_at_start)) {
    d.verdict = PoseVerdict::kInexact;
  }
  const bool is_still = error_at_points(motions, no_motion) < 0.5 * error &&
                        is_clearly_better(d.standing, d.as_given);
  if (d.verdict == PoseVerdict::kInexact && is_still) d.verdict = PoseVerdict::kDisagree;
}

/// Whether most motions are certain, and none of them contradicts the poses.
bool are_all_exact(const GivenMotions& motions, const BodyMotion& given) {
  constexpr double kNoisy = 0.05;  // m at points 10 m away
  std::size_t steps = 0, exact = 0;
  for (const RegisteredMotion& motion : motions.certain) {
    if (motion.difference.norm() >= kNoisy) continue;
    if (error_at_points({motion}, given) >= kExact) return false;
    steps += motion.second == motion.first + 1 ? 1 : 0;
    ++exact;
  }
  return 4 * exact >= 3 * motions.tested && steps >= kFewestPairs;
}

/// Whether rows of poses or clouds may be missing, so that poses belong to other scans behind.
bool may_have_lost_rows(const Recording& recording) {
  const bool is_timed = recording.pose_after(0, 0.0).has_value();
  return may_have_lost_clouds(recording) || (recording.missing_pose_count() > 0 && !is_timed);
}

}  // namespace

void compare_with_registration(const Recording& recording, Diagnosis& d) {
  if (d.verdict == PoseVerdict::kOtherwise) {
    d.convention = d.readings.front().convention;
    d.option = d.readings.front().option;
  }
  if (recording.frame() != PointFrame::kSensor || d.verdict == PoseVerdict::kUnknown) return;
  const std::vector<RegisteredMotion> motions = register_motions(recording);
  const ErrorsAsGiven errors(recording, motions);
  const double before = errors.all.at_points;
  if (d.verdict == PoseVerdict::kAgree && before > kFarOff) {
    // In traffic at the speed of the sensor, a registration can find no motion, though the poses
    // agree with all that stands still. Any other motion contradicts the poses.
    if (motions.size() < kFewestMotions || error_at_points(motions, no_motion) < 0.5 * before) {
      d.registered_pairs = 0;
      return;
    }
    d.verdict = PoseVerdict::kDisagree;
  }
  d.lost_scans = find_lost_scans(recording, motions, errors.exact);
  if (d.lost_scans) {
    d.verdict = PoseVerdict::kLostScans;
    return;
  }
  d.translation_error = errors.steps.translation;
  d.rotation_error = errors.steps.rotation;
  d.registered_pairs = errors.steps.pairs;
  if (motions.size() < kFewestMotions || errors.steps.pairs < kFewestPairs) return;
  if (before > kExact) {
    const auto meaning = explain(recording, motions, d.readings, before, errors.exact);
    if (meaning) {
      take(*meaning, d);
      return;
    }
  }
  judge_start(errors, d);
  judge_exactness(motions, errors, d);
}

bool accept_proven_poses(const Recording& recording, Diagnosis& d) {
  constexpr std::size_t kNeighbours = 6;
  constexpr std::size_t kFewest = 5;
  const bool is_doubted = d.verdict != PoseVerdict::kAgree && d.verdict != PoseVerdict::kNoMotion;
  const bool is_dense = scans_to_merge(recording) == 1;
  if (recording.frame() != PointFrame::kSensor || d.verdict == PoseVerdict::kUnknown) return false;
  if (is_dense && (is_doubted || may_have_lost_rows(recording))) return false;
  const GivenMotions motions = register_given(recording, 0, recording.size() - 1, kNeighbours);
  if (motions.certain.size() < kFewest || 2 * motions.certain.size() < motions.tested) return false;
  const BodyMotion given = motion_under(recording, recording.convention());
  const auto identity = Pose::Identity();
  const MotionError all = motion_error(motions.certain, given, identity);
  const MotionError steps = motion_error(motions.certain, given, identity, Motions::kSteps);
  if (!(all.at_points < std::max(kExact, 2.0 * all.noise))) return false;
  if (is_inexact(steps, usual_error(recording, steps))) return false;
  if (is_dense ? !are_all_exact(motions, given) : !agrees_best(recording, d.readings, d.mounting)) {
    return false;
  }
  if (is_doubted) d.verdict = PoseVerdict::kAgree;
  d.convention = recording.convention();
  d.translation_error = steps.translation;
  d.rotation_error = steps.rotation;
  d.registered_pairs = steps.pairs;
  return true;
}

bool confirms_poses(const Recording& recording, std::size_t first, std::size_t last) {
  constexpr std::size_t kEnough = 3;
  // Largest error and noise at points 10 m away, over some scans, m. Registrations of sparse scans
  // are less exact; the mistakes that a run refuses are larger.
  const bool is_dense = scans_to_merge(recording) == 1;
  const double near = is_dense ? 0.03 : 0.1;
  const double noisy = is_dense ? 0.05 : 0.1;
  if (may_have_lost_clouds(recording)) return false;
  const GivenMotions motions = register_given(recording, first, last, 1);
  const BodyMotion given = motion_under(recording, recording.convention());
  std::size_t confirmed = 0;
  for (const RegisteredMotion& motion : motions.certain) {
    if (motion.difference.norm() >= noisy) continue;
    if (error_at_points({motion}, given) >= near) return false;
    ++confirmed;
  }
  if (confirmed < kEnough || !recording.is_deskewed()) return confirmed >= kEnough;
  return best_reading(point_times_gaps(recording, first, last)) == PointTimesReading::kAsGiven;
}

}  // namespace dynains
