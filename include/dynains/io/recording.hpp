// Recorded scans with their poses, in any supported format.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/point_file.hpp"
#include "dynains/io/pose_convention.hpp"
#include "dynains/io/trajectory.hpp"

namespace dynains {

/// Frame of the points in the files.
enum class PointFrame {
  kAuto,    ///< decided by the points: they lie around the origin or around the sensor's position
  kSensor,  ///< frame of the sensor
  kWorld    ///< frame of the poses
};

struct RecordingOptions {
  std::filesystem::path poses;  ///< trajectory file; empty: that of the recording
  std::filesystem::path times;  ///< file with a time for each scan, s; empty: that of the recording
  PointFrame frame = PointFrame::kAuto;
  PoseConvention convention;
  // Of a log; empty: the only one.
  std::string cloud_topic;
  std::string pose_topic;
  std::string pose_frame;  ///< fixed frame of poses from transforms; empty: root of their tree
};

/// One scan. Columns that the recording lacks are empty; the others have a value for each point.
struct RecordedScan {
  std::vector<float> xyzi;          ///< x y z intensity, interleaved; sensor frame, m
  std::vector<std::uint16_t> ring;  ///< number of the beam
  std::vector<double> time;         ///< as in the file

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

/// Format of the scans: a file each, or messages of a log.
enum class ScanFormat { kBin, kPcd, kPly, kLog };

class ScanReader;
struct ScanAddress;

/// A folder of scans, one file each, or a log:
///
/// - KITTI and SemanticKITTI: see KittiSequence. With `poses` in the options, poses.txt may be
/// missing;
/// - point files, .pcd or .ply, in the folder or in one below it (pcd, ply, scans, points, clouds,
///   lidar, velodyne), ordered by name, numbers in names by value;
/// - .bin files as in KITTI, directly in the folder;
/// - a log of ROS: .mcap, .db3 or .bag, or a folder with metadata.yaml and .mcap or .db3 files. It
///   is read once when it is opened; points stay in the file. Scans are the clouds of one topic,
///   named by their number, at the times of their stamps. See below for poses.
///
/// Two scans whose names differ in the extension only are refused.
///
/// Poses come from `options.poses`; else from VIEWPOINT, if any scan has one; else from a file
/// poses.txt, poses.csv, poses.tum, trajectory.txt, trajectory.csv or trajectory.tum in the folder
/// or beside the folder of the scans (see read_trajectory). Times come from `options.times`; else
/// times.txt or timestamps.txt in the folder or beside the file of poses, if that was found there;
/// else from names that are times (seconds with a point, or at least 10 digits: s, ms, us or ns
/// since 1970; SECONDS_NANOSECONDS); else from the rows of the poses, if there is one for each
/// scan; else scans are 0.1 s apart. calib.txt is taken from the folder or from beside the file of
/// poses; one that cannot be read is an error for poses of a camera only. Rows without times belong
/// to scans one by one (or by the number of the scan); rows with times are interpolated at the
/// times of the scans. Scans without a pose are left out and listed in `notes()`; if they are more
/// than half, that is an error.
///
/// Poses of a log come from `options.poses`; else from the topic `options.pose_topic` or the only
/// topic of poses; else from transforms between `options.pose_frame` and the frame of the clouds. A
/// topic that names its moving frame gives the poses of that frame: the transforms of the log lead
/// from there to the frame of the clouds; without such transforms the poses count as those of the
/// sensor. If the clouds are in the fixed frame of the poses, points are in the world frame.
///
/// Labels (SemanticKITTI classes) come from labels/NAME.label or a column `label`.
///
/// All members throw IoError with path, position and expectation.
class Recording {
 public:
  /// Reads and checks all files except points and labels.
  explicit Recording(const std::filesystem::path& path, const RecordingOptions& options = {});

  /// The folder or the log.
  const std::filesystem::path& folder() const { return folder_; }
  /// The folder that holds the scans: folder() or one below it. A log: folder().
  const std::filesystem::path& scan_folder() const { return scan_folder_; }
  /// Every file of the recording: scans, also those without a pose, poses, times, calibration and
  /// files of labels.
  std::vector<std::filesystem::path> files() const;
  std::size_t size() const { return scans_.size(); }
  ScanFormat format() const { return format_; }
  PointFrame frame() const { return frame_; }
  /// Columns of the first scan in addition to x y z.
  const PointColumns& columns() const { return columns_; }
  /// Whether poses come from VIEWPOINT.
  bool has_viewpoints() const { return has_viewpoints_; }
  bool has_labels() const { return labels_ != Labels::kNone; }
  /// Path, position and reason, if a log ends early. Its clouds before the end are read.
  const std::optional<std::string>& early_end() const { return early_end_; }
  /// Decisions on files, frames and times, and scans that were left out; a sentence each.
  const std::vector<std::string>& notes() const { return notes_; }

  /// File name of scan i without extension.
  const std::string& name(std::size_t i) const { return scans_.at(i).name; }
  const std::filesystem::path& file(std::size_t i) const { return scans_.at(i).file; }
  /// The name as a number if the names of all scans are numbers, otherwise the index of the file.
  std::uint64_t number(std::size_t i) const { return scans_.at(i).number; }
  /// Seconds, strictly increasing.
  double time(std::size_t i) const { return scans_.at(i).time; }
  const Eigen::Isometry3d& T_world_sensor(std::size_t i) const {
    return scans_.at(i).T_world_sensor;
  }

  /// Points of scan i, by the size of its file or by its header: points are not read.
  std::uint64_t point_count(std::size_t i) const;
  /// Throws unless header and size of the file of scan i are valid. Points are not read.
  void check_scan(std::size_t i) const;
  /// Points of scan i in the sensor frame. NaN and infinity stay. Memory of `scan` is reused.
  void read_scan(std::size_t i, RecordedScan& scan) const;
  RecordedScan read_scan(std::size_t i) const;
  /// One label per point of scan i.
  std::vector<std::uint32_t> read_labels(std::size_t i) const;

  // For comparisons with other conventions.
  const PoseConvention& convention() const { return options_.convention; }
  /// Pose of scan i under another convention; nothing if its shift leads out of the trajectory.
  std::optional<Eigen::Isometry3d> pose_under(const PoseConvention& convention,
                                              std::size_t i) const;
  bool has_quaternions() const { return trajectory_.order != QuaternionOrder::kNone; }
  QuaternionOrder quaternion_order() const { return trajectory_.order; }
  bool has_calibration() const { return has_calibration_; }
  /// Rows of the pose file.
  std::size_t pose_count() const { return trajectory_.poses.size(); }
  std::size_t scan_file_count() const { return matches_.size(); }
  /// Number of scans that were left out because they have no pose.
  std::size_t missing_pose_count() const { return scan_file_count() - size(); }

 private:
  struct Scan {
    std::filesystem::path file;
    std::string name;
    std::uint64_t number = 0;
    double time = 0.0;
    std::size_t match = 0;  ///< index in matches_
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
  };
  enum class Labels { kNone, kFiles, kColumn };

  void open_log();
  void list_scans();
  void check_names() const;
  void read_poses();
  void read_viewpoints();
  void read_calibration(const std::filesystem::path& poses_file);
  std::filesystem::path find_poses() const;
  std::filesystem::path find_beside(const std::filesystem::path& poses_file,
                                    const std::vector<const char*>& names) const;
  std::optional<std::vector<double>> find_times(const std::filesystem::path& poses_file);
  std::optional<std::vector<double>> times_of_names() const;
  void match_scans(const std::filesystem::path& poses_file);
  void match_rows(const std::filesystem::path& poses_file);
  void match_times(const std::filesystem::path& poses_file, const std::vector<double>& times);
  void place_scans(const std::filesystem::path& poses);
  void find_columns();
  PointFrame guess_frame() const;
  ScanAddress address(std::size_t i) const;

  std::filesystem::path folder_;
  std::filesystem::path scan_folder_;
  RecordingOptions options_;
  std::shared_ptr<const ScanReader> reader_;  ///< copies of a recording read one file
  ScanFormat format_ = ScanFormat::kBin;
  PointFrame frame_ = PointFrame::kSensor;
  Labels labels_ = Labels::kNone;
  PointColumns columns_;
  bool numbered_ = false;  ///< all names are numbers
  bool has_viewpoints_ = false;
  bool has_calibration_ = false;
  Eigen::Isometry3d Tr_ = Eigen::Isometry3d::Identity();  ///< of calib.txt
  Trajectory trajectory_;
  std::vector<std::optional<TrajectoryMatch>> matches_;  ///< per scan file
  std::vector<Scan> scans_;
  std::vector<std::filesystem::path> files_;  ///< but for labels
  std::optional<std::string> early_end_;
  std::vector<std::string> notes_;
};

}  // namespace dynains
