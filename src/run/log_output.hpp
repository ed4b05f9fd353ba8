// The log of a recording, written again with its clouds cleaned or marked.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "dynains/io/recording.hpp"
#include "run_plan.hpp"

namespace dynains::program {

/// Where the log of a run goes. It is checked before the work begins, and appears whole, when the
/// results are complete, or not at all.
class LogOutput {
 public:
  /// `outputs.log` is not empty. Throws ConfigError if the recording is no log, or the target no
  /// MCAP; IoError if the run reads the target or must not replace it; UsageError if
  /// another run writes it.
  LogOutput(const RunPlan& plan, bool may_replace);

  /// Copies the log with the labels of the run in `results`. Returns the number of clouds on the
  /// topic that have none, which stay as they are; nothing after a signal. Throws IoError.
  std::optional<std::size_t> write(const std::filesystem::path& results) const;
  /// The written log is at its place. Throws IoError.
  void put_in_place() { file_->put_in_place(); }

 private:
  void check_kind() const;

  const Recording& recording_;
  ScanRange range_;
  std::filesystem::path target_;
  bool adds_labels_;
  bool drops_not_judged_;
  std::optional<OutputFile> file_;
};

}  // namespace dynains::program
