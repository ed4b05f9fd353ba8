#include "dynains/poses/diagnosis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iomanip>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "agreement_sum.hpp"
#include "dynains/errors.hpp"
#include "dynains/median.hpp"
#include "in_two_threads.hpp"
#include "io/finite_points.hpp"
#include "io/text.hpp"
#include "landmarks.hpp"
#include "lost_scans.hpp"
#include "point_time_faults.hpp"
#include "pose_diagnosis.hpp"
#include "pose_fit.hpp"
#include "pose_shift.hpp"

namespace dynains {
namespace {

constexpr std::size_t kPairs = 8;   // pairs of scans that are compared
constexpr std::size_t kStride = 5;  // from one scan of a pair to the other
constexpr double kFast = 2.0;       // m from scan to scan; overlap of pairs is small beyond it

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

  /// At most `most` evenly spread pairs (i, i + stride) of the scans `first` to `last`, which live
  /// as long as this. Throws IoError.
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
      pairs.push_back({scans[k], scans[k + 1], scans_.at(scans[k]).landmarks,
                       scans_.at(scans[k + 1]).landmarks});
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
    std::size_t all = 0, valid = 0, near = 0;  // points
    std::vector<double> ranges, heights;
    Eigen::Vector3d up = Eigen::Vector3d::Zero();
    for (const auto& [i, scan] : scans_) {
      all += scan.all;
      valid += scan.valid;
      near += scan.near;
      ranges.insert(ranges.end(), scan.ranges.begin(), scan.ranges.end());
      if (!scan.mounting.known) continue;
      heights.push_back(scan.mounting.height);
      up += scan.mounting.up_sensor;
    }
    if (!scans_.empty()) d.points = static_cast<double>(all) / static_cast<double>(scans_.size());
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
    std::size_t all = 0;  // points
    std::size_t valid = 0;
    std::size_t near = 0;
    std::vector<double> ranges;  // m, of some points
    Mounting mounting;
    Landmarks landmarks;

    Scan(const Recording& recording, std::size_t i) : Scan(recording.read_scan(i)) {}

   private:
    explicit Scan(const RecordedScan& scan) : Scan(finite_points(scan)) { all = scan.size(); }
    explicit Scan(const PointBuffer& points)
        : valid(points.size()), mounting(mounting_of(points)), landmarks(points, mounting) {
      for (std::size_t k = 0; k < points.size(); ++k) {
        const float x = points.x[k], y = points.y[k], z = points.z[k];
        const double range = std::sqrt(x * x + (y * y + z * z));
        if (range < 2.0) ++near;
        if (k % 37 == 0) ranges.push_back(range);
      }
    }
  };

  const Recording& recording_;
  std::map<std::size_t, Scan> scans_;
};

constexpr std::size_t kAllPoints = 1200;  // compared points of a pair
constexpr std::size_t kFewPoints = 150;

Agreement agreement_under(const PoseConvention& convention, const Recording& recording,
                          const std::vector<Pair>& pairs, std::size_t points = kAllPoints) {
  AgreementSum sum;
  for (const Pair& pair : pairs) {
    const auto T_a_b = motion_under(recording, convention, pair.first, pair.second);
    if (T_a_b) sum.add(pair.a.compare(pair.b, *T_a_b, points));
  }
  return sum.mean();
}

/// Agreement under the identity: no motion.
Agreement standing_agreement(const std::vector<Pair>& pairs) {
  AgreementSum sum;
  for (const Pair& pair : pairs) sum.add(pair.a.compare(pair.b, Pose::Identity()));
  return sum.mean();
}

/// A changed convention, and the options that select it.
struct Change {
  std::string meaning;
  std::string option;
  PoseConvention convention;
};

/// Appends a copy of each of `changes` that is also changed by `edit`.
template <class Edit>
void add_change(std::vector<Change>& changes, const std::string& meaning, const std::string& option,
                Edit&& edit) {
  const std::size_t count = changes.size();
  for (std::size_t i = 0; i < count; ++i) {
    Change change = changes[i];
    change.meaning += (change.meaning.empty() ? "" : ", and ") + meaning;
    change.option += (change.option.empty() ? "" : " ") + option;
    edit(change.convention);
    changes.push_back(std::move(change));
  }
}

/// Appends copies of `changes` in millimetres, then copies in centimetres.
void add_units(std::vector<Change>& changes) {
  struct Unit {
    const char* name;
    const char* flag;
    double metres;
  };
  const std::vector<Change> before = changes;
  for (const Unit& unit : {Unit{"millimetres", "mm", 0.001}, Unit{"centimetres", "cm", 0.01}}) {
    std::vector<Change> changed = before;
    add_change(changed, std::string("translations are in ") + unit.name,
               std::string("--pose-units ") + unit.flag,
               [&](PoseConvention& c) { c.unit = unit.metres; });
    changes.insert(changes.end(), changed.begin() + static_cast<std::ptrdiff_t>(before.size()),
                   changed.end());
  }
}

/// A shift is not combined with other changes: its effect is small.
void add_shifts(std::vector<Change>& changes, const PoseConvention& given) {
  for (const int shift : {1, -1, 2, -2}) {
    Change change{
        std::abs(shift) == 1 ? "the poses are off by one scan" : "the poses are off by two scans",
        "--pose-shift " + std::to_string(given.shift + shift), given};
    change.convention.shift = given.shift + shift;
    changes.push_back(std::move(change));
  }
}

/// All combinations of common mistakes, except options that were given.
std::vector<Change> usual_mistakes(const Recording& recording) {
  const PoseConvention& given = recording.convention();
  std::vector<Change> changes = {{"", "", given}};
  if (!given.invert) {
    add_change(changes, "the poses are inverse (from the world to the sensor)", "--invert-poses",
               [](PoseConvention& c) { c.invert = true; });
  }
  if (recording.has_quaternions() && given.quaternion == QuaternionOrder::kNone) {
    const bool to_wxyz = recording.quaternion_order() == QuaternionOrder::kXyzw;
    add_change(
        changes,
        to_wxyz ? "quaternions are in the order w x y z" : "quaternions are in the order x y z w",
        to_wxyz ? "--quaternion-order wxyz" : "--quaternion-order xyzw",
        [to_wxyz](PoseConvention& c) {
          c.quaternion = to_wxyz ? QuaternionOrder::kWxyz : QuaternionOrder::kXyzw;
        });
  }
  if (!given.left_handed) {
    add_change(changes, "the poses are left-handed", "--left-handed-poses",
               [](PoseConvention& c) { c.left_handed = true; });
  }
  if (given.frame == PoseFrame::kAuto) {
    const bool is_camera = recording.has_calibration() && !recording.has_quaternions();
    if (is_camera) {
      add_change(changes, "the poses are those of the lidar, not of the camera",
                 "--pose-frame lidar", [](PoseConvention& c) { c.frame = PoseFrame::kLidar; });
    } else {
      add_change(changes, "the poses are those of a camera", "--pose-frame camera",
                 [](PoseConvention& c) { c.frame = PoseFrame::kCamera; });
    }
  }
  if (given.unit == 1.0) add_units(changes);
  changes.erase(changes.begin());  // no change at all
  add_shifts(changes, given);
  std::stable_sort(changes.begin(), changes.end(), [](const Change& a, const Change& b) {
    const auto flags = [](const Change& c) {
      return std::count(c.option.begin(), c.option.end(), '-');
    };
    return flags(a) < flags(b);
  });
  return changes;
}

PoseVerdict judge(const Recording& recording, const Diagnosis& d) {
  if (d.as_given.points < 200) return PoseVerdict::kUnknown;
  const bool given_fits = fits(d.as_given, d.standing);
  if (recording.frame() == PointFrame::kWorld) {
    return given_fits ? PoseVerdict::kWorldFrame : PoseVerdict::kDisagree;
  }
  const Agreement* best = d.readings.empty() ? &d.as_given : &d.readings.front().agreement;
  if (is_clearly_better(*best, d.as_given) && fits(*best, d.standing) &&
      is_clearly_better(*best, d.standing)) {
    return PoseVerdict::kOtherwise;
  }
  if (given_fits && !is_clearly_better(d.standing, d.as_given)) {
    return is_clearly_better(d.as_given, d.standing) ? PoseVerdict::kAgree : PoseVerdict::kNoMotion;
  }
  return PoseVerdict::kDisagree;
}

/// Whether no other reading of the poses is clearly better.
bool is_best(const Diagnosis& d) {
  return is_passable(d.as_given, d.standing) &&
         (d.readings.empty() || !is_clearly_better(d.readings.front().agreement, d.as_given));
}

/// Computes the agreement of `pairs` under the poses and under common mistakes.
void compare(const Recording& recording, const std::vector<Pair>& pairs, std::size_t stride,
             Diagnosis& d) {
  d.stride = stride;
  d.standing = standing_agreement(pairs);
  d.as_given = agreement_under(recording.convention(), recording, pairs);
  if (recording.frame() == PointFrame::kSensor) {
    const std::vector<Change> changes = usual_mistakes(recording);
    d.readings = in_two_threads(changes.size(), [&](std::size_t i) {
      const Change& change = changes[i];
      Agreement agreement = agreement_under(change.convention, recording, pairs, kFewPoints);
      if (agreement.gap < kHopeless * d.as_given.gap ||
          agreement.gap < kHopeless * d.standing.gap) {
        agreement = agreement_under(change.convention, recording, pairs);
      }
      return PoseReading{change.meaning, change.option, change.convention, agreement};
    });
    // A reading with fewer changes stays first unless another one is clearly better.
    for (std::size_t i = 1; i < d.readings.size(); ++i) {
      if (is_clearly_better(d.readings[i].agreement, d.readings.front().agreement)) {
        std::rotate(d.readings.begin(), d.readings.begin() + static_cast<std::ptrdiff_t>(i),
                    d.readings.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      }
    }
  }
  d.verdict = judge(recording, d);
}

/// Gaps of a pair under shifted poses; nothing if a pose is missing.
std::optional<ShiftedGaps> shifted_gaps(const Recording& recording, const Pair& pair) {
  ShiftedGaps gaps{};
  PoseConvention convention = recording.convention();
  convention.shift -= kFarthestShift;
  for (double& gap : gaps) {
    const auto T_a_b = motion_under(recording, convention, pair.first, pair.second);
    if (!T_a_b) return std::nullopt;
    gap = pair.a.compare(pair.b, *T_a_b).gap;
    ++convention.shift;
  }
  return gaps;
}

/// Looks for poses that are shifted by one or two scans: that changes the agreement little, so it
/// takes more pairs.
void look_for_shift(const Recording& recording, ScanSample& sample, Diagnosis& d) {
  constexpr std::size_t kManyPairs = 24;
  const auto margin = static_cast<std::size_t>(kFarthestShift);
  if (recording.size() < kLeastShiftPairs + kStride + 2 * margin) return;
  const std::vector<Pair> pairs =
      sample.pairs(margin, recording.size() - 1 - margin, kStride, kManyPairs);
  const auto of_pairs = in_two_threads(
      pairs.size(), [&](std::size_t k) { return shifted_gaps(recording, pairs[k]); });
  std::vector<ShiftedGaps> gaps;
  for (const auto& of_pair : of_pairs) {
    if (of_pair) gaps.push_back(*of_pair);
  }
  const int shift = best_shift(gaps);
  if (shift == 0) return;
  // All readings that are shown come from the same pairs.
  compare(recording, pairs, kStride, d);
  const auto found = std::find_if(d.readings.begin(), d.readings.end(), [&](const PoseReading& r) {
    return r.convention.shift == recording.convention().shift + shift;
  });
  std::rotate(d.readings.begin(), found, found + 1);
  d.verdict = PoseVerdict::kOtherwise;
}

void describe_motion(const Recording& recording, Diagnosis& d) {
  std::vector<double> periods;
  std::vector<double> steps;
  for (std::size_t i = 1; i < recording.size(); ++i) {
    periods.push_back(recording.time(i) - recording.time(i - 1));
    steps.push_back(
        (recording.T_world_sensor(i).translation() - recording.T_world_sensor(i - 1).translation())
            .norm());
  }
  d.period = median(periods);
  d.step = median(steps);
  if (!steps.empty()) d.longest_step = *std::max_element(steps.begin(), steps.end());
}

struct SampledPairs {
  std::vector<Pair> pairs;  // (i, i + stride)
  std::size_t stride = 0;
};

/// Pairs of neighbours if these do not agree without motion. Else the stride increases until pairs
/// do not: scans farther apart show more of the motion of a slow sensor.
SampledPairs sample_pairs(const Recording& recording, ScanSample& sample) {
  constexpr double kFastAgreement = 0.35;  // of neighbours
  const std::size_t scans = recording.size();
  if (scans < 2) return {};
  SampledPairs result;
  for (std::size_t stride = kStride; stride <= 16 * kStride && 2 * stride <= scans; stride *= 4) {
    result = {sample.pairs(0, scans - 1, stride, kPairs), stride};
    if (standing_agreement(result.pairs).share < kLeastAgreement) break;
  }
  if (result.stride > kStride) return result;
  // With the first scans of the pairs above.
  const std::size_t last = result.pairs.empty() ? scans - 1 : scans - kStride;
  SampledPairs neighbours{sample.pairs(0, last, 1, kPairs), 1};
  const bool is_fast = standing_agreement(neighbours.pairs).share < kFastAgreement;
  return is_fast || result.pairs.empty() ? neighbours : result;
}

/// Judges by the agreement of scans. Returns whether more pairs may show shifted poses.
bool judge_agreement(const Recording& recording, ScanSample& sample, Diagnosis& d) {
  const SampledPairs sampled = sample_pairs(recording, sample);
  if (recording.size() == 1) sample.read({0});
  sample.describe(d);
  compare(recording, sampled.pairs, sampled.stride, d);
  if (d.verdict == PoseVerdict::kDisagree && sampled.stride > 1 && d.step > kFast) {
    // Fast and with few objects in sight, as on a motorway: such pairs may have only traffic in
    // common, while neighbouring scans overlap.
    Diagnosis near_by = d;
    compare(recording, sample.pairs(0, recording.size() - 1, 1, kPairs), 1, near_by);
    if (near_by.verdict == PoseVerdict::kDisagree && is_best(near_by)) {
      near_by.verdict = PoseVerdict::kNoMotion;
    }
    if (near_by.sound()) {
      d = std::move(near_by);
      return false;
    }
  }
  return d.verdict == PoseVerdict::kAgree;
}

/// Agreement of a few pairs (i, i + stride) of the scans `first` to `last`.
PoseAgreement agreement_at(const Recording& recording, std::size_t first, std::size_t last,
                           std::size_t stride) {
  constexpr std::size_t kFewPairs = 4;
  ScanSample sample(recording);
  const std::vector<Pair> pairs = sample.pairs(first, last, stride, kFewPairs);
  AgreementSum as_given;
  for (const Pair& pair : pairs) {
    as_given.add(pair.a.compare(pair.b, recording.T_world_sensor(pair.first).inverse() *
                                            recording.T_world_sensor(pair.second)));
  }
  return {as_given.mean(), standing_agreement(pairs), stride};
}

constexpr const char* kWorldOption = "--frame world";

/// Whether no point of a scan lies around the origin of the clouds, but most lie around the
/// position of the sensor in the world.
bool seems_in_world(const Recording& recording) {
  constexpr double kNear = 40.0, kAround = 80.0;  // m
  if (recording.frame() != PointFrame::kSensor || recording.size() == 0) return false;
  const std::size_t middle = recording.size() / 2;
  const RecordedScan scan = recording.read_scan(middle);
  const Eigen::Vector3d position = recording.T_world_sensor(middle).translation();
  std::size_t valid = 0, near_sensor = 0, near_origin = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Eigen::Vector3d p = scan.point(i).position;
    if (!p.allFinite() || p.isZero(0.0)) continue;
    ++valid;
    if ((p - position).norm() < kAround) ++near_sensor;
    if (p.norm() < kNear) ++near_origin;
  }
  return near_origin == 0 && valid > 0 && 2 * near_sensor > valid;
}

constexpr const char* kDeskewOption = "--deskew";

/// Diagnosis of the poses, without that of the rays.
Diagnosis diagnose_poses(const Recording& recording) {
  Diagnosis d;
  d.scan_files = recording.scan_file_count();
  d.pose_rows = recording.pose_count();
  d.scans = recording.size();
  d.time_offset = recording.time_offset();
  describe_motion(recording, d);
  ScanSample sample(recording);
  const bool may_be_shifted = judge_agreement(recording, sample, d);
  if (d.verdict == PoseVerdict::kUnknown && seems_in_world(recording)) {
    d.verdict = PoseVerdict::kDisagree;
    d.option = kWorldOption;
    return d;
  }
  if (!accept_proven_poses(recording, d)) {
    if (may_be_shifted) look_for_shift(recording, sample, d);
    compare_with_registration(recording, d);
  }
  if (!d.sound()) return d;
  d.lost_scans = find_lost_clouds(recording);
  if (d.lost_scans) d.verdict = PoseVerdict::kLostScans;
  return d;
}

/// Whether scans that do not agree as they are would agree if their points were de-skewed.
bool would_agree_deskewed(const Recording& recording, const Diagnosis& d) {
  const bool is_doubted =
      d.verdict == PoseVerdict::kOtherwise || d.verdict == PoseVerdict::kBodyFrame ||
      d.verdict == PoseVerdict::kTimeOffset || d.verdict == PoseVerdict::kScaled ||
      d.verdict == PoseVerdict::kInexact || d.verdict == PoseVerdict::kDisagree;
  const bool may_be_skewed = recording.columns().time && !recording.is_deskewed() &&
                             recording.frame() == PointFrame::kSensor;
  if (!is_doubted || !may_be_skewed) return false;
  RecordingOptions options = recording.options();
  options.deskew = true;
  try {
    const Recording deskewed(recording.folder(), options);
    return diagnose_poses(deskewed).verdict == PoseVerdict::kAgree;
  } catch (const IoError&) {
    return false;  // the times of its points cannot be used
  }
}

}  // namespace

Diagnosis diagnose(const Recording& recording) {
  Diagnosis d = diagnose_poses(recording);
  if (would_agree_deskewed(recording, d)) {
    d.verdict = PoseVerdict::kSkewed;
    d.convention = recording.convention();
    d.time_offset = recording.time_offset();
    d.option = kDeskewOption;
    return d;
  }
  if (d.verdict != PoseVerdict::kUnknown && recording.is_deskewed()) {
    d.point_times = text_of(best_reading(point_times_gaps(recording, 0, recording.size() - 1)));
    if (!d.point_times.empty()) {
      d.verdict = PoseVerdict::kPointTimes;
      d.option.clear();
      return d;
    }
  }
  if (d.sound() && d.scans > 0) d.ray_origin = find_ray_origin(recording, 0, d.scans - 1);
  if (d.ray_origin) {
    d.verdict = PoseVerdict::kRayOrigin;
    d.option = option_for(*d.ray_origin);
  }
  return d;
}

PoseAgreement pose_agreement(const Recording& recording, std::size_t first, std::size_t last) {
  const std::size_t stride = std::min(kStride, last - first);
  if (stride == 0) return {};
  const PoseAgreement agreement = agreement_at(recording, first, last, stride);
  const double way = (recording.T_world_sensor(first + stride).translation() -
                      recording.T_world_sensor(first).translation())
                         .norm();
  const bool is_fast = way > kFast * static_cast<double>(stride);
  if (!agreement.doubtful() || stride == 1 || !is_fast) return agreement;
  // As in diagnose(): neighbouring scans overlap more.
  const PoseAgreement of_neighbours = agreement_at(recording, first, last, 1);
  return of_neighbours.doubtful() ? agreement : of_neighbours;
}

namespace {

constexpr double kDegrees = 180.0 / 3.14159265358979323846;

std::string fixed(double value, int digits) {
  std::ostringstream text;
  text::exact(text);
  text << std::fixed << std::setprecision(digits) << value;
  return text.str();
}

/// "12 cm and 0.3 deg from one scan to the next".
std::string error_text(double translation, double rotation) {
  return fixed(100.0 * translation, 0) + " cm and " + fixed(kDegrees * rotation, 1) +
         " deg from one scan to the next";
}

std::string error_text(const Diagnosis& d) {
  return error_text(d.translation_error, d.rotation_error);
}

std::string body_text(const Pose& T_body_sensor) {
  constexpr double kUpright = 0.98;
  const Eigen::AngleAxisd rotation(detail::Quaternion(T_body_sensor.linear()));
  const Eigen::Vector3d t = T_body_sensor.translation();
  std::string text;
  if (std::abs(rotation.angle()) > 1e-6) {
    const Eigen::Vector3d& axis = rotation.axis();
    const bool is_yaw = std::abs(axis.z()) > kUpright;
    const double degrees = kDegrees * rotation.angle() * (is_yaw && axis.z() < 0.0 ? -1.0 : 1.0);
    text = std::string(is_yaw ? "is yawed by " : "is turned by ") + fixed(degrees, 1) + " deg";
  }
  if (t.norm() > 0.0) {
    text += std::string(text.empty() ? "" : " and ") + "lies at (" + fixed(t.x(), 2) + ' ' +
            fixed(t.y(), 2) + ' ' + fixed(t.z(), 2) + ") m";
  }
  return text;
}

}  // namespace

std::string advice(const Diagnosis& d) {
  // Without a known mounting, an option for it may be needed.
  const std::string end = d.mounting.known ? "; no option is needed." : ".";
  switch (d.verdict) {
    case PoseVerdict::kAgree:
      return "Scans and poses agree as they are" + end;
    case PoseVerdict::kOtherwise:
      return (fits(d.as_given, d.standing) ? "Scans agree better if " : "Scans agree if ") +
             d.readings.front().meaning + ": pass " + d.readings.front().option + ".";
    case PoseVerdict::kBodyFrame:
      return "Scans agree if the poses are those of a body, such as an IMU or a vehicle, in which "
             "the "
             "lidar " +
             body_text(d.convention.T_body_sensor) +
             " (parts that the drive does not determine are 0): pass " + d.option + ".";
    case PoseVerdict::kTimeOffset:
      return "Scans agree better under the poses " + fixed(std::abs(d.time_offset), 3) + " s " +
             (d.time_offset > 0.0 ? "after" : "before") + " their times: pass " + d.option + ".";
    case PoseVerdict::kScaled:
      return "Scans agree if all ways of the poses are " + fixed(d.convention.scale, 3) +
             " times as long, as after an odometry with a wrong radius of wheels: pass " +
             d.option + ".";
    case PoseVerdict::kLostScans:
      return std::string(d.lost_scans->shift > 0 ? "Clouds" : "Poses") +
             " seem to be missing between the scans " + std::to_string(d.lost_scans->first) +
             " and " + std::to_string(d.lost_scans->last) +
             " (counted from 0): behind, scans agree with the poses " +
             std::to_string(std::abs(d.lost_scans->shift)) + " rows " +
             (d.lost_scans->shift > 0 ? "later" : "earlier") +
             ". Give scans and poses times, or scans the numbers of their rows.";
    case PoseVerdict::kInexact:
      if (d.is_inexact_at_start) {
        return "Scans and poses agree, but the poses of the first scans are inexact by about " +
               error_text(d.start_translation_error, d.start_rotation_error) +
               ", as those of an odometry that has not converged yet: expect losses there; run "
               "--start leaves "
               "them out.";
      }
      return "Scans and poses agree roughly, but the poses are inexact by about " + error_text(d) +
             ": expect losses; poses of a LiDAR odometry would do better.";
    case PoseVerdict::kSkewed:
      return std::string(
                 "Scans agree if their points are moved to the place of the sensor at the time of "
                 "the scan: pass ") +
             kDeskewOption + ".";
    case PoseVerdict::kPointTimes:
      return "The times of points do not fit the motion: scans agree better " + d.point_times + '.';
    case PoseVerdict::kRayOrigin:
      return advice(*d.ray_origin);
    case PoseVerdict::kNoMotion:
      if (d.step * static_cast<double>(d.stride) > 1.0) {
        return "Too little stands beside the way to tell what the poses mean; nothing speaks "
               "against them.";
      }
      return "The sensor hardly moves, so that scans agree whatever the poses mean; nothing speaks "
             "against them.";
    case PoseVerdict::kDisagree:
      if (d.option == kWorldOption) {
        return std::string(
                   "No point lies around the origin of the clouds, but most lie around the "
                   "position of the sensor in the world: pass ") +
               kWorldOption + '.';
      }
      if (d.standing.share >= kLeastAgreement && is_clearly_better(d.standing, d.as_given)) {
        return "Scans agree best as if the sensor stood still, though the poses move: if the "
               "points are in the frame of the world, pass --frame world; if the sensor did stand "
               "still, the poses are wrong.";
      }
      return "Scans do not agree under these poses, nor under any usual mistake: they belong to "
             "another recording or clock, or are far too inexact" +
             (d.registered_pairs > 0 ? " (off by " + error_text(d) + ")." : std::string("."));
    case PoseVerdict::kWorldFrame:
      return "Points are in the frame of the world and agree there" + end;
    case PoseVerdict::kUnknown:
      return "There is too little to compare: at least two scans with walls, poles or trees within "
             "40 m are needed.";
  }
  return {};
}

}  // namespace dynains
