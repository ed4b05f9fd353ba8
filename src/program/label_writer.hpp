// Verdicts as SemanticKITTI-MOS labels, written behind the pipeline's back.
#pragma once

#include <cstdint>
#include <filesystem>
#include <future>
#include <string>
#include <vector>

#include "dynains/scan_verdict.hpp"

namespace dynains::program {

/// Lower 16 bits: 251 moving, 9 static (ground included), 0 not judged. Upper 16 bits: instance,
/// 0 for none; ids beyond 65535 start again at 1.
std::uint32_t mos_label(PointLabel label, std::uint32_t instance);

/// One thread at most; one scan at most waits for the disk.
class LabelWriter {
 public:
  /// Creates the folder. Throws IoError.
  explicit LabelWriter(std::filesystem::path folder);
  LabelWriter(const LabelWriter&) = delete;
  LabelWriter& operator=(const LabelWriter&) = delete;

  /// Writes `folder`/`name`.label. Throws IoError, for the scan before as well.
  void write(const std::string& name, const ScanVerdict& verdict);
  /// Waits for the last file. Throws IoError.
  void finish();

 private:
  std::filesystem::path folder_;
  std::vector<std::uint32_t> labels_;  // the writing thread's, while pending_ is valid
  std::future<void> pending_;
};

}  // namespace dynains::program
