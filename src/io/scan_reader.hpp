// Opening a recording, and how its scans are read, by their format.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "points/point_clock.hpp"

namespace dynains {

class LogScans;

/// From the coordinates of a file to those that are wanted, with the unit of length.
using FileTransform = Eigen::Transform<double, 3, Eigen::Affine, Eigen::DontAlign>;

/// All members throw IoError with path, position and the expected content. Several threads may
/// read.
class ScanReader {
 public:
  virtual ~ScanReader() = default;

  /// Columns in addition to x y z.
  virtual PointColumns columns(const ScanEntry& scan) const = 0;
  /// Points by the header or the size of the file. Throws unless both are valid.
  virtual std::uint64_t point_count(const ScanEntry& scan) const = 0;
  /// Reads the points, transformed by `T_target_file` if there is one. Columns that the scan
  /// lacks become empty; memory of `points` is reused.
  virtual void read(const ScanEntry& scan, const FileTransform* T_target_file,
                    RecordedScan& points) const = 0;
  /// The column `label`.
  virtual std::vector<std::uint32_t> read_labels(const ScanEntry& scan) const = 0;
  /// Null if the scans are files.
  virtual const LogScans* log_scans() const { return nullptr; }
};

/// For scans in files, one each; of logs, LogScans is one.
std::unique_ptr<ScanReader> make_file_reader(ScanFormat format, const BinLayout& layout);

/// Moves all points, if there is a transform.
void transform_scan(const FileTransform* T_target_file, RecordedScan& points);

/// The folder of the tables of nuScenes: `folder`, or its subfolder v1.0-*; empty if it has none.
std::optional<std::filesystem::path> nuscenes_tables(const std::filesystem::path& folder);
/// Takes sweeps, times and poses of one scene: that of the options, or the only one. Memory grows
/// with the number of sweeps, not with the size of the tables. Throws IoError, also if this build
/// has no JSON.
void read_nuscenes(RecordingContents& r, const std::filesystem::path& tables);

/// Reads and checks all files except points and labels, and gives the reader of these. Throws
/// IoError with path, position and expected content, and ConfigError for options that are for
/// recordings of another format.
std::unique_ptr<ScanReader> open_recording(const std::filesystem::path& path,
                                           const RecordingOptions& options, RecordingContents& r);

// Poses and times of a recording, and how they belong to its scans: poses/recording_poses.cpp. All
// functions throw IoError with path, position and expected content.

/// Finds poses and times of scans in files, and places the scans.
void read_poses(RecordingContents& r);
/// Places scans that have times by RecordingOptions::poses, or by the trajectory of `origin`, the
/// file that states it.
void pose_by_stamps(RecordingContents& r, const std::filesystem::path& origin);
/// Scans without poses: they have times, and count as matched when they get poses.
void leave_unplaced(RecordingContents& r);
/// The clock of points by the times (s) of their scans, of which `read(i)` gives one with raw
/// times. `topic`: of the scans, for the warning about it; may be empty. Empty without times.
std::optional<PointClock> found_clock(RecordingContents& r, const std::string& topic,
                                      const std::vector<double>& times,
                                      const std::function<const RecordedScan&(std::size_t)>& read);
/// Finds the clock of the points, and the trajectory by which they are moved: rows with times of
/// their own, else the poses of the scans.
void prepare_deskewing(RecordingContents& r, const ScanReader& reader);

}  // namespace dynains
