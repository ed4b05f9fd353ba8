// A picture of a run from above: all points, the static points, and the removed points.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "picture.hpp"
#include "verdict_files.hpp"

namespace dynains::run {

class Overview {
 public:
  /// `path`: positions of the sensor in the world, m; the picture shows 50 m around them.
  explicit Overview(const std::vector<Eigen::Vector3d>& path);

  /// Adds all removed points of a scan, and some of its static points.
  void add(const JudgedScan& judged);

  /// Three panels of one size, side by side or below each other: before (static points grey, moving
  /// ones blue), after (static points), removed (moving points green, the others
  /// pale); each with title and legend, below them a scale bar.
  Picture picture() const;

 private:
  struct Pixel {
    float height = -std::numeric_limits<float>::infinity();  // m, of the highest static point
    std::uint8_t grey = 0;                                   // of the highest static point
    bool has_moving = false;

    void add_static(float height_of_point, std::uint8_t grey_of_point) {
      if (!(height_of_point > height)) return;
      height = height_of_point;
      grey = grey_of_point;
    }
    bool has_static() const { return height > -std::numeric_limits<float>::infinity(); }
  };

  /// The pixel of a point (m, world); null outside of the picture.
  Pixel* pixel_at(const Eigen::Vector3d& p);

  std::size_t static_step_;
  Eigen::Vector2d low_;                   // m, world, left and lower border
  double scale_;                          // pixels per m
  int width_;                             // pixels of a panel
  int height_;                            // pixels of a panel
  std::vector<std::vector<Pixel>> rows_;  // of a panel; empty before the first point of a row
};

}  // namespace dynains::run
