// Poses over time, in the forms that odometry programs write.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

namespace dynains {

enum class QuaternionOrder { kNone, kXyzw, kWxyz };

/// Rows of a trajectory file as they stand: frame, direction and unit are those of the file.
struct Trajectory {
  std::vector<Eigen::Isometry3d> poses;
  std::vector<double> times;  ///< s, strictly increasing; empty if the file has none
  QuaternionOrder order = QuaternionOrder::kNone;  ///< as read; kNone: rows are matrices
};

/// Reads a text file with one pose a row; blanks, commas or semicolons separate the columns. What
/// the columns are follows from a header with names, or else from their number:
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
/// Times are seconds; numbers that can only be nanoseconds, microseconds or milliseconds since 1970
/// are recognised. Throws IoError with path, line and expectation.
Trajectory read_trajectory(const std::filesystem::path& path);

/// Rows on both sides of a time, and how far it is from the first to the second, in [0, 1].
struct TrajectoryMatch {
  std::size_t before = 0;
  std::size_t after = 0;
  double share = 0.0;
};

/// Longest gap between two poses, in s, that is interpolated.
inline constexpr double kLongestPoseGap = 1.0;

/// The rows around `time`; nothing beyond the ends (5 ms are forgiven) or within a longer gap.
std::optional<TrajectoryMatch> match_time(const Trajectory& trajectory, double time);

/// Linear in translation, slerp in rotation; `share` 0 is exactly `a`, 1 exactly `b`.
Eigen::Isometry3d interpolate(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double share);

/// Seconds from a number that may count nanoseconds, microseconds or milliseconds since 1970.
double to_seconds(double stamp);

}  // namespace dynains
