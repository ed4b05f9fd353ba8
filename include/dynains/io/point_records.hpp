// Points as the records of a binary point file.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"

namespace dynains {

/// One point to write. Members without a column in the file are ignored; values are written as they
/// are.
struct FilePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  float intensity = 0.0F;
  std::array<std::uint8_t, 3> rgb{};
  std::uint32_t label = 0;
  std::uint16_t ring = 0;
  double time = 0.0;
  std::uint16_t session = 0;
};

/// Columns in addition to x y z.
struct PointColumns {
  bool double_xyz = false;  ///< x y z as double; some PCD readers support floats only
  bool intensity = false;   ///< float `intensity`
  bool rgb = false;         ///< PLY: uchar `red` `green` `blue`; PCD: packed `rgb`
  bool label = false;       ///< uint32 `label`
  bool ring = false;        ///< uint16 `ring`
  bool time = false;        ///< double `time`
  bool session = false;     ///< uint16 `session`, of a map of many sessions
};

/// Points in memory, packed as PLY (or PCD) stores them.
class PointRecords {
 public:
  explicit PointRecords(const PointColumns& columns, bool is_pcd = false);

  /// Appends one point.
  void add(const FilePoint& point);
  void clear() { bytes_.clear(); }
  Span<const char> bytes() const { return {bytes_.data(), bytes_.size()}; }

 private:
  PointColumns columns_;
  bool is_pcd_;
  std::size_t record_size_;  // bytes
  std::vector<char> bytes_;
};

}  // namespace dynains
