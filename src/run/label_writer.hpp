// Verdicts as SemanticKITTI-MOS labels and their causes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "dynains/recording/verdict_arrays.hpp"
#include "dynains/verdict.hpp"

namespace dynains::run {

/// Lower 16 bits: 251 moving, 9 static (ground included), 0 not judged. Upper 16 bits: instance,
/// 0 for none; ids beyond 65535 start again at 1.
std::uint32_t mos_label(PointLabel label, std::uint32_t instance);

/// The files of labels of a scan.
class LabelFiles {
 public:
  /// No causes or beliefs are written if their folder is empty.
  explicit LabelFiles(std::filesystem::path labels, std::filesystem::path causes = {},
                      std::filesystem::path beliefs = {});

  /// Creates the folders. Throws IoError.
  void create_folders() const;
  /// Copies a verdict into the form of the files.
  void take(const ScanVerdict& verdict);
  /// Writes the verdict of take() to `labels`/`name`.label, `causes`/`name`.cause and
  /// `beliefs`/`name`.belief (255 is a belief of 1). Throws IoError.
  void write(const std::string& name) const;
  /// Reads what write() wrote for `scan`: ids as far as the files hold them, beliefs in steps of
  /// 1/255, none without a folder of beliefs. Throws IoError.
  void read(const std::string& name, const RecordedScan& scan, VerdictArrays& verdict) const;

 private:
  std::filesystem::path folder_;
  std::filesystem::path cause_folder_;
  std::filesystem::path belief_folder_;
  std::vector<std::uint32_t> labels_;
  std::vector<std::uint8_t> causes_;
  std::vector<std::uint8_t> beliefs_;

  void take_beliefs(Span<const float> beliefs);
};

}  // namespace dynains::run
