#include "dynains/io/extrinsic.hpp"

#include <cmath>
#include <optional>
#include <sstream>

#include "../text.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/trajectory.hpp"
#include "kitti_files.hpp"

namespace dynains {
namespace {

constexpr const char* kExpectedExtrinsic = "expected \"x y z qx qy qz qw\" or a file with one pose";

}  // namespace

Pose read_extrinsic(const std::string& text) {
  const auto numbers = text::numbers_in(text, ",");
  if (!numbers || numbers->size() != 7) {
    const bool is_number = text::parse_number(text.substr(0, text.find_first_of(" ,"))).has_value();
    if (is_number) throw ConfigError("extrinsic \"" + text + "\": " + kExpectedExtrinsic);
    const Trajectory file = read_trajectory(text);
    if (file.poses.size() == 1) return file.poses.front();
    throw IoError(text + ": has " + std::to_string(file.poses.size()) + " poses; " +
                  kExpectedExtrinsic);
  }
  const std::vector<double>& n = *numbers;
  const auto pose = rigid_pose({n[0], n[1], n[2]}, {n[6], n[3], n[4], n[5]});
  if (!pose) {
    throw ConfigError("extrinsic \"" + text +
                      "\": expected finite numbers and a quaternion of length 1");
  }
  return *pose;
}

Eigen::Vector3d read_sensor_origin(const std::string& text) {
  const auto position = text::numbers_in(text, ",");
  if (!position || position->size() != 3) return read_extrinsic(text).translation();
  return Eigen::Vector3d(position->data());
}

std::vector<Pose> read_sensor_poses(const std::string& file) { return read_trajectory(file).poses; }

std::string extrinsic_text(const Pose& T_body_sensor) {
  const Eigen::Vector3d t = T_body_sensor.translation();
  detail::Quaternion q(T_body_sensor.linear());
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << std::fixed;
  text.precision(6);
  const char* separator = "";
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    text << separator << (std::abs(value) < 5e-7 ? 0.0 : value);
    separator = " ";
  }
  return text.str();
}

}  // namespace dynains
