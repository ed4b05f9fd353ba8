// The results of a run: verdicts as they come, handed to all that is made of them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "dynains/recording/second_pass.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/threads/background.hpp"
#include "dynains/verdict.hpp"
#include "interrupt.hpp"
#include "io/folder.hpp"
#include "log_output.hpp"
#include "map_file.hpp"
#include "overview.hpp"
#include "recorded_scans.hpp"
#include "run/remarks/cloud_remarks.hpp"
#include "run_report.hpp"
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

/// Hands final verdicts to sinks, in another thread. Those of the stream are final unless there is
/// a second pass: then they wait, packed, in files without a name in the folder of the outputs.
class RunResults {
 public:
  /// Opens all files in the folder of `settings.outputs`, and their map, so that a folder that
  /// cannot be written is noticed before the work. There is a second pass if the settings ask for
  /// one and the recording, which outlives this, is longer than what the first one compares. Throws
  /// IoError.
  RunResults(const Recording& recording, const ScanRange& range, const RunSettings& settings)
      : recording_(recording),
        range_(range),
        outputs_(settings.outputs),
        store_(outputs_.folder),
        returns_(store_, settings.config.evidence),
        verdicts_(outputs_.folder),
        final_labels_(outputs_.folder, "labels", outputs_.write_beliefs),
        dynamic_points_(outputs_.folder / "dynamic_points.ply", moving_columns(recording, range)),
        overview_(recording, range),
        writing_(outputs_.thread()),
        writing_online_(outputs_.thread()) {
    if (settings.passes > 1 && range.size() > returns_.compared()) {
      SecondPassConfig config;
      config.sensors = settings.config.sensors;
      config.static_policy = settings.static_policy;
      config.evidence = settings.config.evidence;
      second_.emplace(store_, config);
    }
    final_labels_.create_folders();
    add([this](const JudgedScan& judged) {
      final_labels_.write(recording_.name(judged.index), judged.packed);
    });
    if (outputs_.write_online) online_labels_.emplace(outputs_.folder, "online").create_folders();
    if (outputs_.write_clean) {
      const std::filesystem::path folder = outputs_.folder / "clean";
      create_folder(folder);
      add([this, folder](const JudgedScan& judged) {
        write_clean(recording_, judged, folder, outputs_.drop_not_judged);
      });
    }
    if (!outputs_.map.empty()) {
      map_ = open_map(outputs_.map, recording, range, outputs_.map_attributes, outputs_.crs);
    }
    if (map_ && second_) {
      revised_map_.emplace(settings.config.map);
      add([this](const JudgedScan& judged) { add_to_revised_map(judged); });
    }
    if (outputs_.map_attributes) {
      map_attributes_.emplace(outputs_.map_voxel,
                              recording.T_world_sensor(range.first).translation());
      add([this](const JudgedScan& judged) { map_attributes_->add(judged); }, true);
    }
    add([this](const JudgedScan& judged) { overview_.add(judged); });
    add([this](const JudgedScan& judged) { write_moving(judged); });
  }

  /// Final verdicts also go to `sink`. `needs_truth`: with the labels of the recording.
  void add(Sink sink, bool needs_truth = false) {
    sinks_.push_back(std::move(sink));
    needs_truth_ = needs_truth_ || (needs_truth && recording_.has_labels());
  }
  /// The result of the push just made.
  void take_newest(const FrameResult& frame) {
    if (!online_labels_) return;
    const ScanVerdict& verdict = frame.newest();
    writing_online_.wait();
    online_.pack_labels(verdict);
    writing_online_.begin([this, i = range_.first + verdict.scan] {
      online_labels_->write(recording_.name(i), online_);
    });
  }
  /// The verdict of the stream on a scan, in the order of the scans. Keeps the content of `scan`
  /// and gives the content of an earlier scan back, whose memory the caller can use again. If
  /// `scan` is null, the scan is read from its file. Throws IoError, for the scan before as well.
  void take_final(RecordedScan* scan, const ScanVerdict& verdict) {
    for (const MovingObject& object : verdict.objects) {
      TrackRow& row =
          tracks_.emplace_back(TrackRow{range_.first + verdict.scan, verdict.time, object});
      row.object.first_scan += range_.first;
      row.object.last_scan = row.scan;
    }
    finish();
    judged_.index = range_.first + verdict.scan;
    judged_.arrays.take(verdict, outputs_.needs_beliefs());
    judged_.verdict = judged_.arrays.verdict(verdict);
    if (scan != nullptr) std::swap(judged_.scan, *scan);
    writing_.begin([this, reads = scan == nullptr] {
      if (reads) recording_.read_scan(judged_.index, judged_.scan);
      copy_points(judged_.scan, judged_.points);
      if (second_) return keep_for_second_pass();
      returns_.add(judged_.points, judged_.verdict.labels, judged_.verdict.compared);
      hand_out();
    });
    ++finished_;
  }
  /// After the last scan: hands the verdicts of a second pass out, revised. A signal ends the
  /// revision; they then stay as they are. Calls `progress` before the first scan and after each.
  void revise(const std::function<void(std::size_t done)>& progress) {
    if (!second_) return;
    second_->test([] { return InterruptGuard::signal() == 0; });
    if (finished_ == 0) return;
    progress(0);
    ReadAhead reader(recording_, range_.first, range_.first + finished_ - 1, outputs_.thread());
    JudgedScan next;
    for (std::size_t k = 0; k < finished_; ++k) {
      next.index = range_.first + k;
      next.scan = reader.next(std::move(next.scan));
      copy_points(next.scan, next.points);
      verdicts_.read(3 * k, next.packed.labels);
      verdicts_.read(3 * k + 1, next.packed.causes);
      verdicts_.read(3 * k + 2, next.packed.beliefs);
      next.packed.unpack(next.scan, next.arrays);
      second_->revise(next.points, static_cast<std::uint32_t>(k), next.arrays);
      finish();
      std::swap(judged_, next);
      judged_.verdict =
          judged_.arrays.verdict({k, recording_.time(judged_.index),
                                  orthonormalized(recording_.T_world_sensor(judged_.index))});
      writing_.begin([this] { hand_out(); });
      progress(k + 1);
    }
    finish();
  }
  /// Waits for the results of the last scan. Throws IoError.
  void finish() { writing_.wait(); }

  void add_map_point(const Eigen::Vector3d& point) {
    map_->add(map_attributes_ ? map_attributes_->at(point) : FilePoint{point});
  }
  /// All files are whole.
  void commit() {
    finish();
    writing_online_.wait();
    dynamic_points_.commit();
    if (outputs_.write_tracks) write_tracks(outputs_.folder / kResultNames.tracks, tracks_);
    overview_.picture().write_png(outputs_.folder / kResultNames.picture);
    if (revised_map_) revised_map_->for_each([&](const auto& point) { add_map_point(point); });
    if (map_) map_->commit();
  }

  /// Scans with a verdict of the stream.
  std::size_t finished() const { return finished_; }
  const Tally& tally() const { return tally_; }
  /// Empty without a map.
  std::optional<std::size_t> map_points() const {
    if (!map_) return std::nullopt;
    return revised_map_ ? revised_map_->size() : map_->size();
  }
  bool has_second_pass() const { return second_.has_value(); }
  /// Whether no signal has ended revise().
  bool is_revised() const { return !second_ || second_->is_decided(); }
  const std::vector<ReturnToPlace>& returns() const {
    return second_ ? second_->returns() : returns_.found();
  }
  /// The field "second_pass" of the report.
  nlohmann::ordered_json second_pass_report() const {
    return {{"places", second_->place_count()},
            {"removed_points", second_->revised().removed},
            {"restored_points", second_->revised().restored}};
  }

 private:
  void keep_for_second_pass() {
    judged_.packed.pack(judged_.verdict, outputs_.write_beliefs);
    verdicts_.add(judged_.packed.labels);
    verdicts_.add(judged_.packed.causes);
    verdicts_.add(judged_.packed.beliefs);
    second_->add(judged_.points, judged_.verdict, judged_.scan.sensor);
  }
  void hand_out() {
    judged_.packed.pack(judged_.verdict, outputs_.write_beliefs);
    if (needs_truth_) judged_.truth = recording_.read_labels(judged_.index);
    tally_.add(judged_.verdict);
    for (const Sink& sink : sinks_) sink(judged_);
  }
  void write_moving(const JudgedScan& judged) {
    for_each_moving(judged.verdict.labels, [&](std::size_t i) {
      FilePoint point = judged.scan.point(i);
      point.position = judged.verdict.T_world_sensor * point.position;
      point.label = judged.packed.labels[i];
      dynamic_points_.add(point);
    });
  }
  void add_to_revised_map(const JudgedScan& judged) {
    const Span<const PointLabel> labels = judged.verdict.labels;
    keep_.resize(labels.size());
    std::transform(labels.begin(), labels.end(), keep_.begin(),
                   [](PointLabel label) { return std::uint8_t{is_static(label)}; });
    revised_map_->insert(judged.points, keep_, judged.verdict.T_world_sensor);
  }

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
