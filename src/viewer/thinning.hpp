// Choice of points such that a page stays small.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include "page.hpp"

namespace dynains::viewer {

/// Keeps one point per cell and scan, the first one. Cells grow until at most `budget` points are
/// left; when they are 0.6 m wide, more and more scans share them first. Same input, same points.
class ThinnedPoints {
 public:
  /// `cell`: edge of the first cells, m. `scans`: so many in a row share the first cells.
  ThinnedPoints(std::size_t budget, double cell, std::size_t scans);

  void add(const ViewPoint& point);

  /// At most `most` points, which is at most `budget`. Call it after the last point.
  std::vector<ViewPoint> take(std::size_t most);

 private:
  bool is_first(const ViewPoint& point);
  void thin();

  std::size_t budget_;
  double cell_;
  std::size_t scans_per_cell_;
  std::vector<ViewPoint> points_;
  std::unordered_set<std::uint64_t> occupied_;
};

}  // namespace dynains::viewer
