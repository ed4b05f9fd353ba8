#include "recording_options.hpp"

#include <utility>

#include "dynains/errors.hpp"
#include "parameter_flags.hpp"
#include "progress.hpp"
#include "run/json_file.hpp"

namespace dynains::program {
namespace {

constexpr const char* kGroup = "What the files of SEQ mean (dynains check SEQ finds out)";

/// `word` as a shell reads it back.
std::string quoted(const std::string& word) {
  constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

RecordingFlags::RecordingFlags(CLI::App& command, const std::string& what, bool required)
    : command_(&command) {
  command
      .add_option("SEQ", folder_,
                  what +
                      ": KITTI or SemanticKITTI folder (velodyne/, poses.txt; optional calib.txt, "
                      "times.txt), folder of scans (.pcd, .ply, .bin, .las, .npy, .xyz or "
                      ".csv) with VIEWPOINT or a file of poses, or log of ROS (.mcap, .db3, .bag, "
                      "or a folder with metadata.yaml)")
      ->required(required)
      ->type_name("");
  RecordingSettings::visit(settings_, SettingFlags{command, kGroup});
}

nlohmann::ordered_json RecordingFlags::given_flags() const {
  auto flags = nlohmann::ordered_json::object();
  for (const CLI::Option* option : std::as_const(*command_).get_options()) {
    if (option->get_group() == kGroup && option->count() > 0) {
      flags[option->get_name()] = option->results().front();
    }
  }
  return flags;
}

void RecordingFlags::complete(const std::string& folder, const nlohmann::ordered_json& flags) {
  if (folder_.empty()) folder_ = folder;
  for (const auto& [name, value] : flags.items()) {
    CLI::Option* const option = command_->get_option(name);
    if (option->get_group() != kGroup) throw CLI::OptionNotFound(name);
    if (option->count() > 0 || !value.is_string()) continue;
    option->add_result(value.get<std::string>());
    option->run_callback();
  }
}

std::string RecordingFlags::as_given(const std::string& further) const {
  std::string text = quoted(folder_);
  for (const CLI::Option* option : command_->get_options()) {
    const std::string flag = option->get_name();
    const bool is_replaced = (' ' + further + ' ').find(' ' + flag + ' ') != std::string::npos;
    if (option->get_group() != kGroup || option->count() == 0 || is_replaced) continue;
    text += ' ' + flag;
    if (option->get_expected_max() == 0) continue;
    for (const std::string& value : option->results()) text += ' ' + quoted(value);
  }
  return further.empty() ? text : text + ' ' + further;
}

Recording RecordingFlags::open_of_run(const std::filesystem::path& report_file,
                                      const nlohmann::ordered_json& report,
                                      const std::string& command) {
  try {
    complete(required_json_field<std::string>(report_file, report, "/sequence"),
             report.value("sequence_flags", nlohmann::ordered_json::object()));
  } catch (const CLI::Error& error) {
    throw IoError(report_file.string() + ": /sequence_flags: " + error.what());
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
    if (command_->get_option(flag)->count() == 0) continue;
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
