// One pass or two: whether verdicts of the stream are final, or revised by the whole recording.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "dynains/map/static_map_accumulator.hpp"
#include "dynains/recording/second_pass.hpp"
#include "verdict_files.hpp"

namespace dynains::run {

struct RunPlan;
class RunResults;

/// Keeps the verdicts of the stream for a second pass, or takes them as final. Functions throw
/// IoError.
class Passes {
 public:
  /// Two, if `plan` asks for them and the recording is longer than what the first one compares. The
  /// plan outlives this. Data waits in files without a name in `folder`.
  Passes(const RunPlan& plan, const std::filesystem::path& folder);

  /// Whether verdicts of the stream are final.
  bool is_one() const { return !second_; }
  /// Takes the verdict of the stream on the next scan: without `packed` and `truth`.
  void add(const JudgedScan& judged);
  /// After the last scan: revises the verdicts of two passes, and hands them to `results`. A signal
  /// ends the revision; verdicts then stay as they are. Calls `progress` before the first scan and
  /// after each.
  void finish(RunResults& results, const std::function<void(std::size_t done)>& progress);
  /// Whether no signal has ended finish().
  bool is_complete() const { return !second_ || second_->is_decided(); }
  const std::vector<ReturnToPlace>& returns() const {
    return second_ ? second_->returns() : returns_.found();
  }
  /// Configuration of the map that two passes build.
  const StaticMapAccumulator::Config& map_config() const;
  /// The field "second_pass" of the report; null for one pass.
  nlohmann::ordered_json report() const;

 private:
  const RunPlan& plan_;
  ByteStore store_;
  Returns returns_;  // of one pass
  std::optional<SecondPass> second_;
  PointStore verdicts_;  // of the stream, for the second pass
  PackedVerdict packed_;
};

}  // namespace dynains::run
