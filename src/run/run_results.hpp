// The results of a run, without the report.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clean_writer.hpp"
#include "dynains/city/session_writer.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "dynains/recording/verdict_arrays.hpp"
#include "dynains/threads/background.hpp"
#include "dynains/verdict.hpp"
#include "grid/grid_maker.hpp"
#include "label_writer.hpp"
#include "map_file.hpp"
#include "overview.hpp"
#include "point_labels.hpp"
#include "run/output/output_listing.hpp"
#include "run/remarks/odd_scans.hpp"
#include "scan_range.hpp"

namespace dynains {
class Returns;
class SecondPass;
}  // namespace dynains

namespace dynains::run {

/// The picture of a run, see Overview.
inline constexpr const char* kOverviewPicture = "overview.png";
inline constexpr const char* kEstimatedPoses = "poses.txt";
/// The page of `dynains view` in the folder of results.
inline constexpr const char* kViewPage = "view.html";

/// The results of a run. A plan has them whole: in settings, an empty `map` is the file
/// static_map.ply in the folder.
struct RunOutputs {
  std::filesystem::path folder;
  std::filesystem::path map;  ///< by whole_path(); empty: no map
  bool write_online = false;
  bool write_clean = false;
  bool drop_not_judged = false;  ///< from clean/
  std::filesystem::path log;     ///< by whole_path(); empty: none
  bool mark_log = false;         ///< adds labels to its clouds, which keep all points
  std::filesystem::path grid;    ///< description, by whole_path(); empty: none
  grid::Config grid_config;
  bool write_poses = false;
  bool write_page = false;  ///< of dynains view
  bool write_beliefs = false;
  bool write_tracks = false;    ///< of moving objects, RemoverConfig::objects
  bool one_thread = false;      ///< the caller reads and writes
  bool map_attributes = false;  ///< the map holds attributes of its points
  std::string crs;              ///< of a LAS map, as WKT; empty: none
  double map_voxel = 0.0;       ///< m, of attributes

  std::launch thread() const { return one_thread ? std::launch::deferred : std::launch::async; }
  /// Whether a result holds beliefs.
  bool needs_beliefs() const { return write_beliefs || map_attributes; }
  bool has_outside_map() const;
  bool has_las_map() const { return is_las(map); }
  /// The map relative to the folder if it lies there, so that the folder can be moved; else
  /// absolute. Empty if there is none.
  std::string map_name() const;
  /// Files in the folder of a run over these scans.
  OutputListing listing(const Recording& recording, const ScanRange& range) const;
};

/// Opens a file for the map of these scans. Throws IoError.
std::unique_ptr<MapFile> open_map(const std::filesystem::path& file, const Recording& recording,
                                  const ScanRange& range, const RunOutputs& outputs);

/// A scan and a copy of its final verdict.
struct JudgedScan {
  RecordedScan scan;
  PointBuffer points;  ///< of the scan
  VerdictArrays arrays;
  ScanVerdict verdict;  ///< with these arrays
};

/// A moving object in a scan.
struct TrackRow {
  std::size_t scan = 0;
  double time = 0.0;  ///< s
  MovingObject object;
};

/// Takes verdicts as they come and streams them to files.
class RunResults {
 public:
  /// Opens all files, so that a folder that cannot be written is noticed before the work.
  /// They are written into `outputs.folder` and `outputs.map`. The recording outlives this. Throws
  /// IoError.
  RunResults(const Recording& recording, const ScanRange& range, const RunOutputs& outputs);

  /// The result of the push just made.
  void take_newest(const FrameResult& frame);
  /// The final verdict on a scan, in the order of the scans. Keeps the content of `scan` and gives
  /// the content of an earlier scan back, whose memory the caller can use again. If `scan` is null,
  /// the scan is read from its file. Throws IoError, for the scan before as well.
  void take_final(RecordedScan* scan, const ScanVerdict& verdict);
  /// Waits for the results of the last scan. Throws IoError.
  void finish();
  /// Final verdicts also go to `session`, which outlives this.
  void contribute_to(SessionWriter& session) { session_ = &session; }
  /// Final verdicts are first ones, which `pass` takes; revise() completes the results. It outlives
  /// this.
  void wait_for(SecondPass& pass) { second_pass_ = &pass; }
  /// Final verdicts also go to `returns`, which outlives this.
  void watch(Returns& returns) { returns_ = &returns; }
  SecondPass* second_pass() const { return second_pass_; }
  /// Reads all scans and first verdicts again, revises them by the second pass, and makes all other
  /// results of them, the map with this configuration. Calls `progress` before the first scan and
  /// after each. Throws IoError.
  void revise(const StaticMapAccumulator::Config& map,
              const std::function<void(std::size_t done)>& progress);
  /// See RunOutputs::thread().
  std::launch thread() const { return writing_.policy(); }

  void add_map_point(const Eigen::Vector3d& point);
  /// All files are whole.
  void commit();

  std::size_t finished() const { return finished_; }
  /// Whether all scans are finished.
  bool is_complete() const;
  std::uint64_t points() const { return points_; }
  const LabelCounts& labels() const { return labels_; }
  /// Points of each scan, and those of them that move.
  const std::vector<ScanCounts>& counts() const { return counts_; }
  /// Static points that are neither ground nor in a cluster.
  std::uint64_t unclustered() const { return unclustered_; }
  /// Removed points of the ground.
  std::uint64_t below_movers() const { return below_movers_; }
  std::optional<std::size_t> map_points() const;

 private:
  const Recording& recording_;
  ScanRange range_;
  LabelFiles final_labels_;
  std::optional<LabelFiles> online_labels_;  ///< belong to writing_online_
  std::optional<CleanWriter> clean_scans_;
  PointFileWriter dynamic_points_;
  Overview overview_;
  std::filesystem::path overview_file_;
  std::unique_ptr<MapFile> map_;
  std::optional<MapAttributeTable> map_attributes_;
  bool needs_beliefs_;
  SessionWriter* session_ = nullptr;
  SecondPass* second_pass_ = nullptr;
  Returns* returns_ = nullptr;
  std::size_t finished_ = 0;
  std::uint64_t points_ = 0;
  LabelCounts labels_;
  std::vector<ScanCounts> counts_;
  std::filesystem::path tracks_file_;
  std::vector<TrackRow> tracks_;
  std::uint64_t unclustered_ = 0;
  std::uint64_t below_movers_ = 0;
  // These belong to the writing thread until writing_.wait().
  JudgedScan judged_;
  std::vector<std::uint8_t> keep_;
  std::optional<StaticMapAccumulator> revised_map_;
  Background writing_, writing_online_;

  void write_final(const RecordedScan& scan, const ScanVerdict& verdict);
  void write_revised(bool is_revised);
  void complete_scan(const RecordedScan& scan, const ScanVerdict& verdict);
  void add_scan(const RecordedScan& scan, const ScanVerdict& verdict);
};

}  // namespace dynains::run
