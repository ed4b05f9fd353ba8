// Search of map points by position.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "view_data.hpp"

namespace dynains::viewer {

/// Finds the map point that is a given measured point: map points are measured points, rounded.
class MapIndex {
 public:
  static constexpr float kRounding = 0.003F;  ///< m, on each axis

  /// `points` outlives this, and its positions stay.
  explicit MapIndex(const std::vector<ViewPoint>& points);

  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  /// Index of a point at this position; kNone if there is none.
  std::uint32_t find(const Eigen::Vector3f& local) const;

 private:
  const std::vector<ViewPoint>& points_;
  std::vector<std::uint32_t> first_;  // by hash of the cell: entry, or kNone
  struct Entry {
    std::uint32_t point;
    std::uint32_t next;
  };
  std::vector<Entry> entries_;
};

}  // namespace dynains::viewer
