#include "recording_settings.hpp"

#include <algorithm>
#include <array>

#include "arrays.hpp"
#include "dynains/io/extrinsic.hpp"
#include "settings.hpp"

namespace dynains::python {
namespace {

bool is_text(const py::handle& value) {
  return py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__");
}

Pose to_extrinsic(const py::handle& value) {
  return is_text(value) ? read_extrinsic(to_path(value).string()) : to_pose(value);
}

/// The text of --sensor-origin.
std::string to_origin(const py::handle& value) {
  if (is_text(value)) return to_path(value).string();
  std::string text;
  for (const py::handle& number : py::list(py::reinterpret_borrow<py::object>(value))) {
    text += (text.empty() ? "" : " ") +
            py::repr(py::float_(py::reinterpret_borrow<py::object>(number))).cast<std::string>();
  }
  return text;
}

const std::array<Setting<RecordingOptions>, 25> kRecordingSettings{{
    {"poses", "a path",
     "file of poses: 12 numbers a row (KITTI), time x y z qx qy qz qw (TUM), or CSV with named "
     "columns",
     [](RecordingOptions& o, const py::handle& v) { o.poses = to_path(v); }},
    {"times", "a path", "file with the time of each scan, s",
     [](RecordingOptions& o, const py::handle& v) { o.times = to_path(v); }},
    {"frame", "'auto', 'sensor' or 'world'", "frame of the points",
     [](RecordingOptions& o, const py::handle& v) { o.frame = to_enum<PointFrame>(v); }},
    {"invert_poses", "bool", "poses are from the world to the sensor, not from it",
     [](RecordingOptions& o, const py::handle& v) { o.convention.invert = to_flag(v); }},
    {"pose_units", "'m', 'cm' or 'mm'", "unit of the translations",
     [](RecordingOptions& o, const py::handle& v) {
       o.convention.unit = choose<double>(v, {{"m", 1.0}, {"cm", 0.01}, {"mm", 0.001}});
     }},
    {"pose_scale", "float in [0.1, 10]",
     "factor of the translations, for an odometry with a wrong scale",
     [](RecordingOptions& o, const py::handle& v) {
       o.convention.scale = to_number(v, kLeastPoseScale, kLargestPoseScale);
     }},
    {"quaternion_order", "'auto', 'xyzw' or 'wxyz'", "order of quaternions in the file of poses",
     [](RecordingOptions& o, const py::handle& v) {
       o.convention.quaternion = to_enum<QuaternionOrder>(v);
     }},
    {"pose_frame", "'auto', 'lidar' or 'camera'", "whose poses they are",
     [](RecordingOptions& o, const py::handle& v) { o.convention.frame = to_enum<PoseFrame>(v); }},
    {"left_handed_poses", "bool", "poses have y to the right, as in some simulators",
     [](RecordingOptions& o, const py::handle& v) { o.convention.left_handed = to_flag(v); }},
    {"pose_shift", "int in [-1000000, 1000000]", "scan i has the pose of scan i + pose_shift",
     [](RecordingOptions& o, const py::handle& v) {
       o.convention.shift = static_cast<int>(to_whole_number(v, -1000000, 1000000));
     }},
    {"deskew", "bool",
     "move points by the interpolated poses to the time of their scan; needs a time for each point",
     [](RecordingOptions& o, const py::handle& v) { o.deskew = to_flag(v); }},
    {"point_time_unit", "'auto', 's', 'ms', 'us', 'ns' or float above 0",
     "unit of the times of points, or its seconds",
     [](RecordingOptions& o, const py::handle& v) {
       o.point_time_unit =
           is_text(v)
               ? choose<double>(
                     v, {{"auto", 0.0}, {"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}})
               : to_number(v, 1e-12, 1e12);
     }},
    {"point_units", "'m', 'cm' or 'mm'", "unit of the coordinates of points",
     [](RecordingOptions& o, const py::handle& v) {
       o.point_unit = choose<double>(v, {{"m", 1.0}, {"cm", 0.01}, {"mm", 0.001}});
     }},
    {"bin_columns", "str",
     "columns of .bin scans: x y z, intensity, others; '5' for float32, '3d' for float64",
     [](RecordingOptions& o, const py::handle& v) {
       o.bin_layout = parse_bin_layout(py::str(v).cast<std::string>());
     }},
    {"self_box", "'x y z x y z'",
     "boxes around parts of the own vehicle, whose points are left out: two opposite corners each, "
     "m, frame of the lidar",
     [](RecordingOptions& o, const py::handle& v) {
       o.self_boxes = parse_self_boxes(v.cast<std::string>());
     }},
    {"accept_missing", "bool", "read a log although parts of it are missing",
     [](RecordingOptions& o, const py::handle& v) { o.accept_missing = to_flag(v); }},
    {"extrinsic", "(4, 4) numbers, 'x y z qx qy qz qw' in m, or a path",
     "pose of the lidar in the body whose poses are given (IMU, base_link, antenna)",
     [](RecordingOptions& o, const py::handle& v) {
       o.convention.T_body_sensor = to_extrinsic(v);
     }},
    {"sensor_origin", "three numbers, 'x y z' in m, or a path as for extrinsic",
     "position of the lidar in the frame of the clouds, for clouds that were moved into a body "
     "frame before they were recorded",
     [](RecordingOptions& o, const py::handle& v) {
       o.sensor_origin = read_sensor_origin(to_origin(v));
     }},
    {"time_offset", "finite float", "a scan at time t has the pose at t + time_offset, s",
     [](RecordingOptions& o, const py::handle& v) { o.time_offset = to_number(v); }},
    {"pose_gap", "float in [0, 1000]",
     "longest time between two poses of a file for interpolation, s",
     [](RecordingOptions& o, const py::handle& v) { o.pose_gap = to_number(v, 0.0, 1000.0); }},
    {"cloud_topic", "str", "topic of the clouds of a log",
     [](RecordingOptions& o, const py::handle& v) { o.cloud_topic = v.cast<std::string>(); }},
    {"pose_topic", "str", "topic of the poses of a log: Odometry, PoseStamped or TF",
     [](RecordingOptions& o, const py::handle& v) { o.pose_topic = v.cast<std::string>(); }},
    {"pose_frame_id", "str", "take the poses of a log from TF, in this fixed frame",
     [](RecordingOptions& o, const py::handle& v) { o.pose_frame = v.cast<std::string>(); }},
    {"sensor_frame", "str", "frame of the lidar in TF of a log; gives sensor_origin",
     [](RecordingOptions& o, const py::handle& v) { o.sensor_frame = v.cast<std::string>(); }},
    {"nuscenes_scene", "str", "scene of nuScenes, for example 'scene-0061'",
     [](RecordingOptions& o, const py::handle& v) { o.scene = v.cast<std::string>(); }},
}};

}  // namespace

RecordingOptions to_recording_options(const py::dict& values) {
  RecordingOptions options;
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    if (assign_setting(kRecordingSettings, options, name, value)) continue;
    refuse(name, recording_setting_names());
  }
  return options;
}

std::vector<std::string> recording_setting_names() {
  std::vector<std::string> names;
  names.reserve(kRecordingSettings.size());
  for (const auto& setting : kRecordingSettings) names.emplace_back(setting.name);
  return names;
}

py::dict to_flags(const py::dict& values) {
  py::dict flags;
  for (const auto& [key, value] : values) {
    std::string flag = "--" + py::str(key).cast<std::string>();
    std::replace(flag.begin(), flag.end(), '_', '-');
    if (py::isinstance<py::bool_>(value)) {
      if (value.cast<bool>()) flags[flag.c_str()] = "true";
    } else if (flag == "--extrinsic") {
      flags[flag.c_str()] = is_text(value) ? py::str(to_path(value).string())
                                           : py::str(extrinsic_text(to_pose(value)));
    } else if (flag == "--sensor-origin") {
      flags[flag.c_str()] = py::str(to_origin(value));
    } else {
      flags[flag.c_str()] = py::str(is_text(value) ? py::cast(to_path(value).string())
                                                   : py::reinterpret_borrow<py::object>(value));
    }
  }
  return flags;
}

py::dict from_flags(const py::dict& flags) {
  py::dict values;
  for (const auto& [flag, value] : flags) {
    std::string name = py::str(flag);
    if (name.rfind("--", 0) == 0) name.erase(0, 2);
    std::replace(name.begin(), name.end(), '-', '_');
    values[name.c_str()] = value;
  }
  return values;
}

std::string describe_recording_settings() { return describe_settings(kRecordingSettings); }

}  // namespace dynains::python
