#include "dynains/io/extrinsic.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <sstream>
#include <string_view>

#include "dynains/errors.hpp"
#include "dynains/io/trajectory.hpp"
#include "text.hpp"

namespace dynains {
namespace {

constexpr const char* kExpected = "expected \"x y z qx qy qz qw\" or a file with one pose";

/// The numbers that `text` consists of; empty if it has other words, or not seven of them.
std::optional<std::array<double, 7>> seven_numbers(std::string text) {
  for (char& c : text) c = c == ',' ? ' ' : c;
  std::array<double, 7> numbers{};
  std::size_t count = 0;
  std::string_view rest = text;
  for (auto token = text::next_token(rest); !token.empty(); token = text::next_token(rest)) {
    const auto number = text::parse_number(token);
    if (!number || count == numbers.size()) return std::nullopt;
    numbers[count++] = *number;
  }
  return count == numbers.size() ? std::optional(numbers) : std::nullopt;
}

}  // namespace

Eigen::Isometry3d read_extrinsic(const std::string& text) {
  const auto numbers = seven_numbers(text);
  if (!numbers) {
    const bool is_number = text::parse_number(text.substr(0, text.find_first_of(" ,"))).has_value();
    if (is_number) throw ConfigError("extrinsic \"" + text + "\": " + kExpected);
    const Trajectory file = read_trajectory(text);
    if (file.poses.size() == 1) return file.poses.front();
    throw IoError(text + ": has " + std::to_string(file.poses.size()) + " poses; " + kExpected);
  }
  const auto& n = *numbers;
  const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
  const Eigen::Vector3d t(n[0], n[1], n[2]);
  if (!t.allFinite() || !(std::abs(q.norm() - 1.0) < 0.01)) {
    throw ConfigError("extrinsic \"" + text +
                      "\": expected finite numbers and a quaternion of length 1");
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = q.normalized().toRotationMatrix();
  pose.translation() = t;
  return pose;
}

std::string extrinsic_text(const Eigen::Isometry3d& T_body_sensor) {
  const Eigen::Vector3d t = T_body_sensor.translation();
  Eigen::Quaterniond q(T_body_sensor.linear());
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
