#include "shared_options.hpp"

#include <algorithm>
#include <utility>

#include "dynains/errors.hpp"
#include "parameter_flags.hpp"
#include "progress.hpp"
#include "run/run_settings.hpp"

namespace dynains::program {

using namespace run;

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

Recording RecordingFlags::open(const std::filesystem::path& other) const {
  Recording recording(other, settings.checked());
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
  Recording recording(folder, options);
  for (const std::string& warning : recording.warnings()) print_warning(warning);
  return recording;
}

RemoverOptions::RemoverOptions(CLI::App& command, std::string default_preset)
    : preset_(std::move(default_preset)) {
  command
      .add_option(
          "--preset", preset_,
          "parameters to start from; offline: for recordings, verdicts wait for 100 later scans")
      ->check(CLI::IsMember(preset_names()))
      ->capture_default_str();
  command.add_option("--config", config_file_, "config file, see dynains config");
  const auto defaults = DynaInsRemover::Config::preset(preset_);
  DynaInsRemover::Config::visit_sections(defaults, [&](const char* group, const auto& section) {
    add_parameter_flags(command, section, group, flags_);
  });
}

DynaInsRemover::Config RemoverOptions::config() const {
  DynaInsRemover::Config config = DynaInsRemover::Config::preset(preset_);
  if (!config_file_.empty()) read_config_file(config_file_).apply(config);
  flags_.apply(config);
  config.validate();
  return config;
}

bool RemoverOptions::sets(const std::string& flag_name) const {
  return flags_.has(flag_name) ||
         (!config_file_.empty() && read_config_file(config_file_).has(flag_name));
}

EvaluationOptions::EvaluationOptions(CLI::App& command, std::string unlabeled,
                                     const std::string& prefix)
    : unlabeled_(std::move(unlabeled)) {
  using evaluation::EvaluationConfig;
  EvaluationConfig::visit(config_, [&](const auto& parameter) {
    std::string name = parameter.name;
    if (name == "max_range" || name == "point_max_range") return;
    std::replace(name.begin(), name.end(), '_', '-');
    command.add_option("--" + prefix + name, parameter.value, std::string(parameter.help) + " [m]")
        ->capture_default_str();
  });
  max_range_option_ = command.add_option(
      "--" + prefix + "max-range", max_range_,
      "points at a larger planar range are not judged, 0 = no limit [m] (PR and RR: 0; SA, DA and "
      "error analysis: 50)");
  command
      .add_option("--" + prefix + "classes", classes_,
                  "dynamic class ids of the ground truth, for example 252-257,259")
      ->capture_default_str();
  command
      .add_option("--" + prefix + "unlabeled", unlabeled_,
                  "points of class 0 and 1: ignore them, or count them as static as the published "
                  "tables do")
      ->check(CLI::IsMember({"ignore", "static"}))
      ->capture_default_str();
}

evaluation::EvaluationConfig EvaluationOptions::config() const {
  evaluation::EvaluationConfig config = config_;
  if (max_range_option_->count() > 0) config.max_range = config.point_max_range = max_range_;
  config.truth =
      evaluation::TruthClasses(classes_, value_of_name<evaluation::Unlabeled>(unlabeled_).value());
  config.validate();
  return config;
}

}  // namespace dynains::program
