// The results of a run: verdicts as they come, handed to all that is made of them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <vector>

#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "dynains/recording/second_pass.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/threads/background.hpp"
#include "dynains/verdict.hpp"
#include "map_file.hpp"
#include "overview.hpp"
#include "run/remarks/odd_scans.hpp"
#include "run_settings.hpp"
#include "verdict_files.hpp"

namespace dynains::run {

/// Numbers of points in the final verdicts of a run.
struct Tally {
  std::uint64_t points = 0;
  std::array<std::uint64_t, 5> labels{};  ///< by PointLabel
  std::uint64_t unclustered = 0;   ///< static points that are neither ground nor in a cluster
  std::uint64_t below_movers = 0;  ///< removed points of the ground
  std::vector<ScanCounts> scans;

  std::uint64_t operator[](PointLabel label) const {
    return labels[static_cast<std::size_t>(label)];
  }

  void add(const ScanVerdict& verdict) {
    const std::uint64_t moving_before = (*this)[PointLabel::kDynamic];
    points += verdict.labels.size();
    detail::with_packs([&](auto) {
      for (std::size_t value = 0; value < labels.size(); ++value) {
        std::uint32_t count = 0;
        for (const PointLabel label : verdict.labels) {
          count += label == static_cast<PointLabel>(value);
        }
        labels[value] += count;
      }
    });
    scans.push_back({verdict.labels.size(), (*this)[PointLabel::kDynamic] - moving_before});
    unclustered += std::inner_product(
        verdict.labels.begin(), verdict.labels.end(), verdict.causes.begin(), std::uint32_t{0},
        std::plus<>(), [](PointLabel label, Cause cause) {
          return label == PointLabel::kStatic && cause == Cause::kNotJudged ? 1U : 0U;
        });
    below_movers += static_cast<std::uint64_t>(
        std::count(verdict.causes.begin(), verdict.causes.end(), Cause::kUnderInstance));
  }
};

/// A moving object in a scan.
struct TrackRow {
  std::size_t scan = 0;
  double time = 0.0;  ///< s
  MovingObject object;
};

/// Hands final verdicts to sinks, in another thread. Those of the stream are final unless there is
/// a second pass: then they wait, packed, in files without a name in the folder of the outputs.
class RunResults {
 public:
  /// Opens all files in the folder of `settings.outputs`, and their map, so that a folder that
  /// cannot be written is noticed before the work. There is a second pass if the settings ask for
  /// one and the recording, which outlives this, is longer than what the first one compares. Throws
  /// IoError.
  RunResults(const Recording& recording, const ScanRange& range, const RunSettings& settings);

  /// Final verdicts also go to `sink`. `needs_truth`: with the labels of the recording.
  void add(Sink sink, bool needs_truth = false);
  /// The result of the push just made.
  void take_newest(const FrameResult& frame);
  /// The verdict of the stream on a scan, in the order of the scans. Keeps the content of `scan`
  /// and gives the content of an earlier scan back, whose memory the caller can use again. If
  /// `scan` is null, the scan is read from its file. Throws IoError, for the scan before as well.
  void take_final(RecordedScan* scan, const ScanVerdict& verdict);
  /// After the last scan: hands the verdicts of a second pass out, revised. A signal ends the
  /// revision; they then stay as they are. Calls `progress` before the first scan and after each.
  void revise(const std::function<void(std::size_t done)>& progress);
  /// Waits for the results of the last scan. Throws IoError.
  void finish() { writing_.wait(); }
  /// See RunOutputs::thread().
  std::launch thread() const { return writing_.policy(); }

  void add_map_point(const Eigen::Vector3d& point);
  /// All files are whole.
  void commit();

  /// Scans with a verdict of the stream.
  std::size_t finished() const { return finished_; }
  const Tally& tally() const { return tally_; }
  /// Empty without a map.
  std::optional<std::size_t> map_points() const;
  bool has_second_pass() const { return second_.has_value(); }
  /// Whether no signal has ended revise().
  bool is_revised() const { return !second_ || second_->is_decided(); }
  const std::vector<ReturnToPlace>& returns() const {
    return second_ ? second_->returns() : returns_.found();
  }
  /// The field "second_pass" of the report.
  nlohmann::ordered_json second_pass_report() const;

 private:
  void keep_for_second_pass();
  void hand_out();
  void write_moving(const JudgedScan& judged);
  void add_to_revised_map(const JudgedScan& judged);

  const Recording& recording_;
  ScanRange range_;
  RunOutputs outputs_;
  ByteStore store_;
  Returns returns_;  // of one pass
  std::optional<SecondPass> second_;
  PointStore verdicts_;  // of the stream, for the second pass
  bool needs_truth_ = false;
  std::vector<Sink> sinks_;
  VerdictFiles final_labels_;
  std::optional<VerdictFiles> online_labels_;
  PackedVerdict online_;  // belongs to writing_online_
  PointFileWriter dynamic_points_;
  Overview overview_;
  std::unique_ptr<PointFileWriter> map_;
  std::optional<MapAttributeTable> map_attributes_;
  std::optional<StaticMapAccumulator> revised_map_;
  std::vector<std::uint8_t> keep_;  // of the points for that map
  std::vector<TrackRow> tracks_;
  std::size_t finished_ = 0;
  Tally tally_;
  JudgedScan judged_;  // belongs to the writing thread until writing_.wait()
  Background writing_, writing_online_;
};

}  // namespace dynains::run
