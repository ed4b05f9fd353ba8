// The readers of point files, one for each format, what they store values in, and the parts of LAS.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "dynains/io/point_file.hpp"

namespace dynains {

/// Meaning of a column.
enum class Role : std::uint8_t { kX, kY, kZ, kIntensity, kRing, kTime, kLabel, kSensor, kNone };

/// Meaning of the first columns without names.
inline constexpr Role kUsualRoles[] = {Role::kX, Role::kY, Role::kZ, Role::kIntensity};

/// Meaning of a column with this name; case is ignored.
Role role_of(std::string_view name);

/// Number of a beam; 0 for a value that is none.
std::uint16_t ring_number(double value);
/// Number of a sensor; 255 for a value that is none.
std::uint8_t sensor_number(double value);

/// Collects points, value by value.
class PointSink {
 public:
  /// Announces a column. False if another column has its role already: ignore it then.
  bool claim(Role role);
  /// Name of a coordinate without a column.
  std::optional<std::string> missing() const;

  /// The announced columns in addition to x y z.
  PointColumns columns() const;

  /// Sets the number of points. The caller has compared it with the size of the file.
  void resize(std::size_t count);

  /// Stores one value of point i; false if the column cannot hold it (for example label -1).
  bool set(std::size_t i, Role role, double value);

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

}  // namespace dynains
