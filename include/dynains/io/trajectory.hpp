// Reader of trajectory files, interpolation of poses, and single poses as text.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dynains/pose.hpp"

namespace dynains {

enum class QuaternionOrder { kNone, kXyzw, kWxyz };

/// Names as in options.
constexpr std::array<const char*, 3> value_names(QuaternionOrder) {
  return {"auto", "xyzw", "wxyz"};
}

/// Rows of a trajectory file, in the frame, direction and unit of the file.
struct Trajectory {
  std::vector<Pose> poses;
  std::vector<double> times;  ///< s, strictly increasing; empty if the file has none
  QuaternionOrder order = QuaternionOrder::kNone;  ///< kNone for matrices
};

/// Reads a text file with one pose per row. Blanks, commas or semicolons separate the columns. A
/// header determines the meaning of the columns. Without a header, their number determines it:
///
///   12  KITTI: the upper 3x4 of the matrix, row-major
///   13  time and the upper 3x4 of the matrix, row-major
///   16  the 4x4 matrix, row-major
///    8  TUM: time x y z qx qy qz qw
///    7  x y z qx qy qz qw
///
/// A header is the first line, with or without a leading #. It contains, in any order, columns for
/// time (t, time, stamp, timestamp ...), position (x, tx, p_x, pos_x ...) and rotation (qx, q_x,
/// quat_x, orientation.x ...); other columns are ignored. Other lines that start with # are
/// comments. Times are converted by to_seconds(). Throws IoError with path, line and expected
/// content.
Trajectory read_trajectory(const std::filesystem::path& path);

/// Indices of the rows before and after a time, and the relative position of the time in [0, 1].
struct TrajectoryMatch {
  std::size_t before = 0;
  std::size_t after = 0;
  double share = 0.0;
};

/// Default of the longest interval between two poses for interpolation, s.
inline constexpr double kMaxPoseGap = 1.0;

/// Rows around `time` (s). Empty if the time is more than 5 ms outside of the trajectory, or within
/// an interval longer than `longest_gap` (s).
std::optional<TrajectoryMatch> match_time(const Trajectory& trajectory, double time,
                                          double longest_gap = kMaxPoseGap);

/// Interpolates linearly in translation and by slerp in rotation. `share`: [0, 1]; 0 gives exactly
/// `a`, 1 exactly `b`.
Pose interpolate(const Pose& a, const Pose& b, double share);
/// As interpolate(), also before `a` (share < 0) and behind `b` (share > 1), at the same velocity.
Pose extrapolate(const Pose& a, const Pose& b, double share);

/// Converts a stamp to seconds. Numbers above 1e11, 1e14 and 1e17 are in ms, us and ns since 1970.
double to_seconds(double stamp);

/// Pose of the sensor in the body, T_body_sensor, m. `text` is `x y z qx qy qz qw`, with blanks or
/// commas between the numbers, or the path of a file with one pose in a form of read_trajectory().
/// Throws ConfigError for seven values that are no pose, IoError for a file that has no pose or
/// more than one.
Pose read_extrinsic(const std::string& text);

/// Position of the sensor in the frame of the clouds, m. `text` is `x y z`, with blanks or commas,
/// or a pose as for read_extrinsic(). Throws ConfigError and IoError.
Eigen::Vector3d read_sensor_origin(const std::string& text);

/// Poses of several sensors in the frame of the clouds, m: the rows of a file as of
/// read_trajectory(). Throws IoError.
std::vector<Pose> read_sensor_poses(const std::string& file);

/// `x y z qx qy qz qw` of a pose, with six decimals.
std::string extrinsic_text(const Pose& T_body_sensor);

}  // namespace dynains
