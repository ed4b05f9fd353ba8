// Flags that several commands share, and the settings that they give after parsing.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "dynains/io/recording.hpp"
#include "run/output/output_folder.hpp"
#include "run/settings/recording_settings.hpp"

namespace dynains::program {

/// The argument SEQ and the flags that describe its files.
struct RecordingFlags {
  /// `what` starts the help of the argument, for example "labelled sequence". This is not moved
  /// afterwards: flags refer to it.
  RecordingFlags(CLI::App& command, const std::string& what, bool required = true);
  RecordingFlags(const RecordingFlags&) = delete;
  RecordingFlags& operator=(const RecordingFlags&) = delete;

  /// Throws IoError, ConfigError. Warns of scans that are left out because they have no pose, and
  /// of a log that ends early.
  Recording open() const;
  /// Opens the recording of a finished run with the flags of the run, as far as the command line
  /// names no others. `command`: the command line without SEQ, for messages. Throws IoError.
  Recording open_of_run(const run::ResultFolder& out, const std::string& command);
  /// Opens the recording without poses, for the odometry. `is_compensated`: see RecordingOptions.
  /// Throws ConfigError if a flag is about poses.
  Recording open_without_poses(bool is_compensated) const;

  std::string folder;
  run::RecordingSettings settings;  ///< with the flags on the command line
};

/// A file for text that takes long to compute. Opening it shows beforehand whether it can be
/// written.
class TextFile {
 public:
  /// Opens it unless `path` is empty: then there is none. Throws IoError.
  TextFile(const std::string& path, bool force, const run::InputFiles& inputs) {
    if (!path.empty()) file_.emplace(path, run::existing_by(force), inputs);
  }

  /// Puts the file in place, whole or not at all. Throws IoError.
  void write(const std::string& text) {
    if (file_) file_->write([&](std::ostream& out) { out << text; });
  }

 private:
  std::optional<run::OutputFile> file_;
};

}  // namespace dynains::program
