// Reader of trajectory files, their conventions, interpolation of poses, and single poses as text.
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

/// Moving frame of the poses in a file.
enum class PoseFrame {
  kAuto,   ///< kCamera for rows of 12 numbers with a calib.txt, else kLidar
  kLidar,  ///< frame of the points
  kCamera  ///< z forward, x right, y down; converted by `Tr` of calib.txt, else by camera_axes()
};

/// Names as in options.
constexpr std::array<const char*, 3> value_names(PoseFrame) { return {"auto", "lidar", "camera"}; }

/// Range of PoseConvention::scale.
inline constexpr double kMinPoseScale = 0.1;
inline constexpr double kMaxPoseScale = 10.0;

/// Conversion of the rows of a pose file to poses of the sensor in the world frame, m. By default,
/// rows are used without conversion.
struct PoseConvention {
  bool invert = false;       ///< rows are T_sensor_world
  double unit = 1.0;         ///< m per unit of translation, for example 0.001 for millimetres
  double scale = 1.0;        ///< factor of translations, for an odometry with a wrong scale
  bool left_handed = false;  ///< the y axis of the poses is mirrored, as in some simulators
  PoseFrame frame = PoseFrame::kAuto;
  /// Order of the quaternions in the file; kNone: the order that its format defines.
  QuaternionOrder quaternion = QuaternionOrder::kNone;
  int shift = 0;  ///< scan i has the pose of scan i + shift
  /// Extrinsic calibration: pose of the sensor in the body whose poses the file has, m.
  Pose T_body_sensor = Pose::Identity();
};

/// Applies a convention, except `frame`, `shift` and `T_body_sensor`, to a row. `read_as`: order in
/// which the quaternion of the row was read.
inline Pose apply(const PoseConvention& convention, const Pose& row, QuaternionOrder read_as) {
  Pose pose = row;
  const QuaternionOrder meant = convention.quaternion;
  if (meant != QuaternionOrder::kNone && read_as != QuaternionOrder::kNone && meant != read_as) {
    const detail::Quaternion q(row.linear());
    const detail::Quaternion other = meant == QuaternionOrder::kWxyz
                                         ? detail::Quaternion(q.x(), q.y(), q.z(), q.w())
                                         : detail::Quaternion(q.z(), q.w(), q.x(), q.y());
    pose.linear() = other.normalized().toRotationMatrix();
  }
  pose.translation() *= convention.unit * convention.scale;
  if (convention.invert) pose = pose.inverse();
  if (convention.left_handed) {
    const Eigen::Vector3d mirror(1.0, -1.0, 1.0);
    pose.linear() = (mirror.asDiagonal() * pose.linear() * mirror.asDiagonal()).eval();
    pose.translation() = mirror.cwiseProduct(pose.translation());
  }
  return pose;
}

/// T_camera_sensor for a sensor with x forward, y left, z up and a camera with z forward, x right,
/// y down, and a common origin.
inline Pose camera_axes() {
  Pose T_camera_sensor = Pose::Identity();
  T_camera_sensor.linear() << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return T_camera_sensor;
}

}  // namespace dynains
