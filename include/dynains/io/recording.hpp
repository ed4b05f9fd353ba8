// Recorded scans with poses, in all supported formats.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/point_file.hpp"
#include "dynains/io/trajectory.hpp"
#include "dynains/pose.hpp"

namespace dynains {

/// Frame of the points in the files.
enum class PointFrame {
  kAuto,    ///< estimated: points lie around the origin or around the positions of the sensor
  kSensor,  ///< frame of the sensor
  kWorld    ///< frame of the poses
};

/// Names as in options.
constexpr std::array<const char*, 3> value_names(PointFrame) { return {"auto", "sensor", "world"}; }

/// Columns of a raw scan (.bin): x y z, intensity, and others that are ignored.
struct BinLayout {
  int columns = 4;         ///< values of a point, [3, 64]
  bool is_double = false;  ///< float64 instead of float32
  int bytes = 0;           ///< of a point, if others follow its columns; 0: those of the columns
};

/// "4" for columns of float32, "4d" for float64, "4:26" for points of 26 bytes. Throws ConfigError.
BinLayout parse_bin_layout(const std::string& text);

/// "x y z x y z": two opposite corners of a box, m; further boxes follow. Blanks, commas and
/// semicolons separate numbers. Throws ConfigError.
std::vector<Eigen::AlignedBox3d> parse_self_boxes(const std::string& text);

struct RecordingOptions {
  std::filesystem::path poses;  ///< trajectory file; empty: search the recording
  std::filesystem::path times;  ///< file with one time per scan, s; empty: search the recording
  PointFrame frame = PointFrame::kAuto;
  PoseConvention convention;
  double time_offset = 0.0;       ///< s; a scan at time t has the pose at t + time_offset
  double pose_gap = kMaxPoseGap;  ///< s, longest interval between poses for interpolation
  std::string cloud_topic;        ///< for logs, "A,B" for several; empty: the only one of clouds
  std::string cloud_frame;        ///< for logs: of the clouds that count; empty: the only one
  std::string pose_topic;         ///< for logs; empty: the only topic of poses
  std::string pose_frame;  ///< for logs: fixed frame of transforms; empty: root of their tree
  std::string scene;       ///< for nuScenes: name of the scene; empty: the only one
  /// Whether points are moved to the sensor frame at the time of their scan. Needs a time for each
  /// point, and points in the sensor frame.
  bool deskew = false;
  /// Position of the sensor in the frame of the clouds, m: not zero for clouds that were moved into
  /// a body frame, such as base_link, before they were recorded.
  Eigen::Vector3d sensor_origin = Eigen::Vector3d::Zero();
  /// Poses of several sensors in the frame of the clouds, m; empty: sensors.txt in the folder of
  /// the recording, or one sensor.
  std::vector<Pose> sensors;
  int sensor_beams = 0;  ///< beams of one sensor, if `laser_number` counts those of all; 0: none
  /// For logs: frame of the sensor; its transform to the frame of the clouds gives the origin, or
  /// the poses of several: "A,B".
  std::string sensor_frame;
  double point_time_unit = 0.0;  ///< s per unit of the times of points; 0: found by their span
  double point_unit = 1.0;       ///< m per unit of the coordinates of points
  BinLayout bin_layout;          ///< of scans in .bin files
  /// Boxes around parts of the own vehicle, frame of the sensor, m: points inside count as beams
  /// without a return.
  std::vector<Eigen::AlignedBox3d> self_boxes;
  /// Poses are not looked for: scans have none until take_poses(). Points with times are given as
  /// measured until then, and de-skewed by the new poses unless `is_compensated`.
  bool without_poses = false;
  bool is_compensated = false;  ///< points have times, but the recorder has de-skewed them
  bool accept_missing = false;  ///< parts of a log may be missing, files of scans cut off
  std::vector<std::filesystem::path> sources;  ///< files that these options were read from
};

/// One scan. Each column has one value per point, or is empty if the recording lacks it.
struct RecordedScan {
  std::vector<float> xyzi;           ///< x y z intensity, interleaved; sensor frame, m
  std::vector<std::uint16_t> ring;   ///< number of the beam
  std::vector<double> time;          ///< in the unit of the file
  std::vector<std::uint8_t> sensor;  ///< index in Recording::sensors(); not written

  std::size_t size() const { return xyzi.size() / 4; }

  /// Point i < size() with all its columns, for writing.
  FilePoint point(std::size_t i) const {
    FilePoint point;
    point.position = Eigen::Vector3f(xyzi[4 * i], xyzi[4 * i + 1], xyzi[4 * i + 2]).cast<double>();
    point.intensity = xyzi[4 * i + 3];
    if (!ring.empty()) point.ring = ring[i];
    if (!time.empty()) point.time = time[i];
    return point;
  }
};

/// Format of the scans: one file per scan, or messages of a log.
enum class ScanFormat { kBin, kPcd, kPly, kLas, kNpy, kXyz, kCsv, kNuScenes, kLog };

class LogScans;
class ScanReader;
struct PointClock;

/// One scan of a recording, without its points.
struct ScanEntry {
  std::filesystem::path file;  ///< of the points; for a log, the log
  std::string name;            ///< file name without extension
  std::uint64_t number = 0;    ///< the name if all names are numbers, else the index of the file
  double time = 0.0;           ///< s, strictly increasing
  std::size_t index = 0;       ///< among all clouds or files of scans, with and without a pose
  Pose T_world_sensor = Pose::Identity();
};

/// Where the labels of a recording are.
enum class LabelSource { kNone, kFiles, kColumn, kIntensity };

/// All of a recording but its points and labels, as plain data.
struct RecordingContents {
  std::filesystem::path folder;       ///< path of the folder or log
  std::filesystem::path scan_folder;  ///< `folder` or a subfolder
  RecordingOptions options;           ///< as given, completed by what the recording states
  ScanFormat format = ScanFormat::kBin;
  PointFrame frame = PointFrame::kSensor;
  LabelSource labels = LabelSource::kNone;
  PointColumns columns;      ///< of the first scan
  bool is_numbered = false;  ///< all names are numbers
  bool has_times = true;     ///< times of scans are measured; else scans count as 0.1 s apart
  bool has_viewpoints = false;
  std::optional<Pose> T_camera_sensor;                  ///< of calib.txt
  Trajectory trajectory;                                ///< rows of the poses as in their file
  std::vector<std::optional<TrajectoryMatch>> matches;  ///< rows for each cloud or file of a scan
  Trajectory motion;                                    ///< T_world_sensor, for de-skewing
  std::shared_ptr<const PointClock> clock;              ///< if points move to the time of a scan
  std::vector<ScanEntry> scans;                         ///< with a pose, unless none has one
  std::vector<std::filesystem::path> files;             ///< without files of labels
  std::optional<std::string> early_end;                 ///< of a truncated log
  std::vector<std::string> notes;
  std::vector<std::string> warnings;
};

/// Recorded scans with poses: folders of KITTI, SemanticKITTI (see kitti.hpp), nuScenes or point
/// files (see read_points()), and logs of ROS. docs/own_data.md lists all formats, columns and
/// conventions.
///
/// Scans are ordered by name, with numbers in names by value. Two scan files whose names differ
/// only in the extension are an error. Scans of a log are the clouds of one topic, or of several
/// within half a period of the first one, in its frame, named by their number, with the times of
/// their stamps. The constructor reads a log once; points stay in the file.
///
/// Poses come from `options.poses`; else from what the recording states (topics or transforms of a
/// log, tables of nuScenes, VIEWPOINT of any scan); else from poses.txt, trajectory.txt and the
/// like in the folder or beside that of the scans. Times come from `options.times`; else from
/// times.txt or timestamps.txt; else from names that are times; else from the rows of the poses if
/// there is one for each scan; else scans are 0.1 s apart.
///
/// Rows without times belong to scans by order, or by the number of the scan. Rows with times are
/// interpolated at the times of the scans plus `options.time_offset`. Scans without a pose are
/// excluded and listed in `notes()`; more than half of them without a pose are an error. An
/// unreadable calib.txt is an error only if the poses are those of a camera.
///
/// With a sensor origin, points and poses are in a frame at the sensor with the axes of the clouds.
///
/// All members throw IoError with path, position and expected content.
class Recording {
 public:
  /// Reads and checks all files except points and labels. Throws ConfigError for options that are
  /// for recordings of another format.
  explicit Recording(const std::filesystem::path& path, const RecordingOptions& options = {});

  /// Path of the folder or log.
  const std::filesystem::path& folder() const { return contents_.folder; }
  /// Folder of the scans: folder() or a subfolder; for a log, folder().
  const std::filesystem::path& scan_folder() const { return contents_.scan_folder; }
  /// All files of the recording: scans with and without a pose, poses, times, calibration, labels,
  /// and RecordingOptions::sources.
  std::vector<std::filesystem::path> files() const;
  /// Number of scans with a pose; with RecordingOptions::without_poses, of all scans.
  std::size_t size() const { return contents_.scans.size(); }
  ScanFormat format() const { return contents_.format; }
  /// Frame of the points in the files: kSensor or kWorld. read_scan() returns the sensor frame.
  PointFrame frame() const { return contents_.frame; }
  /// Columns of the first scan in addition to x y z.
  const PointColumns& columns() const { return contents_.columns; }
  /// Whether the recording has labels.
  bool has_labels() const { return contents_.labels != LabelSource::kNone; }
  /// Whether scan i has labels: files of some scans may be missing.
  bool has_labels(std::size_t i) const;
  /// Whether read_scan() moves points to the sensor frame at the time of the scan.
  bool is_deskewed() const { return contents_.options.deskew; }
  /// Position of the sensor in the frame of the clouds, m.
  const Eigen::Vector3d& sensor_origin() const { return contents_.options.sensor_origin; }
  /// Poses of several sensors in the frame of the clouds, m; empty for one.
  const std::vector<Pose>& sensors() const { return contents_.options.sensors; }
  /// Path, position and reason if a log is truncated. The clouds before that position are valid.
  const std::optional<std::string>& early_end() const { return contents_.early_end; }
  /// Automatic choices of files, frames and times, and excluded scans, one sentence each.
  const std::vector<std::string>& notes() const { return contents_.notes; }
  /// Defects of the recording that results depend on, one sentence each.
  const std::vector<std::string>& warnings() const { return contents_.warnings; }

  /// File name of scan i without extension.
  const std::string& name(std::size_t i) const { return contents_.scans.at(i).name; }
  /// File with the points of scan i; for a log, the log.
  const std::filesystem::path& file(std::size_t i) const { return contents_.scans.at(i).file; }
  /// Name of scan i as a number if all names are numbers, else the index of its file.
  std::uint64_t number(std::size_t i) const { return contents_.scans.at(i).number; }
  /// Time of scan i, s, strictly increasing.
  double time(std::size_t i) const { return contents_.scans.at(i).time; }
  /// Pose of the sensor at scan i, m.
  const Pose& T_world_sensor(std::size_t i) const { return contents_.scans.at(i).T_world_sensor; }

  /// Number of points of scan i, from the size of its file or from its header. Throws unless both
  /// are valid. Does not read points.
  std::uint64_t point_count(std::size_t i) const;
  /// Reads scan i, m, sensor frame, and reuses the memory of `scan`. May contain NaN and infinity.
  /// With RecordingOptions::deskew, the poses of the recording between the scans are interpolated
  /// at the time of each point; times of points keep their values. Points whose time cannot be that
  /// of their scan are not moved. Points in RecordingOptions::self_boxes are at the origin.
  void read_scan(std::size_t i, RecordedScan& scan) const;
  /// As above, as a new scan.
  RecordedScan read_scan(std::size_t i) const;
  /// For each point of scan i the seconds from the time of the scan until it was measured; NaN for
  /// points whose time cannot be that of their scan. Empty if scans are not to be de-skewed.
  /// `scan`: as read by read_scan(), whose times count.
  std::vector<double> point_offsets(std::size_t i, const RecordedScan& scan) const;
  /// Poses for the scans from `first` on, of a recording without poses: at least one, at most one
  /// for each scan. Other scans are left out.
  void take_poses(std::size_t first, const std::vector<Pose>& T_world_sensor);

  /// SemanticKITTI label of each point of scan i, class in the lower, instance in the upper half.
  std::vector<std::uint32_t> read_labels(std::size_t i) const;

  /// The log of ROS, to copy its messages; null for other formats.
  const LogScans* log() const;
  /// Index of scan i among the clouds of the log, or the files of scans, with and without a pose.
  std::size_t file_index(std::size_t i) const { return contents_.scans.at(i).index; }

  // Members for comparisons with other conventions.
  const RecordingOptions& options() const { return contents_.options; }
  /// Pose of scan i under another convention; empty if its shift leads out of the trajectory.
  std::optional<Pose> pose_under(const PoseConvention& convention, std::size_t i) const;
  /// Pose of the sensor at `offset` (s) after the pose of scan i, by the times of the poses; empty
  /// without times and outside of the trajectory.
  std::optional<Pose> pose_after(std::size_t i, double offset) const;
  /// Rows of the poses, as in their file.
  const Trajectory& trajectory() const { return contents_.trajectory; }
  /// Whether there is a calib.txt.
  bool has_calibration() const { return contents_.T_camera_sensor.has_value(); }
  /// Number of clouds of the log or files of scans, with and without a pose.
  std::size_t scan_file_count() const { return contents_.matches.size(); }
  /// Number of scans that were excluded for lack of a pose.
  std::size_t missing_pose_count() const { return scan_file_count() - size(); }

 private:
  RecordingContents contents_;
  std::shared_ptr<const ScanReader> reader_;  ///< shared by copies of the recording
};

}  // namespace dynains
