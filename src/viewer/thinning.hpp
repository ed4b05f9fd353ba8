// Choice of points such that a page stays small.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include "view_data.hpp"

namespace dynains::viewer {

/// Keeps one point per cell and scan, the first one. Cells grow until at most `budget` points are
/// left; when they are 0.6 m wide, neighbouring scans share cells as well. Same input, same points.
class ThinnedPoints {
 public:
  enum class Time { kSeparateScans, kAllScans };

  /// `cell`: edge of the first cells, m.
  ThinnedPoints(std::size_t budget, double cell, Time time);

  void add(const ViewPoint& point);

  /// At most `most` points, which is at most `budget`. Call it after the last point.
  std::vector<ViewPoint> take(std::size_t most);

 private:
  bool is_first(const ViewPoint& point);
  void thin();

  std::size_t budget_;
  double cell_;
  Time time_;
  unsigned scans_per_cell_ = 1;
  std::vector<ViewPoint> points_;
  std::unordered_set<std::uint64_t> occupied_;
};

}  // namespace dynains::viewer
