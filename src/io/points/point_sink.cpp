#include "point_sink.hpp"

#include <utility>

#include "../scalar.hpp"
#include "../text.hpp"

namespace dynains {
namespace {

struct Alias {
  std::string_view name;
  Role role;
};

constexpr Alias kAliases[] = {
    {"x", Role::kX},
    {"y", Role::kY},
    {"z", Role::kZ},
    {"points_m_xyz:0", Role::kX},  // tables of VeloView
    {"points_m_xyz:1", Role::kY},
    {"points_m_xyz:2", Role::kZ},
    {"intensity", Role::kIntensity},
    {"i", Role::kIntensity},
    {"reflectivity", Role::kIntensity},
    {"scalar_intensity", Role::kIntensity},
    {"ring", Role::kRing},
    {"channel", Role::kRing},
    {"line", Role::kRing},
    {"scalar_ring", Role::kRing},
    {"time", Role::kTime},
    {"t", Role::kTime},
    {"timestamp", Role::kTime},
    {"time_stamp", Role::kTime},
    {"offset_time", Role::kTime},
    {"scalar_time", Role::kTime},
    {"label", Role::kLabel},
    {"class", Role::kLabel},
    {"scalar_label", Role::kLabel},
    {"sensor", Role::kSensor},
    {"lidar_id", Role::kSensor},
    {"lidar_index", Role::kSensor},
    {"d", Role::kSensor},
    {"laser_number", Role::kSensor},
};

}  // namespace

Role role_of(std::string_view name) {
  const std::string lower = text::lower_case(std::string(name));
  for (const Alias& alias : kAliases) {
    if (alias.name == lower) return alias.role;
  }
  return Role::kNone;
}

std::uint16_t ring_number(double value) {
  return value >= 0.0 && value <= 65535.0 ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
}

std::uint8_t sensor_number(double value) {
  std::uint8_t number = 0;
  return store_number(value, number) ? number : std::uint8_t{255};
}

bool PointSink::claim(Role role) {
  return !std::exchange(claimed_[static_cast<std::size_t>(role)], true);
}

std::optional<std::string> PointSink::missing() const {
  for (const Role role : {Role::kX, Role::kY, Role::kZ}) {
    if (!has(role)) return std::string(1, "xyz"[static_cast<std::size_t>(role)]);
  }
  return std::nullopt;
}

PointColumns PointSink::columns() const {
  PointColumns columns;
  columns.intensity = has(Role::kIntensity);
  columns.ring = has(Role::kRing);
  columns.time = has(Role::kTime);
  columns.label = has(Role::kLabel);
  return columns;
}

void PointSink::resize(std::size_t count) {
  file_.positions.resize(count, Eigen::Vector3d::Zero());
  if (has(Role::kIntensity)) file_.intensity.resize(count);
  if (has(Role::kRing)) file_.ring.resize(count);
  if (has(Role::kTime)) file_.time.resize(count);
  if (has(Role::kLabel)) file_.label.resize(count);
  if (has(Role::kSensor)) file_.sensor.resize(count);
}

bool PointSink::set(std::size_t i, Role role, double value) {
  switch (role) {
    case Role::kX:
    case Role::kY:
    case Role::kZ:
      file_.positions[i][static_cast<Eigen::Index>(role)] = value;
      return true;
    case Role::kIntensity:
      file_.intensity[i] = to_float(value);
      return true;
    case Role::kRing:
      return store_number(value, file_.ring[i]);
    case Role::kTime:
      file_.time[i] = value;
      return true;
    case Role::kLabel:
      return store_number(value, file_.label[i]);
    case Role::kSensor:
      file_.sensor[i] = sensor_number(value);
      return true;
    case Role::kNone:
      return true;
  }
  return true;
}

}  // namespace dynains
