#include "recording_check.hpp"

#include <cmath>
#include <iomanip>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "cloud_remarks.hpp"
#include "dynains/io/extrinsic.hpp"
#include "dynains/poses/ray_origin.hpp"
#include "dynains/poses/sensor_agreement.hpp"
#include "io/text.hpp"
#include "odd_scans.hpp"
#include "pose_advice.hpp"

namespace dynains::run {
namespace {

using text::fixed;

void add_line(std::ostream& text, const std::string& what, const std::string& value) {
  text << std::left << std::setw(20) << what << value << '\n';
}

std::string to_text(const Agreement& agreement) {
  if (agreement.points == 0) return "nothing to compare";
  return fixed(100.0 * agreement.share, 0, " %") + " of points agree, gap " +
         fixed(100.0 * agreement.gap, 0, " cm");
}

std::string text_of(const Mounting& mounting) {
  if (!mounting.known) return "no ground found";
  std::string text =
      fixed(mounting.height, 2, " m over ground, tilted by ") + fixed(mounting.tilt(), 1, " deg");
  if (mounting.tilt() > 90.0) text += " (upside down)";
  return text;
}

/// A line for each of several sensors, and the pose of the one that is off most. Of two, the first
/// is the reference.
void add_sensors(const Recording& recording, std::ostream& text) {
  const std::vector<SensorAgreement> sensors = compare_sensors(recording);
  const SensorAgreement* worst = nullptr;
  std::size_t number = 0;
  for (std::size_t k = 0; k < sensors.size(); ++k) {
    const SensorAgreement& one = sensors[k];
    add_line(text, "sensor " + std::to_string(k),
             fixed(one.points, 0, " points a scan, of which ") +
                 fixed(100.0 * one.fit_of_scans, 0, " % fit to its other scans, ") +
                 fixed(100.0 * one.fit_of_others, 0, " % to the other sensors"));
    const bool is_reference = k == 0 && sensors.size() == 2;
    if (is_reference || !one.is_off() || (worst != nullptr && one.distance <= worst->distance)) {
      continue;
    }
    worst = &one;
    number = k;
  }
  if (worst == nullptr) return;
  text << "note: sensor " << number << " is off by "
       << fixed(100.0 * worst->distance, 1, " cm and ")
       << fixed(180.0 / M_PI * worst->angle, 2, " deg")
       << " from where its points fit to those of the others: its row of --sensors would be\n      "
       << extrinsic_text(worst->T_cloud_sensor) << '\n';
}

/// Possible problems of a run other than poses.
void add_remarks(std::ostream& text, const Diagnosis& d) {
  if (d.invalid_share > 0.5) {
    text << "note: more than half of the points are NaN, infinite or zero\n";
  }
  if (d.farthest > 1000.0) {
    text << "note: ranges beyond 1 km: points seem not to be in metres (--point-units mm, cm), or "
            "not in the frame of the sensor (--frame world)\n";
  } else if (d.farthest > 0.0 && d.farthest < 2.0) {
    text << "note: all ranges are below 2 m: points seem not to be in metres\n";
  }
}

/// Adds the findings that need more scans than the diagnosis reads. Throws IoError.
void add_findings_in_scans(const Recording& recording, const Diagnosis& d,
                           const std::vector<ScanCounts>& counts, std::ostream& text) {
  if (recording.size() == 0) return;
  for (const std::string& odd : remarks_on_odd_scans(recording, 0, counts, d.sound())) {
    text << "note: " << odd << '\n';
  }
  for (const std::string& remark :
       remarks_on_clouds(recording, whole_of(recording), !d.mounting.known)) {
    text << "note: " << remark << '\n';
  }
}

std::string describe(const Recording& recording, const Diagnosis& d,
                     const std::vector<ScanCounts>& counts) {
  std::ostringstream text;
  add_line(text, "scans",
           std::to_string(d.scan_files) + " files, " + std::to_string(d.pose_rows) + " poses, " +
               std::to_string(d.scans) + " scans with a pose");
  for (const std::string& note : recording.notes()) add_line(text, "", note);
  for (const std::string& warning : recording.warnings()) add_line(text, "", "note: " + warning);
  add_line(text, "time", fixed(d.period, 3, " s from scan to scan"));
  add_line(text, "points",
           fixed(d.points, 0, " a scan, ") + fixed(100.0 * d.invalid_share, 1) + " % invalid, " +
               fixed(100.0 * d.ego_share, 1) + " % nearer than 2 m, 99 % within " +
               fixed(d.farthest, 0, " m"));
  add_line(text, "sensor", text_of(d.mounting));
  add_sensors(recording, text);
  add_line(text, "motion",
           "median " + fixed(d.step, 2, " m from scan to scan, longest ") +
               fixed(d.longest_step, 2, " m"));
  if (d.registered_pairs > 0) {
    add_line(text, "poses",
             "off by " + fixed(100.0 * d.translation_error, 1, " cm and ") +
                 fixed(180.0 / M_PI * d.rotation_error, 2, " deg ") + span_text(d) +
                 ", by the registration of " + std::to_string(d.registered_pairs) +
                 " pairs of scans");
  }
  text << "\nscans " << d.stride << " apart, placed by\n";
  add_line(text, "  poses as given", to_text(d.as_given));
  add_line(text, "  no motion at all", to_text(d.standing));
  text << '\n';
  add_remarks(text, d);
  add_findings_in_scans(recording, d, counts, text);
  return text.str();
}

/// Judges the poses as `dynains check` does, unless a few places confirm them.
void check_poses(const Recording& recording, StartCheck& result) {
  const bool is_usual =
      recording.frame() == PointFrame::kSensor && recording.sensor_origin().isZero(0.0);
  if (is_usual && are_poses_exact(recording) && !other_ray_origin(recording)) return;
  Diagnosis d = diagnose(recording, /*pairs=*/3);
  if (d.verdict == PoseVerdict::kUnknown) d = diagnose(recording);  // the places may be empty
  if (d.verdict == PoseVerdict::kAgree || d.verdict == PoseVerdict::kNoMotion) return;
  const bool may_run = d.sound() || d.verdict == PoseVerdict::kUnknown;
  (may_run ? result.warnings.emplace_back() : result.refusal) = advice(recording, d);
}

}  // namespace

RecordingCheck check_recording(const Recording& recording) {
  std::vector<ScanCounts> counts;
  if (recording.size() > 0) counts = count_points(recording, whole_of(recording));
  RecordingCheck check;
  check.diagnosis = diagnose(recording);
  const bool sound = check.diagnosis.sound();
  check.findings = describe(recording, check.diagnosis, counts);
  std::optional<std::string> lone;
  if (recording.size() > 1) {
    lone = remark_on_lone_scans(recording, whole_of(recording), RemoverConfig());
  }
  check.passed = sound && !lone;
  if (!lone || !sound) check.advice = advice(recording, check.diagnosis) + '\n';
  check.flags = proposed_flags(recording, check.diagnosis.proposal);
  if (lone) check.remark = *lone + ".\n";
  return check;
}

StartCheck check_start(const Recording& recording, const ScanRange& range,
                       const RemoverConfig& config, bool accepts_poses) {
  constexpr std::size_t kMinScans = 8;
  StartCheck result;
  const bool are_judged = !accepts_poses && !recording.options().without_poses;
  if (are_judged && range.size() >= kMinScans) check_poses(recording, result);
  if (!result.refusal.empty()) return result;
  const auto lone = remark_on_lone_scans(recording, range, config);
  if (lone) result.warnings.push_back(*lone);
  const bool seeks_ground =
      config.level && config.mounting_pitch == 0.0 && config.mounting_roll == 0.0;
  const auto remarks = remarks_on_clouds(recording, range, seeks_ground);
  result.warnings.insert(result.warnings.end(), remarks.begin(), remarks.end());
  return result;
}

}  // namespace dynains::run
