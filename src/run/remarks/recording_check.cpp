#include "recording_check.hpp"

#include <cmath>
#include <iomanip>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "cloud_remarks.hpp"
#include "dynains/io/trajectory.hpp"
#include "io/text.hpp"
#include "run/settings/parameter_values.hpp"
#include "run/settings/recording_settings.hpp"

namespace dynains::run {
namespace {

using text::fixed;

/// "12 cm and 0.3 deg over 9 scans", with this many digits of the centimetres.
std::string error_text(const Diagnosis& d, int digits = 0) {
  return fixed(100.0 * d.translation_error, digits, " cm and ") +
         fixed(180.0 / M_PI * d.rotation_error, digits + 1, " deg ") +
         (d.error_span == 1 ? "from one scan to the next"
                            : "over " + std::to_string(d.error_span) + " scans");
}

/// A setting as its flag has it; "false" for a flag that is left out. Empty for settings that no
/// proposal changes.
template <class T>
std::string text_of(const Parameter<T>& setting) {
  if constexpr (std::is_floating_point_v<T>) {
    return format_value(std::round(1e4 * setting.value) / 1e4);
  } else {
    return format_value(setting.value);
  }
}
template <class T, class Read>
std::string text_of(const TextParameter<T, Read>& setting) {
  using Value = std::remove_const_t<T>;
  if constexpr (std::is_same_v<Value, double>) {
    return setting.value == 0.001 ? "mm" : setting.value == 0.01 ? "cm" : "m";
  } else if constexpr (std::is_same_v<Value, Pose>) {
    return '"' + extrinsic_text(setting.value) + '"';
  } else if constexpr (std::is_same_v<Value, Eigen::Vector3d>) {
    if (setting.value.isZero(0.0)) return "false";
    std::string text;
    for (const double place : setting.value)
      text += (text.empty() ? "\"" : " ") + format_value(place);
    return text + '"';
  } else {
    return {};
  }
}

struct Changes {
  std::string flags;     ///< to pass
  std::string left_out;  ///< flags that the user has to leave out
  std::string meaning;   ///< of both
};

Changes changes_of(const Recording& recording, const RecordingOptions& proposal) {
  std::vector<std::string> given;
  const RecordingSettings before{recording.options()}, after{proposal};
  RecordingSettings::visit(before, [&](const auto& s) { given.push_back(text_of(s)); });
  Changes changes;
  std::size_t i = 0;
  RecordingSettings::visit(after, [&](const auto& setting) {
    const std::string text = text_of(setting);
    if (text == given[i++]) return;
    const std::string flag = "--" + flag_name(setting.name);
    std::string& flags = text == "false" ? changes.left_out : changes.flags;
    flags += (flags.empty() ? "" : " ") + flag;
    if (text != "false" && text != "true") flags += ' ' + text;
    const std::string help = setting.help;
    changes.meaning +=
        (changes.meaning.empty() ? "" : "; ") + flag + ": " +
        help.substr(0, help.find_last_not_of(' ', help.find_first_of(";:[") - 1) + 1);
  });
  return changes;
}

std::string text_on_proposal(const Recording& recording, const Diagnosis& d) {
  const Changes changes = changes_of(recording, d.proposal);
  const bool has_origin = d.proposal.sensor_origin != recording.options().sensor_origin;
  std::string text = has_origin ? "Beams do not begin at the origin of the scans"
                                : "Scans agree under other options";
  text += " (" + changes.meaning + ')';
  if (!changes.left_out.empty()) text += ": leave out " + changes.left_out;
  if (!changes.flags.empty())
    text += (changes.left_out.empty() ? ": pass " : ", pass ") + changes.flags;
  return text + '.';
}

/// The reason of poses that are inexact or wrong, if they show it.
std::string text_on_flaws(const PoseFlaws& flaws) {
  if (flaws.period > 0) {
    return " Scans " + std::to_string(flaws.period) +
           " apart agree better than neighbours, as those of several sensors on one topic "
           "(--frame-id takes one), or of parts of a turn (record whole turns).";
  }
  if (flaws.has_equal_orientations) {
    return " All orientations of the poses are equal: they have positions alone, or are frozen.";
  }
  return "";
}

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
             "off by " + error_text(d, 1) + ", by the registration of " +
                 std::to_string(d.registered_pairs) + " pairs of scans");
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

std::string proposed_flags(const Recording& recording, const RecordingOptions& proposal) {
  const Changes changes = changes_of(recording, proposal);
  return changes.left_out.empty() ? changes.flags : std::string();
}

std::string advice(const Recording& recording, const Diagnosis& d) {
  switch (d.verdict) {
    case PoseVerdict::kAgree:
      // Without a known mounting, an option for it may be needed.
      return std::string(recording.frame() == PointFrame::kWorld
                             ? "Points are in the frame of the world and agree there"
                             : "Scans and poses agree as they are") +
             (d.mounting.known ? "; no option is needed." : ".");
    case PoseVerdict::kInexact:
      return "Scans and poses agree roughly, but the poses are inexact by about " + error_text(d) +
             ": expect losses." + text_on_flaws(d.flaws);
    case PoseVerdict::kNoMotion:
      if (d.step * static_cast<double>(d.stride) > 1.0 || d.standing.share < 0.5) {
        return "Too few surfaces are beside the way to determine what the poses mean; nothing "
               "speaks against them.";
      }
      return "The sensor hardly moves, so that scans agree whatever the poses mean; nothing speaks "
             "against them.";
    case PoseVerdict::kOtherwise:
      return text_on_proposal(recording, d);
    case PoseVerdict::kDisagree:
      return "Scans do not agree under these poses, nor under any usual mistake: they belong to "
             "another recording or clock, or are far too inexact" +
             (d.registered_pairs > 0 ? " (off by " + error_text(d) + ")." : std::string(".")) +
             text_on_flaws(d.flaws);
    case PoseVerdict::kUnknown:
      return "There is too little to compare: at least two scans with walls, poles or trees within "
             "40 m are needed.";
  }
  return {};
}

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
