// Sequences in the layout of KITTI odometry and SemanticKITTI.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/points.hpp"

namespace dynains {

/// A folder of scans and poses:
///
///   velodyne/NNNNNN.bin   float32 x y z intensity, sensor frame, metres
///   poses.txt             one row a scan: the upper 3x4 of the pose P, row by row
///   calib.txt             optional: `Tr`, from the sensor to the frame of the poses (without it:
///                         identity)
///   times.txt             optional: one row a scan, seconds (without it: 0.1 s times the row)
///   labels/NNNNNN.label   optional: uint32 a point, class in the lower, instance in the upper 16
///                         bits
///
/// Scan NNNNNN has row NNNNNN, counted from 0. Exception: if a number exceeds the number of rows
/// and there are as many rows as scans (a clip of a longer recording), the i-th scan has row i.
/// Rows beyond the last scan are ignored.
///
/// All members throw IoError with path, position and expectation.
class KittiSequence {
 public:
  /// Reads and checks all files except scans and labels.
  explicit KittiSequence(const std::filesystem::path& folder);

  const std::filesystem::path& folder() const { return folder_; }
  std::size_t size() const { return scans_.size(); }
  bool has_labels() const { return has_labels_; }

  /// Name of scan i without extension, for example "000123".
  const std::string& name(std::size_t i) const { return scans_.at(i).name; }
  /// Seconds, strictly increasing.
  double time(std::size_t i) const { return scans_.at(i).time; }
  /// Tr^-1 P Tr: pose of the sensor in the world. The world frame is the sensor frame at P =
  /// identity.
  const Eigen::Isometry3d& T_world_sensor(std::size_t i) const {
    return scans_.at(i).T_world_sensor;
  }

  /// Number of points of scan i by the size of its file; throws unless that is a multiple of a
  /// point.
  std::size_t point_count(std::size_t i) const;

  /// x y z intensity of every point, interleaved. Values are as stored: NaN and infinity too.
  std::vector<float> read_scan(std::size_t i) const;
  /// Reads a scan into a vector whose memory is reused.
  void read_scan(std::size_t i, std::vector<float>& xyzi) const;

  /// One label per point of scan i; throws if the counts differ.
  std::vector<std::uint32_t> read_labels(std::size_t i) const;

 private:
  struct Scan {
    std::string name;
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    double time = 0.0;
  };

  std::filesystem::path scan_path(std::size_t i) const;

  std::filesystem::path folder_;
  std::vector<Scan> scans_;
  bool has_labels_ = false;
};

/// Number of points of a file NNNNNN.bin by its size; throws unless that is a multiple of a point.
std::size_t count_scan_points(const std::filesystem::path& file);
/// Reads x y z intensity of every point of a scan NNNNNN.bin, interleaved.
void read_scan(const std::filesystem::path& file, std::vector<float>& xyzi);

/// Reads a file of labels: one uint32 per point. `count` is the number of points it must have.
std::vector<std::uint32_t> read_labels(const std::filesystem::path& file, std::size_t count);

/// Writers of the same layout. Each file appears whole or not at all; folders must exist.
/// Scans and labels are not synced one by one: see `sync_files()`.
/// Throw IoError.
void write_scan(const std::filesystem::path& file, Span<const float> xyzi);
void write_labels(const std::filesystem::path& file, Span<const std::uint32_t> labels);
/// Rows P as they stand in poses.txt. P is T_world_sensor if there is no calib.txt.
void write_poses(const std::filesystem::path& file, Span<const Eigen::Isometry3d> poses);
void write_times(const std::filesystem::path& file, Span<const double> times);
void write_calib(const std::filesystem::path& file, const Eigen::Isometry3d& Tr);

}  // namespace dynains
