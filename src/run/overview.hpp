// A picture of a run from above: all points, the static points, and the removed points.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "dynains/voxels/voxel_hash_table.hpp"
#include "scan_range.hpp"
#include "verdict_files.hpp"

namespace dynains::run {

struct Colour {
  std::uint8_t r = 0, g = 0, b = 0;

  friend bool operator==(Colour one, Colour other) {
    return one.r == other.r && one.g == other.g && one.b == other.b;
  }
};

/// A picture of few colours.
class Picture {
 public:
  /// White. `width`, `height`: pixels, at least 1.
  Picture(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }

  /// `x`, `y`: pixels from the upper left corner, within the picture. At most 256 colours.
  void set(int x, int y, Colour colour) {
    const auto number = numbers_.insert(voxel_key(colour.r, colour.g, colour.b));
    if (number == palette_.size()) palette_.push_back(colour);
    pixels_[index(x, y)] = static_cast<std::uint8_t>(number);
  }

  Colour at(int x, int y) const { return palette_[pixels_[index(x, y)]]; }

  /// Writes a PNG file, whole or not at all. Throws IoError.
  void write_png(const std::filesystem::path& path) const;

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  int width_;
  int height_;
  VoxelHashTable<> numbers_;  // of colours
  std::vector<Colour> palette_;
  std::vector<std::uint8_t> pixels_;  // numbers
};

class Overview {
 public:
  /// Shows 50 m around the positions of the sensor.
  Overview(const Recording& recording, const ScanRange& range);

  /// Adds all removed points of a scan, and some of its static points.
  void add(const JudgedScan& judged);

  /// Three panels of one size, side by side or below each other: before (static points grey, moving
  /// ones blue), after (static points), removed (moving points green, the others
  /// pale); each with title and legend, below them a scale bar.
  Picture picture() const;

 private:
  struct Pixel {
    std::uint8_t grey = 255;  // of the darkest static point; 255: none
    bool has_moving = false;

    bool has_static() const { return grey < 255; }
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
