// Flags that several commands share, and the settings that they give after parsing.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "dynains/compiled_remover.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "dynains/io/recording.hpp"
#include "run/output/output_folder.hpp"
#include "run/settings/parameter_values.hpp"
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
  Recording open() const { return open(folder); }
  /// Opens another folder with these flags.
  Recording open(const std::filesystem::path& other) const;
  /// Opens the recording of a finished run with the flags of the run, as far as the command line
  /// names no others. `command`: the command line without SEQ, for messages. Throws IoError.
  Recording open_of_run(const run::ResultFolder& out, const std::string& command);
  /// Opens the recording without poses, for the odometry. `is_compensated`: see RecordingOptions.
  /// Throws ConfigError if a flag is about poses.
  Recording open_without_poses(bool is_compensated) const;

  std::string folder;
  run::RecordingSettings settings;  ///< with the flags on the command line
};

/// Preset, config file and flags of the remover, in this order of precedence from low to high.
class RemoverOptions {
 public:
  /// This is not moved afterwards: flags refer to it.
  RemoverOptions(CLI::App& command, std::string default_preset);
  RemoverOptions(const RemoverOptions&) = delete;
  RemoverOptions& operator=(const RemoverOptions&) = delete;

  const std::string& preset_name() const { return preset_; }

  /// Empty if none was named.
  const std::string& config_file() const { return config_file_; }

  /// Whether anything but the preset was named.
  bool given() const { return !config_file_.empty() || !flags_.empty(); }

  /// Throws ConfigError.
  DynaInsRemover::Config config() const;
  /// Whether the flag, or a line of that name in the config file, sets a parameter.
  bool sets(const std::string& flag_name) const;

 private:
  std::string preset_;
  std::string config_file_;
  run::ParameterValues flags_;  // that were given
};

/// Flags of an evaluating command, and the settings that they give after parsing.
class EvaluationOptions {
 public:
  /// `unlabeled`: the command's default for points without a class, "ignore" or "static".
  /// `prefix` starts the name of every flag, so that it differs from those of the remover.
  EvaluationOptions(CLI::App& command, std::string unlabeled, const std::string& prefix = "");

  evaluation::EvaluationConfig config() const;

 private:
  evaluation::EvaluationConfig config_;
  double max_range_ = 0;
  CLI::Option* max_range_option_;
  std::string classes_ = evaluation::TruthClasses().dynamic_classes();
  std::string unlabeled_;
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
