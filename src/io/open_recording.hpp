// Opening a recording: its format, and its scans with poses and times.
#pragma once

#include <filesystem>
#include <memory>

#include "dynains/io/recording.hpp"
#include "scan_reader.hpp"

namespace dynains {

struct OpenedRecording {
  RecordingContents contents;
  std::unique_ptr<ScanReader> reader;
};

/// Reads and checks all files except points and labels. Throws IoError with path, position and
/// expected content, and ConfigError for options that are for recordings of another format.
OpenedRecording open_recording(const std::filesystem::path& path, const RecordingOptions& options);

}  // namespace dynains
