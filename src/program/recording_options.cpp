#include "recording_options.hpp"

#include <cmath>
#include <iostream>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/io/extrinsic.hpp"
#include "dynains/parameters.hpp"
#include "run/json_file.hpp"

namespace dynains::program {
namespace {

constexpr const char* kGroup = "What the files of SEQ mean (dynains check SEQ finds out)";

/// Accepts the names of the values of an enumeration.
template <class Enum>
CLI::IsMember is_name_of() {
  const auto names = value_names(Enum());
  return CLI::IsMember(std::vector<std::string>(names.begin(), names.end()));
}

/// `word` as a shell reads it back.
std::string quoted(const std::string& word) {
  constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

RecordingFlags::RecordingFlags(CLI::App& command, const std::string& what, bool required)
    : command_(&command) {
  command
      .add_option("SEQ", folder_,
                  what +
                      ": KITTI or SemanticKITTI folder (velodyne/, poses.txt; optional calib.txt, "
                      "times.txt), folder of scans (.pcd, .ply, .bin, .las, .npy, .npz, .xyz or "
                      ".csv) with VIEWPOINT or a file of poses, or log of ROS (.mcap, .db3, .bag, "
                      "or a folder with metadata.yaml)")
      ->required(required)
      ->type_name("");
  command
      .add_option("--poses", poses_,
                  "file of poses: 12 numbers a row (KITTI), time x y z qx qy qz qw (TUM), or CSV "
                  "with named columns; interpolated if rows and scans have times [of SEQ]")
      ->type_name("FILE")
      ->group(kGroup);
  command.add_option("--times", times_, "file with the time of each scan, s [of SEQ]")
      ->type_name("FILE")
      ->group(kGroup);
  command.add_option("--frame", frame_, "frame of the points [auto]")
      ->check(is_name_of<PointFrame>())
      ->type_name("auto|sensor|world")
      ->group(kGroup);
  command
      .add_flag("--invert-poses", invert_, "poses are from the world to the sensor, not from it")
      ->group(kGroup);
  command.add_option("--pose-units", units_, "unit of the translations [m]")
      ->check(CLI::IsMember({"m", "cm", "mm"}))
      ->type_name("m|cm|mm")
      ->group(kGroup);
  command
      .add_option("--pose-scale", pose_scale_,
                  "factor of the translations, for an odometry with a wrong scale [1]")
      ->check(CLI::Range(kLeastPoseScale, kLargestPoseScale))
      ->type_name("N")
      ->group(kGroup);
  command
      .add_option("--quaternion-order", quaternion_,
                  "order of quaternions in the file [auto: as the form of the file has it]")
      ->check(is_name_of<QuaternionOrder>())
      ->type_name("auto|xyzw|wxyz")
      ->group(kGroup);
  command
      .add_option("--pose-frame", pose_frame_,
                  "whose poses they are [auto: camera for 12 numbers a row beside calib.txt, else "
                  "lidar]. A camera without calib.txt looks along the x axis of the lidar")
      ->check(is_name_of<PoseFrame>())
      ->type_name("auto|lidar|camera")
      ->group(kGroup);
  command
      .add_flag("--left-handed-poses", left_handed_,
                "poses have y to the right, as in some simulators")
      ->group(kGroup);
  command.add_option("--pose-shift", shift_, "scan i has the pose of scan i + N [0]")
      ->check(CLI::Range(-1000000, 1000000))
      ->type_name("N")
      ->group(kGroup);
  command
      .add_flag("--deskew", deskew_,
                "move points by the interpolated poses to the time of their scan; needs a time for "
                "each point")
      ->group(kGroup);
  command
      .add_option("--point-time-unit", point_time_unit_,
                  "unit of the times of points: s, ms, us, ns, or seconds, such as 0.1 for times "
                  "from 0 to 1 in scans of 0.1 s [auto: by their span]")
      ->type_name("UNIT")
      ->group(kGroup);
  command.add_option("--point-units", point_units_, "unit of the coordinates of points [m]")
      ->check(CLI::IsMember({"m", "cm", "mm"}))
      ->type_name("m|cm|mm")
      ->group(kGroup);
  command
      .add_option("--bin-columns", bin_columns_,
                  "columns of .bin scans: x y z, intensity, others; float32, or float64 by a d, "
                  "such as 3d [4]")
      ->type_name("N|Nd")
      ->group(kGroup);
  command
      .add_option("--self-box", self_box_,
                  "box around a part of the own vehicle, whose points are left out: two opposite "
                  "corners in m, frame of the lidar; further boxes follow in the same text")
      ->type_name("\"X Y Z X Y Z\"")
      ->group(kGroup);
  command
      .add_flag("--accept-missing", accept_missing_, "read a log although parts of it are missing")
      ->group(kGroup);
  command
      .add_option(
          "--extrinsic", extrinsic_,
          "pose of the lidar in the body whose poses are given (IMU, base_link, antenna): "
          "\"x y z qx qy qz qw\" in m, a file with one pose, or FILE:BODY:LIDAR, two frames "
          "of a .urdf or of a .yaml with static transforms [the poses are those of the "
          "lidar]")
      ->type_name("POSE")
      ->group(kGroup);
  command
      .add_option("--sensor-origin", sensor_origin_,
                  "position of the lidar in the frame of the clouds, for clouds that were moved "
                  "into a body frame (base_link) before they were recorded: \"x y z\" in m, or a "
                  "pose as of --extrinsic [0 0 0]")
      ->type_name("XYZ")
      ->group(kGroup);
  command
      .add_option("--time-offset", time_offset_,
                  "a scan at time t has the pose at t + S, for clocks that differ [0]")
      ->type_name("S")
      ->group(kGroup);
  command
      .add_option("--pose-gap", pose_gap_,
                  "longest time between two poses of a file for interpolation [1]")
      ->check(CLI::Range(0.0, 1000.0))
      ->type_name("S")
      ->group(kGroup);
  const auto add_name = [&](const char* flag, std::string& value, const char* help) {
    command.add_option(flag, value, help)->type_name("NAME")->group(kGroup);
  };
  add_name("--cloud-topic", cloud_topic_, "topic of the clouds of a log [the only one]");
  add_name("--nuscenes-scene", scene_, "scene of nuScenes, for example scene-0061 [the only one]");
  add_name("--pose-topic", pose_topic_,
           "topic of the poses of a log: Odometry, PoseStamped or TF [the only one, else TF]");
  add_name("--pose-frame-id", pose_frame_id_,
           "take the poses of a log from TF, in this fixed frame [the root of the tree]");
  add_name("--sensor-frame", sensor_frame_,
           "frame of the lidar in TF of a log; gives --sensor-origin [that of the clouds]");
}

nlohmann::ordered_json RecordingFlags::given_flags() const {
  auto flags = nlohmann::ordered_json::object();
  for (const CLI::Option* option : std::as_const(*command_).get_options()) {
    if (option->get_group() == kGroup && option->count() > 0) {
      flags[option->get_name()] = option->results().front();
    }
  }
  return flags;
}

void RecordingFlags::complete(const std::string& folder, const nlohmann::ordered_json& flags) {
  if (folder_.empty()) folder_ = folder;
  for (const auto& [name, value] : flags.items()) {
    CLI::Option* const option = command_->get_option(name);
    if (option->get_group() != kGroup) throw CLI::OptionNotFound(name);
    if (option->count() > 0 || !value.is_string()) continue;
    option->add_result(value.get<std::string>());
    option->run_callback();
  }
}

namespace {

double metres_of(const std::string& unit) {
  if (unit == "mm") return 0.001;
  return unit == "cm" ? 0.01 : 1.0;
}

/// Seconds of a unit of time; 0 for "auto".
double point_time_unit(const std::string& text) {
  constexpr std::pair<const char*, double> kUnits[] = {
      {"auto", 0.0}, {"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
  for (const auto& [name, seconds] : kUnits) {
    if (text == name) return seconds;
  }
  double seconds = 0.0;
  if (CLI::detail::lexical_cast(text, seconds) && seconds > 0.0 && std::isfinite(seconds)) {
    return seconds;
  }
  throw ConfigError("--point-time-unit " + text + ": expected s, ms, us, ns or seconds above 0");
}

}  // namespace

RecordingOptions RecordingFlags::options() const {
  RecordingOptions options;
  options.poses = poses_;
  options.times = times_;
  options.cloud_topic = cloud_topic_;
  options.pose_topic = pose_topic_;
  options.pose_frame = pose_frame_id_;
  options.deskew = deskew_;
  options.point_time_unit = point_time_unit(point_time_unit_);
  options.point_unit = metres_of(point_units_);
  options.bin_layout = parse_bin_layout(bin_columns_);
  options.accept_missing = accept_missing_;
  if (!self_box_.empty()) options.self_boxes = parse_self_boxes(self_box_);
  options.scene = scene_;
  options.frame = value_of_name<PointFrame>(frame_).value();
  PoseConvention& convention = options.convention;
  convention.invert = invert_;
  convention.left_handed = left_handed_;
  convention.shift = shift_;
  convention.unit = metres_of(units_);
  convention.scale = pose_scale_;
  convention.quaternion = value_of_name<QuaternionOrder>(quaternion_).value();
  convention.frame = value_of_name<PoseFrame>(pose_frame_).value();
  if (!extrinsic_.empty()) convention.T_body_sensor = read_extrinsic(extrinsic_);
  if (!std::isfinite(time_offset_)) throw ConfigError("--time-offset: expected a finite number");
  options.time_offset = time_offset_;
  options.pose_gap = pose_gap_;
  if (!sensor_origin_.empty() && !sensor_frame_.empty()) {
    throw ConfigError("--sensor-origin and --sensor-frame exclude each other");
  }
  if (!sensor_origin_.empty()) options.sensor_origin = read_sensor_origin(sensor_origin_);
  options.sensor_frame = sensor_frame_;
  return options;
}

RecordingOptions RecordingFlags::options_without_poses() const {
  for (const char* const flag :
       {"--poses", "--invert-poses", "--pose-units", "--pose-scale", "--quaternion-order",
        "--pose-frame", "--left-handed-poses", "--pose-shift", "--extrinsic", "--time-offset",
        "--pose-gap", "--pose-topic", "--pose-frame-id"}) {
    if (command_->get_option(flag)->count() == 0) continue;
    throw ConfigError(std::string(flag) + " tells of given poses, which the odometry does not use");
  }
  RecordingOptions result = options();
  result.without_poses = true;
  return result;
}

std::string RecordingFlags::as_given(const std::string& further) const {
  std::string text = quoted(folder_);
  for (const CLI::Option* option : command_->get_options()) {
    const std::string flag = option->get_name();
    const bool is_replaced = (' ' + further + ' ').find(' ' + flag + ' ') != std::string::npos;
    if (option->get_group() != kGroup || option->count() == 0 || is_replaced) continue;
    text += ' ' + flag;
    if (option->get_expected_max() == 0) continue;
    for (const std::string& value : option->results()) text += ' ' + quoted(value);
  }
  return further.empty() ? text : text + ' ' + further;
}

Recording RecordingFlags::open_of_run(const std::filesystem::path& report_file,
                                      const nlohmann::ordered_json& report,
                                      const std::string& command) {
  try {
    complete(required_json_field<std::string>(report_file, report, "/sequence"),
             report.value("sequence_flags", nlohmann::ordered_json::object()));
  } catch (const CLI::Error& error) {
    throw IoError(report_file.string() + ": /sequence_flags: " + error.what());
  }
  if (!std::filesystem::exists(folder_)) {
    throw IoError(folder_ + ": no such recording; name the place of the run's recording: " +
                  command + " SEQ");
  }
  return open();
}

namespace {

void print_warnings(const Recording& recording) {
  if (recording.early_end()) {
    std::cerr << "dynains: warning: " << *recording.early_end() << "; "
              << recording.scan_file_count() << " scans before it are read" << std::endl;
  }
  for (const std::string& warning : recording.warnings()) {
    std::cerr << "dynains: warning: " << warning << std::endl;
  }
}

}  // namespace

Recording RecordingFlags::open(const std::filesystem::path& folder) const {
  Recording recording(folder, options());
  if (recording.missing_pose_count() > 0) {
    std::cerr << "dynains: warning: " << recording.missing_pose_count() << " of "
              << recording.scan_file_count() << " scans have no pose and are left out; see: dynains"
              << " check " << as_given() << std::endl;
  }
  print_warnings(recording);
  return recording;
}

Recording RecordingFlags::open_without_poses(bool is_compensated) const {
  RecordingOptions options = options_without_poses();
  options.is_compensated = is_compensated;
  Recording recording(folder_, options);
  print_warnings(recording);
  return recording;
}

}  // namespace dynains::program
