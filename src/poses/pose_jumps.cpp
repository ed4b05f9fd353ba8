#include "dynains/poses/pose_jumps.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <optional>
#include <sstream>

#include "dynains/median.hpp"
#include "dynains/pose.hpp"
#include "given_motion.hpp"
#include "io/finite_points.hpp"
#include "io/text.hpp"
#include "scan_registration.hpp"

namespace dynains {
namespace {

constexpr double kJumpLever = 10.0;  // m
constexpr double kJumpDegrees = 180.0 / 3.14159265358979323846;

Pose motion_to(const Recording& recording, std::size_t i) {
  return recording.T_world_sensor(i - 1).inverse() * recording.T_world_sensor(i);
}

double interval_to(const Recording& recording, std::size_t i) {
  return recording.time(i) - recording.time(i - 1);
}

/// The motion to scan i that goes on with the speed of the motion to scan k.
Pose motion_like(const Recording& recording, std::size_t i, std::size_t k) {
  const double ratio = interval_to(recording, i) / interval_to(recording, k);
  const Pose motion = motion_to(recording, k);
  const Eigen::AngleAxisd rotation(detail::Quaternion(motion.linear()));
  Pose result = Pose::Identity();
  result.linear() = Eigen::AngleAxisd(ratio * rotation.angle(), rotation.axis()).toRotationMatrix();
  result.translation() = ratio * motion.translation();
  return result;
}

PoseJump difference(const Pose& expected, const Pose& given, std::size_t scan) {
  const Pose E = expected.inverse() * given;
  return {scan, E.translation().norm(), kJumpDegrees * angle_of(E.linear())};
}

/// Size at points 10 m away, m.
double size_of(const PoseJump& jump) {
  return std::hypot(jump.translation, kJumpLever * jump.rotation / kJumpDegrees);
}

/// Motions of the sensor to scan i that those beside it suggest.
std::vector<Pose> expected_motions(const Recording& recording, std::size_t i) {
  std::vector<Pose> expected;
  if (i > 1) expected.push_back(motion_like(recording, i, i - 1));
  if (i + 1 < recording.size()) expected.push_back(motion_like(recording, i, i + 1));
  return expected;
}

PointBuffer points_of(const Recording& recording, std::size_t i) {
  return finite_points(recording.read_scan(i));
}

/// The jump at a scan whose motion differs from those beside it; empty if the scans agree with the
/// motion, or do not tell it.
std::optional<PoseJump> confirmed(const Recording& recording, std::size_t i) {
  constexpr double kLeastScore = 0.45;
  constexpr double kUncertain = 0.06;   // m
  constexpr double kLeast = 0.15;       // m at points 10 m away
  constexpr double kImpossible = 10.0;  // m
  const PoseJump by_poses = deviation_at(recording, i);
  if (by_poses.translation > kImpossible) return by_poses;
  const RegistrationScan a(points_of(recording, i - 1));
  const RegistrationScan b(points_of(recording, i));
  std::vector<Pose> guesses = expected_motions(recording, i);
  const Pose given = motion_to(recording, i);
  guesses.push_back(given);
  const auto found = register_scans(a, b, guesses);
  const bool is_certain = found && found->score > kLeastScore && !found->is_ambiguous &&
                          found->uncertainty < kUncertain;
  if (!is_certain) return std::nullopt;
  const PoseJump jump = difference(found->T_a_b, given, i);
  return size_of(jump) > std::max(kLeast, 0.5 * size_of(by_poses)) ? std::optional(jump)
                                                                   : std::nullopt;
}

}  // namespace

PoseJump deviation_at(const Recording& recording, std::size_t i) {
  std::optional<PoseJump> least;
  for (const Pose& expected : expected_motions(recording, i)) {
    const PoseJump jump = difference(expected, motion_to(recording, i), i);
    if (!least || size_of(jump) < size_of(*least)) least = jump;
  }
  return least.value_or(PoseJump{i, 0.0, 0.0});
}

std::vector<PoseJump> find_pose_jumps(const Recording& recording, std::size_t first,
                                      std::size_t last) {
  constexpr std::size_t kMost = 8;
  constexpr double kLeast = 0.2;    // m at points 10 m away
  constexpr double kUnusual = 6.0;  // ratio to the median
  std::vector<PoseJump> candidates;
  std::vector<double> sizes;
  for (std::size_t i = first + 1; i <= last; ++i) {
    candidates.push_back(deviation_at(recording, i));
    sizes.push_back(size_of(candidates.back()));
  }
  const double least = std::max(kLeast, kUnusual * median(std::move(sizes)));
  const auto is_usual = [&](const PoseJump& jump) { return !(size_of(jump) > least); };
  candidates.erase(std::remove_if(candidates.begin(), candidates.end(), is_usual),
                   candidates.end());
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const PoseJump& a, const PoseJump& b) { return size_of(a) > size_of(b); });
  if (candidates.size() > kMost) candidates.resize(kMost);
  std::vector<PoseJump> jumps;
  for (const PoseJump& candidate : candidates) {
    if (const auto jump = confirmed(recording, candidate.scan)) jumps.push_back(*jump);
  }
  std::sort(jumps.begin(), jumps.end(),
            [](const PoseJump& a, const PoseJump& b) { return a.scan < b.scan; });
  return jumps;
}

std::string sentence_on(const Recording& recording, const std::vector<PoseJump>& jumps) {
  constexpr std::size_t kShown = 5;
  std::ostringstream text;
  text::exact(text);
  text << std::fixed << "poses jump " << jumps.size() << (jumps.size() == 1 ? " time" : " times")
       << ", at scan ";
  for (std::size_t i = 0; i < std::min(kShown, jumps.size()); ++i) {
    text << (i > 0 ? ", " : "") << recording.name(jumps[i].scan) << " by " << std::setprecision(2)
         << jumps[i].translation << " m and " << std::setprecision(1) << jumps[i].rotation
         << " deg";
  }
  if (jumps.size() > kShown) text << " and " << jumps.size() - kShown << " more";
  text << "; scans are not compared across a large jump";
  constexpr double kEven = 0.1;  // m at points 10 m away
  const bool are_even = std::all_of(jumps.begin(), jumps.end(),
                                    [](const PoseJump& jump) { return size_of(jump) < kEven; });
  if (are_even) {
    text << "; poses go on evenly there, so that clouds may be missing, or poses of other scans";
  }
  return text.str();
}

}  // namespace dynains
