// A window of a recording with ground truth and, optionally, the labels of runs over it, as
// the evaluation wants it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evaluation/scan.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/threads/background.hpp"
#include "scan_range.hpp"
#include "verdict_files.hpp"

namespace dynains::run {

/// Reads scan by scan, the next one in another thread; holds two scans at a time.
class LabelledSequence {
 public:
  /// Takes a recording and chooses its scans with ground truth: those within `window`; without a
  /// window, from the first to the last scan that every run has labels for. Throws IoError if no
  /// scan is left.
  LabelledSequence(Recording recording, const ScanWindow& window,
                   std::vector<VerdictFiles> runs = {});
  LabelledSequence(const LabelledSequence&) = delete;
  LabelledSequence& operator=(const LabelledSequence&) = delete;

  std::size_t size() const { return scans_.size(); }
  /// Scans of the window without ground truth.
  std::size_t missing_truths() const { return missing_truths_; }

  /// evaluation::ScanSource over the chosen scans. Throws IoError for files that are missing, that
  /// do not match the scan, or that hold labels no run writes.
  bool read(std::size_t i, evaluation::LabelledScan& scan);

 private:
  struct Scan {
    RecordedScan points;
    std::vector<std::uint32_t> truth;
    std::vector<std::uint8_t> in_map;
    std::vector<std::uint8_t> causes;  // of run 0
  };

  bool every_run_has(std::size_t index) const;
  void load(std::size_t i, Scan& scan) const;

  Recording sequence_;
  std::vector<VerdictFiles> runs_;
  std::vector<Eigen::Vector3d> origins_;  // of several sensors, see LabelledScan
  std::vector<std::size_t> scans_;        // their indices
  std::size_t missing_truths_ = 0;
  Scan scan_;
  Scan next_;  // belongs to the reading thread until reading_.wait()
  std::size_t next_index_ = 0;
  Background reading_;
};

}  // namespace dynains::run
