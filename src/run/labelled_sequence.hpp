// A window of a recording with ground truth and, optionally, the labels of runs over it, as
// the evaluation wants it.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
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
                   std::vector<VerdictFiles> runs = {})
      : sequence_(std::move(recording)), runs_(std::move(runs)) {
    for (const Pose& sensor : sequence_.sensors()) origins_.emplace_back(sensor.translation());
    const std::filesystem::path& folder = sequence_.folder();
    if (!sequence_.has_labels()) {
      throw IoError((folder / "labels").string() +
                    ": no ground truth; expected one NNNNNN.label (uint32 a point) for each scan, "
                    "or a column \"label\"");
    }
    const bool chosen = window.start || window.end;
    const auto inside = [&](std::size_t index) {
      const std::uint64_t number = sequence_.number(index);
      if (chosen)
        return number >= window.start.value_or(0) && number <= window.end.value_or(number);
      return every_run_has(index);
    };
    std::size_t first = 0, last = sequence_.size();
    while (first < last && !inside(first)) ++first;
    while (last > first && !inside(last - 1)) --last;
    for (std::size_t i = first; i < last; ++i) {
      if (sequence_.has_labels(i)) scans_.push_back(i);
    }
    missing_truths_ = last - first - scans_.size();
    if (!scans_.empty()) return;
    if (first < last) throw IoError((folder / "labels").string() + ": no label of any chosen scan");
    throw IoError(chosen ? folder.string() + ": no scan within the chosen window"
                         : runs_.front().folder().string() + ": no labels for any scan of " +
                               folder.string());
  }
  LabelledSequence(const LabelledSequence&) = delete;
  LabelledSequence& operator=(const LabelledSequence&) = delete;

  std::size_t size() const { return scans_.size(); }
  /// Scans of the window without ground truth.
  std::size_t missing_truths() const { return missing_truths_; }

  /// evaluation::ScanSource over the chosen scans. Throws IoError for files that are missing, that
  /// do not match the scan, or that hold labels no run writes.
  bool read(std::size_t i, evaluation::LabelledScan& scan) {
    if (i >= size()) return false;
    const bool is_ahead = reading_.is_busy() && next_index_ == i;
    reading_.wait();
    if (!is_ahead) load(i, next_);
    std::swap(scan_, next_);
    next_index_ = i + 1 < size() ? i + 1 : 0;  // the evaluation reads all scans twice
    reading_.begin([this] { load(next_index_, next_); });

    const std::size_t index = scans_[i];
    scan.xyz = scan_.points.xyzi.data();
    scan.stride = 4;
    scan.sensors = scan_.points.sensor.empty() ? nullptr : scan_.points.sensor.data();
    scan.origins = origins_;
    scan.T_world_sensor = sequence_.T_world_sensor(index);
    scan.truth = scan_.truth;
    scan.in_map = scan_.in_map;
    scan.causes = scan_.causes;
    return true;
  }

 private:
  struct Scan {
    RecordedScan points;
    std::vector<std::uint32_t> truth;
    std::vector<std::uint8_t> in_map;
    std::vector<std::uint8_t> causes;  // of run 0
  };

  bool every_run_has(std::size_t index) const {
    return std::all_of(runs_.begin(), runs_.end(), [&](const VerdictFiles& run) {
      return std::filesystem::exists(run.file(sequence_.name(index)));
    });
  }
  void load(std::size_t i, Scan& scan) const {
    const std::size_t index = scans_[i];
    sequence_.read_scan(index, scan.points);
    scan.truth = sequence_.read_labels(index);
    scan.in_map.assign(runs_.empty() ? 0 : scan.truth.size(), 0);
    const std::string& name = sequence_.name(index);
    for (std::size_t run = 0; run < runs_.size(); ++run) {
      PackedVerdict verdict = runs_[run].read(name, scan.truth.size());
      for (std::size_t p = 0; p < verdict.labels.size(); ++p) {
        const unsigned kept = class_of(verdict.labels[p]) == kRunStatic ? 1U : 0U;
        scan.in_map[p] = static_cast<std::uint8_t>(scan.in_map[p] | kept << run);
      }
      if (run == 0) scan.causes = std::move(verdict.causes);
    }
  }

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
