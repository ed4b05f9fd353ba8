// Sequences in the layout of KITTI odometry and SemanticKITTI.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains {

/// A folder of scans and poses:
///
///   velodyne/NNNNNN.bin   float32 x y z intensity, sensor frame, metres
///   poses.txt             one row per scan: the upper 3x4 of the pose P, row-major
///   calib.txt             optional: `Tr`, from the sensor to the frame of the poses; default:
///                         identity
///   times.txt             optional: one row per scan, s; default: 0.1 s times the row index
///   labels/NNNNNN.label   optional: uint32 per point, class in the lower, instance in the upper 16
///                         bits
///
/// Scan NNNNNN has row NNNNNN, counted from 0. Exception: if a number exceeds the number of rows
/// and the numbers of rows and scans are equal (a clip of a longer recording), the i-th scan has
/// row i. Rows without a scan are ignored.
///
/// All members throw IoError with path, position and expected content.
class KittiSequence {
 public:
  /// Reads and checks all files except scans and labels.
  explicit KittiSequence(const std::filesystem::path& folder);

  const std::filesystem::path& folder() const { return folder_; }
  std::size_t size() const { return scans_.size(); }
  bool has_labels() const { return has_labels_; }

  /// Name of scan i without extension, for example "000123".
  const std::string& name(std::size_t i) const { return scans_.at(i).name; }
  /// Time of scan i, s, strictly increasing.
  double time(std::size_t i) const { return scans_.at(i).time; }
  /// Pose of the sensor in the world at scan i: Tr^-1 P Tr. The world frame is the sensor frame for
  /// P = identity.
  const Pose& T_world_sensor(std::size_t i) const { return scans_.at(i).T_world_sensor; }

  /// Number of points of scan i, from the size of its file. Throws unless the size is a multiple of
  /// 16 bytes.
  std::size_t point_count(std::size_t i) const;

  /// x y z intensity of each point of scan i, interleaved, m, sensor frame. May contain NaN and
  /// infinity.
  std::vector<float> read_scan(std::size_t i) const;
  /// Reads scan i and reuses the memory of `xyzi`.
  void read_scan(std::size_t i, std::vector<float>& xyzi) const;

  /// One label per point of scan i. Throws if the numbers of labels and points differ.
  std::vector<std::uint32_t> read_labels(std::size_t i) const;

 private:
  struct Scan {
    std::string name;
    Pose T_world_sensor = Pose::Identity();
    double time = 0.0;
  };

  std::filesystem::path scan_path(std::size_t i) const;

  std::filesystem::path folder_;
  std::vector<Scan> scans_;
  bool has_labels_ = false;
};

/// Number of points of a file NNNNNN.bin, from its size. Throws IoError unless the size is a
/// multiple of 16 bytes.
std::size_t count_scan_points(const std::filesystem::path& file);
/// Reads x y z intensity of each point of a file NNNNNN.bin, interleaved. Throws IoError.
void read_scan(const std::filesystem::path& file, std::vector<float>& xyzi);

/// Reads a file of labels, one uint32 per point. Throws IoError unless it has `count` labels.
std::vector<std::uint32_t> read_labels(const std::filesystem::path& file, std::size_t count);
/// Throws IoError unless the file has the size of `count` labels.
void check_labels(const std::filesystem::path& file, std::size_t count);

/// Writers of this layout. Each file is replaced atomically; folders must exist. Scans and labels
/// are not synchronized with the disk: see `sync_files()`. They throw IoError.
void write_scan(const std::filesystem::path& file, Span<const float> xyzi);
void write_labels(const std::filesystem::path& file, Span<const std::uint32_t> labels);
/// `poses`: the poses P of poses.txt, equal to T_world_sensor without calib.txt.
void write_poses(const std::filesystem::path& file, Span<const Pose> poses);
void write_times(const std::filesystem::path& file, Span<const double> times);
void write_calib(const std::filesystem::path& file, const Pose& Tr);

}  // namespace dynains
