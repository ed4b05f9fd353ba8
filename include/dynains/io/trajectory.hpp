// Trajectory files: poses over time.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

namespace dynains {

enum class QuaternionOrder { kNone, kXyzw, kWxyz };

/// Rows of a trajectory file: frame, direction and unit are those of the file.
struct Trajectory {
  std::vector<Eigen::Isometry3d> poses;
  std::vector<double> times;  ///< s, strictly increasing; empty if the file has none
  QuaternionOrder order = QuaternionOrder::kNone;  ///< kNone: rows are matrices
};

/// Reads a text file with one pose a row; blanks, commas or semicolons separate the columns. A
/// header names the columns; without a header, their number decides:
///
///   12  KITTI: the upper 3x4 of the matrix, row by row
///   13  time, then the same
///   16  the whole 4x4 matrix
///    8  TUM: time x y z qx qy qz qw
///    7  x y z qx qy qz qw
///
/// A header (its first line, with or without a leading #) names a column for time (t, time, stamp,
/// timestamp ...), position (x, tx, p_x, pos_x ...) and rotation (qx, q_x, quat_x, orientation.x
/// ...) in any order; other columns are ignored. Other lines that start with # are comments.
/// Times are seconds; see to_seconds() for other units. Throws IoError with path, line and
/// expectation.
Trajectory read_trajectory(const std::filesystem::path& path);

/// The rows before and after a time, and the position of the time between them in [0, 1].
struct TrajectoryMatch {
  std::size_t before = 0;
  std::size_t after = 0;
  double share = 0.0;
};

/// Longest gap between two poses that is interpolated, s.
inline constexpr double kLongestPoseGap = 1.0;

/// The rows around `time` (s). Nothing if the time is more than 5 ms outside of the trajectory, or
/// in a gap longer than kLongestPoseGap.
std::optional<TrajectoryMatch> match_time(const Trajectory& trajectory, double time);

/// Linear in translation, slerp in rotation; `share` 0 is exactly `a`, 1 exactly `b`.
Eigen::Isometry3d interpolate(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double share);

/// Converts a stamp to seconds. Numbers above 1e11, 1e14 and 1e17 are milliseconds, microseconds
/// and nanoseconds since 1970.
double to_seconds(double stamp);

}  // namespace dynains
