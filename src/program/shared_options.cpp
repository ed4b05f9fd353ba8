#include "command.hpp"
#include "dynains/errors.hpp"
#include "parameter_flags.hpp"
#include "program.hpp"

namespace dynains::program {

RecordingFlags::RecordingFlags(CLI::App& command, const std::string& what, bool required) {
  command
      .add_option("SEQ", folder,
                  what +
                      ": KITTI or SemanticKITTI folder (velodyne/, poses.txt; optional calib.txt, "
                      "times.txt), folder of scans (.pcd, .ply, .bin, .las, .npy, .xyz or "
                      ".csv) with VIEWPOINT or a file of poses, or log of ROS (.mcap, .db3, .bag, "
                      "or a folder with metadata.yaml)")
      ->required(required)
      ->type_name("");
  RecordingSettings::visit(
      settings,
      SettingFlags{command, "What the files of SEQ mean (dynains check SEQ finds out)",
                   [this](const auto& flag, const auto& text) { settings.flags[flag] = text; }});
}

Recording RecordingFlags::open_of_run(const ResultFolder& out, const std::string& command) {
  if (folder.empty()) folder = out.field<std::string>("/sequence");
  try {
    settings.complete(out.marker().value("sequence_flags", nlohmann::ordered_json::object()));
  } catch (const ConfigError& error) {
    throw IoError(out.marker_path().string() + ": /sequence_flags: " + error.what());
  }
  if (!std::filesystem::exists(folder)) {
    throw IoError(
        folder + ": no such recording; name the place of the run's recording: " + command + " SEQ");
  }
  return open();
}

Recording RecordingFlags::open_with(const RecordingOptions& options) const {
  Recording recording(folder, options);
  for (const std::string& warning : recording.warnings()) print_warning(warning);
  return recording;
}

Recording RecordingFlags::open_without_poses(bool is_compensated) const {
  for (const char* const flag :
       {"--poses", "--invert-poses", "--pose-units", "--pose-scale", "--quaternion-order",
        "--pose-frame", "--left-handed-poses", "--pose-shift", "--extrinsic", "--time-offset",
        "--pose-gap", "--pose-topic", "--pose-frame-id"}) {
    if (!settings.flags.contains(flag)) continue;
    throw ConfigError(std::string(flag) + " is about given poses, which the odometry does not use");
  }
  RecordingOptions options = settings.checked();
  options.without_poses = true;
  options.is_compensated = is_compensated;
  return open_with(options);
}

}  // namespace dynains::program
