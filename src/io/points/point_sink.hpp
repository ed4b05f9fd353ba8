// The readers of point files, one for each format, what they store values in, the parts of LAS, and
// copies of point files without some of their points.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>

#include "../scalar.hpp"
#include "../text.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/points.hpp"

namespace dynains {

class ByteReader;

/// Meaning of a column.
enum class Role : std::uint8_t { kX, kY, kZ, kIntensity, kRing, kTime, kLabel, kSensor, kNone };

/// Meaning of the first columns without names.
inline constexpr Role kUsualRoles[] = {Role::kX, Role::kY, Role::kZ, Role::kIntensity};

/// Names of columns in files and messages.
struct RoleNames {
  Role role;
  std::string_view names;
};
inline constexpr RoleNames kRoleNames[] = {
    {Role::kX, "x points_m_xyz:0"},  // the latter in tables of VeloView
    {Role::kY, "y points_m_xyz:1"},
    {Role::kZ, "z points_m_xyz:2"},
    {Role::kIntensity, "intensity i reflectivity scalar_intensity"},
    {Role::kRing, "ring channel line scalar_ring"},
    {Role::kTime, "time t timestamp time_stamp offset_time scalar_time"},
    {Role::kLabel, "label class scalar_label"},
    {Role::kSensor, "sensor lidar_id lidar_index d laser_number"}};

/// Meaning of a column with this name; case is ignored.
inline Role role_of(std::string_view name) {
  const std::string lower = text::lower_case(std::string(name));
  for (auto [role, names] : kRoleNames) {
    while (!names.empty()) {
      if (text::next_token(names) == lower) return role;
    }
  }
  return Role::kNone;
}

/// The columns in addition to x y z for whose roles `has(role)` holds.
template <class Has>
PointColumns columns_of(Has&& has) {
  PointColumns columns;
  columns.intensity = has(Role::kIntensity);
  columns.ring = has(Role::kRing);
  columns.time = has(Role::kTime);
  columns.label = has(Role::kLabel);
  return columns;
}

/// Number of a beam; 0 for a value that is none.
inline std::uint16_t ring_number(double value) {
  return value >= 0.0 && value <= 65535.0 ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
}
/// Number of a sensor; 255 for a value that is none.
inline std::uint8_t sensor_number(double value) {
  std::uint8_t number = 0;
  return store_number(value, number) ? number : std::uint8_t{255};
}

/// Collects points, value by value.
class PointSink {
 public:
  /// Announces a column. False if another column has its role already: ignore it then.
  bool claim(Role role) { return !std::exchange(claimed_[static_cast<std::size_t>(role)], true); }
  /// Name of a coordinate without a column.
  std::optional<std::string> missing() const {
    for (const Role role : {Role::kX, Role::kY, Role::kZ}) {
      if (!has(role)) return std::string(1, "xyz"[static_cast<std::size_t>(role)]);
    }
    return std::nullopt;
  }

  /// The announced columns in addition to x y z.
  PointColumns columns() const {
    return columns_of([this](Role role) { return has(role); });
  }

  /// Sets the number of points. The caller has compared it with the size of the file.
  void resize(std::size_t count) {
    file_.positions.resize(count, Eigen::Vector3d::Zero());
    if (has(Role::kIntensity)) file_.intensity.resize(count);
    if (has(Role::kRing)) file_.ring.resize(count);
    if (has(Role::kTime)) file_.time.resize(count);
    if (has(Role::kLabel)) file_.label.resize(count);
    if (has(Role::kSensor)) file_.sensor.resize(count);
  }

  /// Stores one value of point i; false if the column cannot hold it (for example label -1).
  bool set(std::size_t i, Role role, double value) {
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
        break;
    }
    return true;
  }

  PointFile& file() { return file_; }

 private:
  bool has(Role role) const { return claimed_[static_cast<std::size_t>(role)]; }

  std::array<bool, static_cast<std::size_t>(Role::kNone)> claimed_{};
  PointFile file_;
};

/// Lines, fields or columns that a header may have.
inline constexpr std::size_t kMaxHeaderItems = 1000;

/// Read the columns, and the points as well if `with_points`. Return the number of points. Throw
/// IoError unless the file can hold those of its header.
std::uint64_t read_ply(const std::filesystem::path& path, PointSink& sink, bool with_points);
std::uint64_t read_pcd(const std::filesystem::path& path, PointSink& sink, bool with_points);
std::uint64_t read_las(const std::filesystem::path& path, PointSink& sink, bool with_points);
std::uint64_t read_npy(const std::filesystem::path& path, PointSink& sink, bool with_points);
std::uint64_t read_xyz(const std::filesystem::path& path, PointSink& sink, bool with_points);

/// Coordinates of a written LAS file, mm from its offset.
using LasSteps = std::array<std::int32_t, 3>;
/// The header of a LAS file of `count` points between `least` and `most`. Throws IoError.
std::string las_header(const std::filesystem::path& path, const LasOptions& options,
                       std::size_t count, const LasSteps& least, const LasSteps& most);
/// The bytes of a point, which widens the limits. Throws IoError.
std::string las_record(const std::filesystem::path& path, const LasOptions& options,
                       const FilePoint& point, LasSteps& least, LasSteps& most);

/// Writes the PLY, PCD or raw file (.bin) `path` to `target` without some of its points. All
/// columns and comments stay as they are; compressed points of PCD become binary ones. `keep`: for
/// each point of read_points(), 0 if it is left out. Throws IoError, also for a PLY file that has
/// more than points, such as faces.
void copy_points(const std::filesystem::path& path, Span<const std::uint8_t> keep,
                 std::ostream& target);

/// Writes the first `size` bytes of `path`, lines of text, with `edit` applied to each of them.
void copy_lines(const std::filesystem::path& path, std::uint64_t size, std::ostream& target,
                const std::function<std::string(const std::string&)>& edit);

/// Copies the records that `keep` names from where `reader` is: lines if `size` is 0, else `size`
/// bytes each. `record`: the name of one in errors, for example "a point".
void copy_records(ByteReader& reader, std::size_t size, const char* record,
                  Span<const std::uint8_t> keep, std::ostream& target);
/// Number of records that `keep` names.
std::size_t kept_count(Span<const std::uint8_t> keep);

void copy_ply(const std::filesystem::path& path, Span<const std::uint8_t> keep,
              std::ostream& target);
void copy_pcd(const std::filesystem::path& path, Span<const std::uint8_t> keep,
              std::ostream& target);

}  // namespace dynains
