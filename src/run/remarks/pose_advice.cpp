#include "pose_advice.hpp"

#include <cmath>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "dynains/io/extrinsic.hpp"
#include "io/text.hpp"
#include "run/settings/parameter_values.hpp"
#include "run/settings/recording_settings.hpp"

namespace dynains::run {
namespace {

/// "12 cm and 0.3 deg over 9 scans".
std::string error_text(const Diagnosis& d) {
  return text::fixed(100.0 * d.translation_error, 0) + " cm and " +
         text::fixed(180.0 / M_PI * d.rotation_error, 1) + " deg " + span_text(d);
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
  if (flaws.step > 0.0) {
    return " The coordinates of the poses are in steps of " + text::fixed(flaws.step, 2) +
           " m: write them with all digits.";
  }
  return "";
}

}  // namespace

std::string proposed_flags(const Recording& recording, const RecordingOptions& proposal) {
  const Changes changes = changes_of(recording, proposal);
  return changes.left_out.empty() ? changes.flags : std::string();
}

std::string span_text(const Diagnosis& d) {
  return d.error_span == 1 ? "from one scan to the next"
                           : "over " + std::to_string(d.error_span) + " scans";
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
               "speaks "
               "against them.";
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

}  // namespace dynains::run
