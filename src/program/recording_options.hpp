// How a recording is named on the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "dynains/io/recording.hpp"
#include "run/recording_settings.hpp"

namespace dynains::program {

/// The argument SEQ and the flags that describe its files.
class RecordingFlags {
 public:
  /// `what` starts the help of the argument, for example "labelled sequence". This is not moved
  /// afterwards: flags refer to it.
  RecordingFlags(CLI::App& command, const std::string& what, bool required = true);
  RecordingFlags(const RecordingFlags&) = delete;
  RecordingFlags& operator=(const RecordingFlags&) = delete;

  const std::string& folder() const { return folder_; }
  /// Throws ConfigError.
  const RecordingOptions& options() const { return settings_.checked(); }
  /// The flags on the command line that describe the files of the recording, with their values.
  const nlohmann::ordered_json& given_flags() const { return settings_.flags; }
  /// See RecordingSettings.
  std::string as_given(const std::string& further = "") const {
    return settings_.as_given(folder_, further);
  }
  void complete(const nlohmann::ordered_json& flags) { settings_.complete(flags); }
  /// Whether a file is named that belongs to one recording only.
  bool names_files() const {
    return !settings_.options.poses.empty() || !settings_.options.times.empty();
  }
  /// Throws IoError. Warns of scans that are left out because they have no pose, and of a log that
  /// ends early.
  Recording open() const { return open(folder_); }
  /// Opens another folder with these flags.
  Recording open(const std::filesystem::path& folder) const;
  /// Opens the recording of a finished run with the flags of the run, as far as the command line
  /// names no others. `report`: content of `report_file`. `command`: the command line without SEQ,
  /// for messages. Throws IoError.
  Recording open_of_run(const std::filesystem::path& report_file,
                        const nlohmann::ordered_json& report, const std::string& command);
  /// Opens the folder without poses. `is_compensated`: see RecordingOptions. Throws ConfigError for
  /// flags that tell of poses, and IoError.
  Recording open_without_poses(bool is_compensated) const;

 private:
  std::string folder_;
  RecordingSettings settings_;
};

}  // namespace dynains::program
