// A picture of few colours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::run {

struct Colour {
  std::uint8_t r = 0, g = 0, b = 0;

  friend bool operator==(Colour one, Colour other) {
    return one.r == other.r && one.g == other.g && one.b == other.b;
  }
};

class Picture {
 public:
  /// White; throws ConfigError unless both sides are in [1, 16384] pixels.
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

}  // namespace dynains::run
