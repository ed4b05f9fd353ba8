#include "dynains/io/extrinsic.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>

#include "dynains/errors.hpp"
#include "dynains/io/trajectory.hpp"
#include "frame_file.hpp"
#include "text.hpp"

namespace dynains {
namespace {

constexpr const char* kExpected = "expected \"x y z qx qy qz qw\" or a file with one pose";

/// The numbers that `text` consists of; empty if it has other words, or not `kCount` of them.
template <std::size_t kCount>
std::optional<std::array<double, kCount>> numbers_of(const std::string& text) {
  const auto all = text::numbers_in(text, ",");
  if (!all || all->size() != kCount) return std::nullopt;
  std::array<double, kCount> numbers{};
  std::copy(all->begin(), all->end(), numbers.begin());
  return numbers;
}

/// `FILE:BODY:LIDAR`.
struct NamedFrames {
  std::string file;
  std::string body;
  std::string lidar;
};

/// Empty if the text names no file of frames. Without frames, both are empty.
std::optional<NamedFrames> named_frames(const std::string& text) {
  if (is_frame_file(text)) return NamedFrames{text, "", ""};
  const std::size_t last = text.rfind(':');
  if (last == std::string::npos || last == 0) return std::nullopt;
  const std::size_t before = text.rfind(':', last - 1);
  if (before == std::string::npos || !is_frame_file(text.substr(0, before))) return std::nullopt;
  return NamedFrames{text.substr(0, before), text.substr(before + 1, last - before - 1),
                     text.substr(last + 1)};
}

/// T_body_lidar of a file with named frames.
Pose transform_of(const NamedFrames& named) {
  const TransformTree tree = read_frame_file(named.file);
  std::set<std::string> known;
  for (const std::string& frame : tree.frames()) {
    known.insert(frame);
    if (const auto root = tree.root_of(frame)) known.insert(*root);
  }
  const bool has_both = known.count(named.body) > 0 && known.count(named.lidar) > 0;
  const auto found = has_both ? tree.find(named.body, named.lidar, 0.0) : std::nullopt;
  if (found) return *found;
  throw ConfigError("extrinsic: expected " + named.file +
                    ":BODY:LIDAR with two frames that the file connects; it has " +
                    text::listed({known.begin(), known.end()}));
}

}  // namespace

Pose read_extrinsic(const std::string& text) {
  if (const auto named = named_frames(text)) return transform_of(*named);
  const auto numbers = numbers_of<7>(text);
  if (!numbers) {
    const bool is_number = text::parse_number(text.substr(0, text.find_first_of(" ,"))).has_value();
    if (is_number) throw ConfigError("extrinsic \"" + text + "\": " + kExpected);
    const Trajectory file = read_trajectory(text);
    if (file.poses.size() == 1) return file.poses.front();
    throw IoError(text + ": has " + std::to_string(file.poses.size()) + " poses; " + kExpected);
  }
  const auto& n = *numbers;
  const detail::Quaternion q(n[6], n[3], n[4], n[5]);
  const Eigen::Vector3d t(n[0], n[1], n[2]);
  if (!t.allFinite() || !(std::abs(q.norm() - 1.0) < 0.01)) {
    throw ConfigError("extrinsic \"" + text +
                      "\": expected finite numbers and a quaternion of length 1");
  }
  Pose pose = Pose::Identity();
  pose.linear() = q.normalized().toRotationMatrix();
  pose.translation() = t;
  return pose;
}

Eigen::Vector3d read_sensor_origin(const std::string& text) {
  const auto position = numbers_of<3>(text);
  if (!position) return read_extrinsic(text).translation();
  return {(*position)[0], (*position)[1], (*position)[2]};
}

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
