// Files in the layout of KITTI odometry and SemanticKITTI, which Recording reads.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains {

// A folder of scans and poses:
//
//   velodyne/NNNNNN.bin   float32 x y z intensity, sensor frame, metres
//   poses.txt             one row per scan: the upper 3x4 of the pose P, row-major
//   calib.txt             optional: `Tr`, from the sensor to the frame of the poses; default:
//                         identity
//   times.txt             optional: one row per scan, s; default: 0.1 s times the row index
//   labels/NNNNNN.label   optional: uint32 per point, class in the lower, instance in the upper 16
//                         bits
//
// Scan NNNNNN has row NNNNNN, counted from 0. Exception: if a number exceeds the number of rows
// and the numbers of rows and scans are equal (a clip of a longer recording), the i-th scan has
// row i. Rows without a scan are ignored.

/// Reads x y z intensity of each point of a file NNNNNN.bin, interleaved. Throws IoError, also
/// unless the size is a multiple of 16 bytes.
void read_scan(const std::filesystem::path& file, std::vector<float>& xyzi);

/// Reads a file of labels, one uint32 per point. Throws IoError unless it has `count` labels.
std::vector<std::uint32_t> read_labels(const std::filesystem::path& file, std::size_t count);

/// Reads a file of one byte per point. Empty if there is no such file. Throws IoError unless it has
/// `count` bytes.
std::vector<std::uint8_t> read_point_bytes(const std::filesystem::path& file, std::size_t count);

/// Writers of this layout. Each file is replaced atomically; folders must exist. Scans, labels
/// and bytes are not synchronized with the disk: see `sync_files()`. All throw IoError.
///
/// `xyzi`: x y z intensity of each point, interleaved, m.
void write_scan(const std::filesystem::path& file, Span<const float> xyzi);
/// `labels`: class in the lower, instance in the upper 16 bits.
void write_labels(const std::filesystem::path& file, Span<const std::uint32_t> labels);
/// `bytes`: one per point.
void write_point_bytes(const std::filesystem::path& file, Span<const std::uint8_t> bytes);
/// `poses`: the poses P of poses.txt, equal to T_world_sensor without calib.txt.
void write_poses(const std::filesystem::path& file, Span<const Pose> poses);
/// `times`: s, one per scan.
void write_times(const std::filesystem::path& file, Span<const double> times);
/// `Tr`: m, from the sensor to the frame of the poses P.
void write_calib(const std::filesystem::path& file, const Pose& Tr);

}  // namespace dynains
