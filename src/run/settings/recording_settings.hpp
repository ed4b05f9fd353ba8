// Options of a recording as a list of settings: the flags of the program and the keyword arguments
// of Python.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "dynains/io/recording.hpp"
#include "dynains/io/trajectory.hpp"
#include "dynains/parameters.hpp"

namespace dynains::run {

/// A setting of a string or a path, which is the text as it is.
template <class T>
auto plain_text(const char* name, T& value, const char* values, const char* help) {
  const auto read = [](const std::string& text) { return std::remove_const_t<T>(text); };
  return TextParameter{name, value, read, values, help};
}

/// m of "m", "cm" or "mm". Throws ConfigError.
double read_length_unit(const std::string& text);
/// s of "s", "ms", "us", "ns" or a number above 0; 0 of "auto". Throws ConfigError.
double read_time_unit(const std::string& text);

struct RecordingSettings {
  RecordingOptions options;
  /// Flag -> text of what was assigned by flag, such as {"--pose-shift": "1"}.
  nlohmann::ordered_json flags = nlohmann::ordered_json::object();

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor);

  /// The options, with the files that flags name. Throws ConfigError for settings that exclude each
  /// other.
  RecordingOptions checked() const;

  /// Assigns the setting of a flag; false if none has it. `name` starts the message of a
  /// ConfigError for a text that is none of its values.
  bool assign(const std::string& flag, const std::string& text, const std::string& name);
  /// Assigns `flags` of an earlier command, unless they are assigned. Throws ConfigError, also for
  /// a flag that none has.
  void complete(const nlohmann::ordered_json& earlier);
  /// `recording` and the flags as a shell reads them, so that a message can propose a command.
  /// Flags in `further` replace those that were given.
  std::string as_given(const std::string& recording, const std::string& further = "") const;
};

template <class Self, class Visitor>
void RecordingSettings::visit(Self& self, Visitor&& visitor) {
  auto& o = self.options;
  auto& c = o.convention;
  visitor(plain_text(
      "poses", o.poses, "FILE",
      "file of poses: 12 numbers a row (KITTI), time x y z qx qy qz qw (TUM), or CSV with named "
      "columns; interpolated if rows and scans have times [of the recording]"));
  visitor(plain_text("times", o.times, "FILE",
                     "file with the time of each scan, s [of the recording]"));
  visitor(Parameter{"frame", o.frame, Bounds(), "", "frame of the points"});
  visitor(Parameter{"invert_poses", c.invert, Bounds(), "",
                    "poses are from the world to the sensor, not from it"});
  visitor(TextParameter{"pose_units", c.unit, &read_length_unit, "m|cm|mm",
                        "unit of the translations [m]"});
  visitor(Parameter{"pose_scale", c.scale, closed(kMinPoseScale, kMaxPoseScale), "",
                    "factor of the translations, for an odometry with a wrong scale"});
  visitor(Parameter{"quaternion_order", c.quaternion, Bounds(), "",
                    "order of quaternions in the file of poses; auto: as its form has it"});
  visitor(
      Parameter{"pose_frame", c.frame, Bounds(), "",
                "whose poses they are; auto: camera for 12 numbers a row beside calib.txt, else "
                "lidar. A camera without calib.txt looks along the x axis of the lidar"});
  visitor(Parameter{"left_handed_poses", c.left_handed, Bounds(), "",
                    "poses have y to the right, as in some simulators"});
  visitor(Parameter{"pose_shift", c.shift, closed(-1000000, 1000000), "",
                    "scan i has the pose of scan i + N"});
  visitor(Parameter{"deskew", o.deskew, Bounds(), "",
                    "move points by the interpolated poses to the time of their scan; needs a time "
                    "for each point"});
  visitor(TextParameter{"point_time_unit", o.point_time_unit, &read_time_unit, "UNIT",
                        "unit of the times of points: s, ms, us, ns, or seconds, such as 0.1 for "
                        "times from 0 to 1 in scans of 0.1 s [auto: by their span]"});
  visitor(TextParameter{"point_units", o.point_unit, &read_length_unit, "m|cm|mm",
                        "unit of the coordinates of points [m]"});
  visitor(TextParameter{"bin_columns", o.bin_layout, &parse_bin_layout, "N[d][:BYTES]",
                        "columns of .bin scans: x y z, intensity, others; float32, or float64 by a "
                        "d, such as 3d; 4:26 if points have 26 bytes [4]"});
  visitor(TextParameter{"self_box", o.self_boxes, &parse_self_boxes, "\"X Y Z X Y Z\"",
                        "box around a part of the own vehicle, whose points are left out: two "
                        "opposite corners in m, frame of the lidar; further boxes follow in the "
                        "same text"});
  visitor(
      Parameter{"accept_missing", o.accept_missing, Bounds(), "",
                "read a log although parts of it are missing, and leave out files of scans that "
                "are cut off"});
  visitor(TextParameter{
      "extrinsic", c.T_body_sensor, &read_extrinsic, "POSE",
      "pose of the lidar in the body whose poses are given (IMU, base_link, antenna): \"x y z qx "
      "qy qz qw\" in m, or a file with one pose [the poses are those of the lidar]"});
  visitor(TextParameter{
      "sensor_origin", o.sensor_origin, &read_sensor_origin, "XYZ",
      "position of the lidar in the frame of the clouds, for clouds that were moved into a body "
      "frame (base_link) before they were recorded: \"x y z\" in m, or a pose as of extrinsic [0 0 "
      "0]"});
  visitor(TextParameter{
      "sensors", o.sensors, &read_sensor_poses, "FILE",
      "poses of several lidars in the frame of the clouds, a row each: 3x4, or x y z qx qy qz qw "
      "in m. Which one measured a point is in sensor/NAME.id (uint8) or in a column sensor, "
      "lidar_id, lidar_index, d or laser_number [sensors.txt, if it is there]"});
  visitor(Parameter{"sensor_beams", o.sensor_beams, closed(0, 255), "beams",
                    "beams of one lidar, if laser_number counts those of all; 0: it is the lidar"});
  visitor(Parameter{"time_offset", o.time_offset, closed(-1e12, 1e12), "s",
                    "a scan at time t has the pose at t + S, for clocks that differ"});
  visitor(Parameter{"pose_gap", o.pose_gap, closed(0.0, 1000.0), "s",
                    "longest time between two poses of a file for interpolation"});
  visitor(plain_text("cloud_topic", o.cloud_topic, "NAME",
                     "topic of the clouds of a log, or A,B,C for several sensors [the only one]"));
  visitor(plain_text("frame_id", o.cloud_frame, "NAME",
                     "frame of the clouds of a log that count, if several sensors share their "
                     "topic [the only one]"));
  visitor(plain_text("nuscenes_scene", o.scene, "NAME",
                     "scene of nuScenes, for example scene-0061 [the only one]"));
  visitor(plain_text("pose_topic", o.pose_topic, "NAME",
                     "topic of the poses of a log: Odometry, PoseStamped or TF [the only one, "
                     "else TF]"));
  visitor(plain_text("pose_frame_id", o.pose_frame, "NAME",
                     "take the poses of a log from TF, in this fixed frame [the root of the "
                     "tree]"));
  visitor(plain_text("sensor_frame", o.sensor_frame, "NAME",
                     "frame of the lidar in TF of a log, or A,B,C for several; gives the sensor "
                     "origin, or the sensors [that of the clouds]"));
}

}  // namespace dynains::run
