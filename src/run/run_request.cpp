#include "run_request.hpp"

#include <string>

#include "dynains/version.hpp"
#include "io/fingerprint.hpp"

namespace dynains::program {
namespace {

constexpr const char* kPosesAndTimes = "poses_and_times";

using Json = nlohmann::ordered_json;

/// Which fields of two requests differ, the first few with both values; empty if none does.
std::string differences(const Json& earlier, const Json& now) {
  constexpr std::size_t kShown = 3;
  const Json before = earlier.flatten();
  const Json after = now.flatten();
  std::size_t count = 0;
  std::string text;
  const auto add = [&](const std::string& path, const std::string& was, const std::string& is) {
    if (++count > kShown) return;
    const std::string name = path.substr(path.rfind('/') + 1);
    if (count > 1) text += ", ";
    // The values are fingerprints, which a reader cannot interpret.
    text += name == kPosesAndTimes ? "poses or times differ" : name + " was " + was + ", is " + is;
  };
  for (const auto& [path, value] : after.items()) {
    const auto found = before.find(path);
    if (found == before.end()) {
      add(path, "not known", value.dump());
    } else if (*found != value) {
      add(path, found->dump(), value.dump());
    }
  }
  for (const auto& [path, value] : before.items()) {
    if (!after.contains(path)) add(path, value.dump(), "not known");
  }
  if (count > kShown) text += ", and " + std::to_string(count - kShown) + " more";
  return text;
}

}  // namespace

std::string pose_fingerprint(const Recording& recording, const ScanRange& range) {
  Fingerprint result;
  for (std::size_t i = range.first; i <= range.last; ++i) {
    result.add(recording.name(i));
    result.add(recording.time(i));
    const Eigen::Matrix4d pose = recording.T_world_sensor(i).matrix();
    for (Eigen::Index k = 0; k < pose.size(); ++k) result.add(pose(k));
  }
  return result.text();
}

nlohmann::ordered_json describe_request(const Recording& recording, const ScanRange& range,
                                        const RunOutputs& outputs,
                                        const nlohmann::ordered_json& configuration) {
  return {{"version", kVersionString},
          {"first_scan", recording.name(range.first)},
          {"last_scan", recording.name(range.last)},
          {kPosesAndTimes, pose_fingerprint(recording, range)},
          {"points_in_world", recording.frame() == PointFrame::kWorld},
          {"deskew", recording.is_deskewed()},
          {"map", outputs.map_name()},
          {"map_attributes", outputs.map_attributes},
          {"crs", outputs.crs},
          {"write_online", outputs.write_online},
          {"write_clean", outputs.write_clean},
          {"drop_not_judged", outputs.drop_not_judged},
          {"write_mcap", outputs.write_mcap},
          {"write_beliefs", outputs.write_beliefs},
          {"configuration", configuration}};
}

std::string request_differences(const nlohmann::ordered_json& report,
                                const nlohmann::ordered_json& request) {
  const auto expected = Json::parse(request.dump(-1, ' ', false, Json::error_handler_t::replace));
  const bool has_request = report.is_object() && report.contains("request");
  return has_request ? differences(report["request"], expected)
                     : "report.json does not tell of them";
}

}  // namespace dynains::program
