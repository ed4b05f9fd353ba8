// A small colour picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace dynains::program {

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

  /// `x`, `y`: pixels from the upper left corner, within the picture.
  void set(int x, int y, Colour colour) {
    std::uint8_t* const bytes = bytes_.data() + index(x, y);
    bytes[0] = colour.r, bytes[1] = colour.g, bytes[2] = colour.b;
  }

  Colour at(int x, int y) const {
    const std::uint8_t* const bytes = bytes_.data() + index(x, y);
    return {bytes[0], bytes[1], bytes[2]};
  }

  /// Writes a PNG file, whole or not at all. Throws IoError.
  void write_png(const std::filesystem::path& path) const;

 private:
  std::size_t index(int x, int y) const {
    return 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                static_cast<std::size_t>(x));
  }

  int width_;
  int height_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace dynains::program
