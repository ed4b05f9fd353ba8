// The results of a run: verdicts as they come, handed to all that is made of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/threads/background.hpp"
#include "dynains/verdict.hpp"
#include "map_file.hpp"
#include "overview.hpp"
#include "passes.hpp"
#include "run_settings.hpp"
#include "tally.hpp"
#include "verdict_files.hpp"

namespace dynains::run {

/// A moving object in a scan.
struct TrackRow {
  std::size_t scan = 0;
  double time = 0.0;  ///< s
  MovingObject object;
};

/// Hands final verdicts to sinks, in another thread.
class RunResults {
 public:
  /// Opens all files in `outputs.folder`, and `outputs.map`, so that a folder that cannot be
  /// written is noticed before the work. `passes`: null if verdicts of the stream are final. It and
  /// the recording outlive this. Throws IoError.
  RunResults(const Recording& recording, const ScanRange& range, const RunOutputs& outputs,
             Passes* passes = nullptr);

  /// Final verdicts also go to `sink`. `needs_truth`: with the labels of the recording.
  void add(Sink sink, bool needs_truth = false);
  /// The result of the push just made.
  void take_newest(const FrameResult& frame);
  /// The verdict of the stream on a scan, in the order of the scans. Keeps the content of `scan`
  /// and gives the content of an earlier scan back, whose memory the caller can use again. If
  /// `scan` is null, the scan is read from its file. Throws IoError, for the scan before as well.
  void take_final(RecordedScan* scan, const ScanVerdict& verdict);
  /// A verdict that take_final() took, after its revision: `judged` has the index, the scan, its
  /// points and arrays. Gives the content of an earlier one back.
  void take_revised(JudgedScan& judged);
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

 private:
  void hand_out();
  void write_moving(const JudgedScan& judged);
  void add_to_revised_map(const JudgedScan& judged);

  const Recording& recording_;
  ScanRange range_;
  RunOutputs outputs_;
  Passes* passes_;
  bool needs_truth_ = false;
  std::vector<Sink> sinks_;
  VerdictFiles final_labels_;
  std::optional<VerdictFiles> online_labels_;
  PackedVerdict online_;  // belongs to writing_online_
  PointFileWriter dynamic_points_;
  Overview overview_;
  std::unique_ptr<MapFile> map_;
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
