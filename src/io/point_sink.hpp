// Sorts the columns of a file into the members of PointFile.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "dynains/io/point_file.hpp"

namespace dynains {

/// Meaning of a column.
enum class Role : std::uint8_t { kX, kY, kZ, kIntensity, kRing, kTime, kLabel, kNone };

/// Meaning of a column with this name, whatever the case.
Role role_of(std::string_view name);

/// Collects points, value by value.
class PointSink {
 public:
  /// Announces a column; false if its role is taken already. The column is then to be ignored.
  bool claim(Role role);
  /// Name of a coordinate that no column was claimed for.
  std::optional<std::string> missing() const;

  /// The columns announced beside x y z.
  PointColumns columns() const;

  /// Makes room; `count` must be backed by the size of the file.
  void resize(std::size_t count);

  /// Stores one value of point i; false if the column cannot hold it (for example label -1).
  bool set(std::size_t i, Role role, double value);

  PointFile& file() { return file_; }

 private:
  std::array<bool, static_cast<std::size_t>(Role::kNone)> claimed_{};
  PointFile file_;
};

}  // namespace dynains
