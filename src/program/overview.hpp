// A picture of a run from above: all points, the static points, and the removed points.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/verdict.hpp"
#include "picture.hpp"

namespace dynains::program {

class Overview {
 public:
  /// `path`: positions of the sensor in the world, m; the picture shows 50 m around them.
  explicit Overview(const std::vector<Eigen::Vector3d>& path);

  /// Adds all removed and every fourth static point of a scan.
  void add(const RecordedScan& scan, const ScanVerdict& verdict);

  /// Three panels of one size, side by side or below each other: before (static points grey, moving
  /// ones blue), after (static points), removed (moving points green, the others pale).
  const Picture& picture() const { return picture_; }

 private:
  struct Layout {
    Eigen::Vector2d low;   ///< m, world, of the left and lower border
    double scale;          ///< pixels per m
    int width;             ///< pixels of a panel
    int height;            ///< pixels of a panel
    Eigen::Vector2d step;  ///< pixels from one panel to the next
  };

  static Layout layout_of(const std::vector<Eigen::Vector3d>& path);
  explicit Overview(const Layout& layout);
  void splat(int panel, const Eigen::Vector2d& pixel, double depth, Colour colour);

  Layout layout_;
  Picture picture_;
};

}  // namespace dynains::program
