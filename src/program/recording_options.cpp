#include "recording_options.hpp"

#include "dynains/errors.hpp"
#include "parameter_flags.hpp"
#include "progress.hpp"
#include "run/json_file.hpp"

namespace dynains::program {
namespace {

constexpr const char* kGroup = "What the files of SEQ mean (dynains check SEQ finds out)";

}  // namespace

RecordingFlags::RecordingFlags(CLI::App& command, const std::string& what, bool required) {
  command
      .add_option("SEQ", folder_,
                  what +
                      ": KITTI or SemanticKITTI folder (velodyne/, poses.txt; optional calib.txt, "
                      "times.txt), folder of scans (.pcd, .ply, .bin, .las, .npy, .xyz or "
                      ".csv) with VIEWPOINT or a file of poses, or log of ROS (.mcap, .db3, .bag, "
                      "or a folder with metadata.yaml)")
      ->required(required)
      ->type_name("");
  RecordingSettings::visit(
      settings_, SettingFlags{command, kGroup, [this](const auto& flag, const auto& text) {
                                settings_.flags[flag] = text;
                              }});
}

Recording RecordingFlags::open_of_run(const std::filesystem::path& report_file,
                                      const nlohmann::ordered_json& report,
                                      const std::string& command) {
  const auto folder = required_json_field<std::string>(report_file, report, "/sequence");
  if (folder_.empty()) folder_ = folder;
  try {
    complete(report.value("sequence_flags", nlohmann::ordered_json::object()));
  } catch (const ConfigError& error) {
    throw IoError(report_file.string() + ": /sequence_flags: " + error.what());
  }
  if (!std::filesystem::exists(folder_)) {
    throw IoError(folder_ + ": no such recording; name the place of the run's recording: " +
                  command + " SEQ");
  }
  return open();
}

Recording RecordingFlags::open(const std::filesystem::path& folder) const {
  Recording recording(folder, settings_.checked());
  for (const std::string& warning : recording.warnings()) print_warning(warning);
  return recording;
}

Recording RecordingFlags::open_without_poses(bool is_compensated) const {
  for (const char* const flag :
       {"--poses", "--invert-poses", "--pose-units", "--pose-scale", "--quaternion-order",
        "--pose-frame", "--left-handed-poses", "--pose-shift", "--extrinsic", "--time-offset",
        "--pose-gap", "--pose-topic", "--pose-frame-id"}) {
    if (!settings_.flags.contains(flag)) continue;
    throw ConfigError(std::string(flag) + " tells of given poses, which the odometry does not use");
  }
  RecordingOptions options = settings_.checked();
  options.without_poses = true;
  options.is_compensated = is_compensated;
  Recording recording(folder_, options);
  for (const std::string& warning : recording.warnings()) print_warning(warning);
  return recording;
}

}  // namespace dynains::program
