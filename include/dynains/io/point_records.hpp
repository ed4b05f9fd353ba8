// Points as the records of a binary point file.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "dynains/points.hpp"

namespace dynains {

/// One point to write. Members without a column in the file are ignored. Units are those of the
/// caller.
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

  void add(const FilePoint& point);
  void clear() { bytes_.clear(); }
  /// Number of points.
  std::size_t size() const { return bytes_.size() / record_size_; }
  Span<const char> bytes() const { return {bytes_.data(), bytes_.size()}; }
  /// Takes the bytes of other records with these columns. False, and nothing changes, if they are
  /// no whole number of points.
  bool assign(Span<const char> bytes);

  /// Replaces each label by `new_label(label)`. To be called with a column `label` only.
  template <class NewLabel>
  void replace_labels(NewLabel&& new_label) {
    for (std::size_t at = label_; at < bytes_.size(); at += record_size_) {
      std::uint32_t label = 0;
      std::memcpy(&label, bytes_.data() + at, sizeof(label));
      label = new_label(label);
      std::memcpy(bytes_.data() + at, &label, sizeof(label));
    }
  }

 private:
  PointColumns columns_;
  bool is_pcd_;
  std::size_t label_;        // bytes before the label of a record
  std::size_t record_size_;  // bytes
  std::vector<char> bytes_;
};

}  // namespace dynains
