#include "run_doubts.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <optional>
#include <ostream>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/parameters.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "dynains/surfaces/landmarks.hpp"
#include "dynains/surfaces/scan_registration.hpp"
#include "io/text.hpp"
#include "run/recorded_scans.hpp"

namespace dynains::run {
namespace {

using Json = nlohmann::ordered_json;

/// Scans in a row that no correct recording gives.
struct SuspiciousScans {
  std::size_t first;   // scan of the recording
  Plausibility worst;  // the first window, with the largest shares of all
  std::size_t count = 0;
};

/// A scan that begins an epoch because its surfaces do not fit, and how far its motion lies from
/// those beside it.
struct PoseJump {
  std::size_t scan;
  double metres, degrees;
};

std::string percent(float share) { return std::to_string(std::lround(100.0F * share)) + " %"; }

/// How far the given motion to scan `i` (from 1) lies from the nearer one of the motions before and
/// after it.
PoseJump jump_at(const Recording& recording, std::size_t i) {
  std::optional<PoseJump> least;
  for (const std::size_t k : {i - 1, i + 1}) {
    if (k == 0 || k >= recording.size()) continue;
    const Pose E =
        motion_between(recording, k - 1, k).inverse() * motion_between(recording, i - 1, i);
    const PoseJump jump{i, E.translation().norm(), 180.0 / M_PI * angle_of(E.linear())};
    if (!least || jump.metres < least->metres) least = jump;
  }
  return least.value_or(PoseJump{i, 0.0, 0.0});
}

/// "poses jump 2 times, at scan 000030 by 1.50 m and 0.0 deg, ...": at most five of them.
std::string text_of(const std::vector<PoseJump>& jumps, const Recording& recording) {
  constexpr std::size_t kShown = 5;
  std::string text = "poses jump " + std::to_string(jumps.size()) +
                     (jumps.size() == 1 ? " time" : " times") + ", at scan ";
  for (std::size_t i = 0; i < std::min(kShown, jumps.size()); ++i) {
    text += (i > 0 ? ", " : "") + recording.name(jumps[i].scan) + " by " +
            text::fixed(jumps[i].metres, 2) + " m and " + text::fixed(jumps[i].degrees, 1) + " deg";
  }
  if (jumps.size() > kShown) text += " and " + std::to_string(jumps.size() - kShown) + " more";
  return text + "; scans are not compared across a large jump";
}

std::string text_of(const SuspiciousScans& part, const Recording& recording) {
  const Plausibility& worst = part.worst;
  const std::string since = "suspicious since scan " + recording.name(part.first) + ": ";
  switch (worst.suspicion) {
    case Suspicion::kNone:
      return {};
    case Suspicion::kUnits:
      return since + percent(worst.not_judged) +
             " of the points cannot be judged; are they in metres (--point-units), in the frame of "
             "the sensor (--frame world), within --max-range?";
    case Suspicion::kPoses:
      return since + "scans do not fit to each other under the poses (" + percent(worst.misfits) +
             " of the scans begin anew, residual " +
             text::fixed(static_cast<double>(worst.residual), 2) + " m" +
             "): the poses are wrong, inexact or those of another body; see: dynains check";
    case Suspicion::kRays:
      break;
  }
  const bool may_be_skewed = recording.columns().time && !recording.is_deskewed();
  return since + "beams pass through " + percent(worst.ground_free) + " of the ground and " +
         percent(worst.instance_free) + " of the points above it: " +
         (may_be_skewed ? "points may keep the frames of their times (--deskew), or " : "") +
         "rays may not begin at the origin of the clouds (--sensor-origin), poses be inexact, or "
         "many points be noise; see: dynains check";
}

Json json_of(const SuspiciousScans& part, const Recording& recording) {
  return {{"suspicion", plain_value(part.worst.suspicion)},
          {"first_scan", recording.name(part.first)},
          {"scans", part.count},
          {"not_judged", part.worst.not_judged},
          {"ground_free", part.worst.ground_free},
          {"instance_free", part.worst.instance_free},
          {"misfits", part.worst.misfits},
          {"residual_metres", part.worst.residual}};
}

Json json_of(const ReturnError& error, const Recording& recording) {
  return {{"earlier", {recording.name(error.first_earlier), recording.name(error.last_earlier)}},
          {"later", {recording.name(error.first_later), recording.name(error.last_later)}},
          {"metres", error.metres},
          {"degrees", error.degrees}};
}

/// At most one part for each kind: the first one.
void add(const Plausibility& window, std::size_t first, std::vector<SuspiciousScans>& parts) {
  if (window.suspicion == Suspicion::kNone) return;
  auto part = std::find_if(parts.begin(), parts.end(), [&](const SuspiciousScans& one) {
    return one.worst.suspicion == window.suspicion;
  });
  if (part == parts.end()) {
    part = parts.insert(part, {first + static_cast<std::size_t>(window.since), window});
  }
  ++part->count;
  part->worst.raise_shares(window);
}

std::size_t distance(std::size_t a, std::size_t b) { return a > b ? a - b : b - a; }

void add(std::vector<ReturnError>& errors, std::size_t earlier, std::size_t later, double metres,
         double degrees) {
  constexpr std::size_t kNear = 100;  // scans
  const auto is_near = [&](const ReturnError& error) {
    return distance(earlier, error.last_earlier) <= kNear && later - error.last_later <= kNear;
  };
  const auto found = std::find_if(errors.rbegin(), errors.rend(), is_near);
  if (found == errors.rend()) {
    errors.push_back({earlier, earlier, later, later, metres, degrees});
    return;
  }
  found->first_earlier = std::min(found->first_earlier, earlier);
  found->last_earlier = std::max(found->last_earlier, earlier);
  found->last_later = later;
  if (metres <= found->metres) return;
  found->metres = metres;
  found->degrees = degrees;
}

}  // namespace

std::vector<ReturnToPlace> find_returns(const Recording& recording,
                                        const std::filesystem::path& folder) {
  ByteStore store(folder);
  Returns returns(store, FreeSpaceConfig());
  PointBuffer points;
  std::vector<PointLabel> all_static;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    copy_points(recording.read_scan(i), points);
    all_static.assign(points.size(), PointLabel::kStatic);
    returns.add(points, all_static, {orthonormalized(recording.T_world_sensor(i)), i == 0});
  }
  return returns.found();
}

std::vector<ReturnError> return_errors(const Recording& recording, std::size_t first,
                                       const std::vector<ReturnToPlace>& returns) {
  std::vector<ReturnError> errors;
  for (const ReturnToPlace& place : returns) {
    if (!place.is_known()) continue;
    const std::size_t earlier = first + place.earlier, later = first + place.later;
    const Pose T_error = recording.T_world_sensor(later).inverse() *
                         recording.T_world_sensor(earlier) * place.T_earlier_later;
    const double metres = T_error.translation().norm();
    const double degrees = 180.0 / M_PI * angle_of(T_error.linear());
    if (metres >= kAgreeing) add(errors, earlier, later, metres, degrees);
  }
  return errors;
}

std::string sentence(const ReturnError& error, const Recording& recording) {
  const auto names = [&](std::size_t first, std::size_t last) {
    if (first == last) return "scan " + recording.name(first);
    return "scans " + recording.name(first) + " to " + recording.name(last);
  };
  return "the trajectory returns to " + names(error.first_earlier, error.last_earlier) + " in " +
         names(error.first_later, error.last_later) + " with an error of " +
         text::fixed(error.metres, 2) + " m and " + text::fixed(error.degrees, 1) + " deg";
}

void write_closures(std::ostream& text, const std::vector<ReturnToPlace>& returns) {
  text << std::setprecision(9);
  for (const ReturnToPlace& place : returns) {
    if (!place.is_known()) continue;
    const Eigen::Quaterniond q(Eigen::Matrix3d(place.T_earlier_later.linear()));
    const Eigen::Vector3d t = place.T_earlier_later.translation();
    text << "EDGE_SE3:QUAT " << place.earlier << ' ' << place.later << ' ' << t.x() << ' ' << t.y()
         << ' ' << t.z() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << q.w();
    // g2o counts a rotation as the vector of its quaternion: half of its angle.
    Eigen::Matrix<double, 6, 6> scale = Eigen::Matrix<double, 6, 6>::Identity();
    scale.bottomRows<3>() *= 0.5;
    const Eigen::Map<const Eigen::Matrix<double, 6, 6>> covariance(place.covariance.data());
    const Eigen::Matrix<double, 6, 6> information = (scale * covariance * scale).inverse();
    for (Eigen::Index i = 0; i < 6; ++i) {
      for (Eigen::Index j = i; j < 6; ++j) text << ' ' << information(i, j);
    }
    text << '\n';
  }
}

RunDoubts find_doubts(const Recording& recording, const ScanRange& range, const RunTiming& timing,
                      const std::vector<ReturnError>& returns) {
  std::vector<PoseJump> jumps;
  std::vector<SuspiciousScans> parts;
  for (std::size_t k = 0; k < timing.rows.size(); ++k) {
    const TimingRow& row = timing.rows[k];
    const bool is_misfit =
        row.began_epoch == EpochReason::kJump || row.began_epoch == EpochReason::kMisfit;
    if (is_misfit && k > 0) jumps.push_back(jump_at(recording, range.first + k));
    add(row.plausibility, range.first, parts);
  }
  RunDoubts doubts;
  Json& json = doubts.json;
  json = {{"jumps", Json::array()}, {"suspicious", Json::array()}, {"returns", Json::array()}};
  if (!jumps.empty()) doubts.sentences.push_back(text_of(jumps, recording));
  for (const PoseJump& jump : jumps) {
    json["jumps"].push_back(
        {{"scan", recording.name(jump.scan)}, {"metres", jump.metres}, {"degrees", jump.degrees}});
  }
  for (const SuspiciousScans& part : parts) {
    doubts.sentences.push_back(text_of(part, recording));
    json["suspicious"].push_back(json_of(part, recording));
  }
  for (const ReturnError& error : returns) {
    doubts.sentences.push_back(sentence(error, recording) +
                               ": what moved is not compared there; see: dynains check --closures");
    json["returns"].push_back(json_of(error, recording));
  }
  return doubts;
}

}  // namespace dynains::run
