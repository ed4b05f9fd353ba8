// How a recording is named on the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "dynains/io/recording.hpp"

namespace dynains::program {

/// The argument SEQ and the flags that describe its files.
class RecordingFlags {
 public:
  /// `what` starts the help of the argument, for example "labelled sequence".
  RecordingFlags(CLI::App& command, const std::string& what);

  const std::string& folder() const { return folder_; }
  RecordingOptions options() const;
  /// Whether a file is named that belongs to one recording only.
  bool names_files() const { return !poses_.empty() || !times_.empty(); }
  /// Throws IoError. Warns of scans that are left out for want of a pose, and of a log that ends
  /// early.
  Recording open() const { return open(folder_); }
  /// Opens another folder with these flags.
  Recording open(const std::filesystem::path& folder) const;

 private:
  std::string folder_;
  std::string poses_;
  std::string times_;
  std::string frame_ = "auto";
  std::string pose_frame_ = "auto";
  std::string units_ = "m";
  std::string quaternion_ = "auto";
  bool invert_ = false;
  bool left_handed_ = false;
  int shift_ = 0;
  bool deskew_ = false;
  std::string cloud_topic_;
  std::string pose_topic_;
  std::string pose_frame_id_;
  std::string scene_;
};

}  // namespace dynains::program
