#include "overview.hpp"

#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"

namespace dynains::run {
namespace {

/// Sizes and colours of the picture.
struct Style {
  int letter_rows = 7, letter_columns = 6, letter_scale = 2;  ///< pixels, a gap included
  int text_height = letter_rows * letter_scale;
  int inset = 4;                        ///< pixels around text and panels
  int strip = text_height + 2 * inset;  ///< pixels of a title, and of the scale below
  double margin = 50.0;                 ///< m around the path
  double longer_side = 1200.0;          ///< pixels of a panel
  double max_per_metre = 8.0;           ///< pixels
  double longest_bar = 200.0;           ///< pixels, of the scale
  Colour ink = {40, 40, 40};
  Colour grey = {150, 150, 150};  ///< static points in a legend
  Colour moving = {30, 80, 220};
  Colour removed = {30, 160, 60};
  Colour pale = {232, 232, 232};
};
constexpr Style kStyle;

/// Rows of a letter from the top, five bits each, the left column in the highest bit.
using Glyph = std::array<std::uint8_t, kStyle.letter_rows>;

constexpr std::string_view kCharacters = "abcdefgimnorstv0125:";
constexpr std::array<Glyph, kCharacters.size()> kGlyphs = {{
    {0x00, 0x00, 0x0E, 0x01, 0x0F, 0x11, 0x0F}, {0x10, 0x10, 0x16, 0x19, 0x11, 0x11, 0x1E},
    {0x00, 0x00, 0x0E, 0x10, 0x10, 0x11, 0x0E}, {0x01, 0x01, 0x0D, 0x13, 0x11, 0x11, 0x0F},
    {0x00, 0x00, 0x0E, 0x11, 0x1F, 0x10, 0x0E}, {0x06, 0x09, 0x08, 0x1C, 0x08, 0x08, 0x08},
    {0x00, 0x0F, 0x11, 0x11, 0x0F, 0x01, 0x0E}, {0x04, 0x00, 0x0C, 0x04, 0x04, 0x04, 0x0E},
    {0x00, 0x00, 0x1A, 0x15, 0x15, 0x11, 0x11}, {0x00, 0x00, 0x16, 0x19, 0x11, 0x11, 0x11},
    {0x00, 0x00, 0x0E, 0x11, 0x11, 0x11, 0x0E}, {0x00, 0x00, 0x16, 0x19, 0x10, 0x10, 0x10},
    {0x00, 0x00, 0x0E, 0x10, 0x0E, 0x01, 0x1E}, {0x08, 0x08, 0x1C, 0x08, 0x08, 0x09, 0x06},
    {0x00, 0x00, 0x11, 0x11, 0x11, 0x0A, 0x04}, {0x0E, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0E},
    {0x04, 0x0C, 0x04, 0x04, 0x04, 0x04, 0x0E}, {0x0E, 0x11, 0x01, 0x02, 0x04, 0x08, 0x1F},
    {0x1F, 0x10, 0x1E, 0x01, 0x01, 0x11, 0x0E}, {0x00, 0x04, 0x00, 0x00, 0x00, 0x04, 0x00},
}};

void draw_glyph(Picture& picture, int x, int y, const Glyph& glyph, Colour colour) {
  for (int row = 0; row < kStyle.letter_rows * kStyle.letter_scale; ++row) {
    for (int column = 0; column < kStyle.letter_columns * kStyle.letter_scale; ++column) {
      const int bits = glyph[static_cast<std::size_t>(row / kStyle.letter_scale)]
                       << 1;  // and a gap
      if ((bits >> (kStyle.letter_columns - 1 - column / kStyle.letter_scale) & 1) == 0) continue;
      const int to_x = x + column, to_y = y + row;
      if (to_x < 0 || to_y < 0 || to_x >= picture.width() || to_y >= picture.height()) continue;
      picture.set(to_x, to_y, colour);
    }
  }
}

/// Pixels.
int text_width(const std::string& text) {
  return static_cast<int>(text.size()) * kStyle.letter_columns * kStyle.letter_scale;
}

/// Draws characters that have glyphs; others are blanks. `x`, `y`: upper left corner, pixels. What
/// lies outside of the picture is left out.
void draw_text(Picture& picture, int x, int y, const std::string& text, Colour colour) {
  for (const char character : text) {
    const std::size_t index = kCharacters.find(character);
    if (index != std::string_view::npos) draw_glyph(picture, x, y, kGlyphs[index], colour);
    x += kStyle.letter_columns * kStyle.letter_scale;
  }
}

/// One of so many static points of a scan is drawn: later scans show the same places again.
std::size_t static_step(std::size_t scans) {
  return std::clamp(scans / 4, std::size_t{1}, std::size_t{32});
}

/// Grey that gets darker with the height above the ground below the sensor.
std::uint8_t shade(double height) {
  return static_cast<std::uint8_t>(std::clamp(205.0 - 18.0 * (height + 1.7), 70.0, 215.0));
}

void fill(Picture& picture, int x, int y, int width, int height, Colour colour) {
  for (int row = y; row < std::min(y + height, picture.height()); ++row) {
    for (int column = x; column < std::min(x + width, picture.width()); ++column) {
      picture.set(column, row, colour);
    }
  }
}

/// Colours and their meaning.
using Entries = std::vector<std::pair<Colour, std::string>>;

/// Title and legend of a panel, above it. `x`, `y`: its upper left corner, pixels.
void draw_title(Picture& picture, int x, int y, const std::string& title, const Entries& entries) {
  x += kStyle.inset;
  y += kStyle.inset;
  draw_text(picture, x, y, title, kStyle.ink);
  x += text_width(title + ' ');
  for (const auto& [colour, meaning] : entries) {
    fill(picture, x, y + 2, kStyle.text_height - 4, kStyle.text_height - 4, colour);
    x += kStyle.text_height;
    draw_text(picture, x, y, meaning, kStyle.ink);
    x += text_width(meaning + "  ");
  }
}

/// A bar of a round length at the lower border. `scale`: pixels per m.
void draw_scale(Picture& picture, double scale) {
  int metres = 1;
  for (const int next : {2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000}) {
    if (next * scale <= kStyle.longest_bar) metres = next;
  }
  const int length = std::max(1, static_cast<int>(std::lround(metres * scale)));
  const int y = picture.height() - kStyle.strip + kStyle.inset;
  fill(picture, kStyle.inset, y + (kStyle.text_height - kStyle.inset) / 2, length, kStyle.inset,
       kStyle.ink);
  draw_text(picture, 3 * kStyle.inset + length, y, std::to_string(metres) + " m", kStyle.ink);
}

}  // namespace

Picture::Picture(int width, int height)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
  set(0, 0, {255, 255, 255});  // the first colour, that of all pixels
}

void Picture::write_png(const std::filesystem::path& path) const {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width_);
  image.height = static_cast<png_uint_32>(height_);
  image.format = PNG_FORMAT_RGB_COLORMAP;
  image.colormap_entries = static_cast<png_uint_32>(palette_.size());
  image.flags = PNG_IMAGE_FLAG_FAST;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  const std::unique_ptr<char[]> encoded(new char[size]);  // most of which is never touched
  if (png_image_write_to_memory(&image, encoded.get(), &size, 0, pixels_.data(), 0,
                                palette_.data()) == 0) {
    throw IoError(path.string() + ": cannot be encoded as PNG: " + image.message);
  }
  AtomicFile file(path);
  file.stream().write(encoded.get(), static_cast<std::streamsize>(size));
  file.commit();
}

Overview::Overview(const Recording& recording, const ScanRange& range)
    : static_step_(static_step(range.size())) {
  Eigen::AlignedBox2d box;
  for (std::size_t i = range.first; i <= range.last; ++i) {
    box.extend(recording.T_world_sensor(i).translation().head<2>());
  }
  low_ = box.min().array() - kStyle.margin;
  const Eigen::Array2d size = box.max().array() + kStyle.margin - low_.array();
  scale_ = std::min(kStyle.max_per_metre, kStyle.longer_side / size.maxCoeff());
  const auto pixels = [&](double metres) {
    return std::max(1, static_cast<int>(std::ceil(metres * scale_)));
  };
  width_ = pixels(size.x());
  height_ = pixels(size.y());
  rows_.resize(static_cast<std::size_t>(height_));
}

void Overview::add(const JudgedScan& judged) {
  const RecordedScan& scan = judged.scan;
  const ScanVerdict& verdict = judged.verdict;
  const Pose& T_world_sensor = verdict.T_world_sensor;
  const double sensor_height = T_world_sensor.translation().z();
  for (std::size_t i = 0; i < verdict.labels.size(); i += static_step_) {
    if (!is_static(verdict.labels[i])) continue;
    const Eigen::Vector3d p = T_world_sensor * scan.point(i).position;
    if (Pixel* const pixel = pixel_at(p)) {
      pixel->grey = std::min(pixel->grey, shade(p.z() - sensor_height));
    }
  }
  for_each_moving(verdict.labels, [&](std::size_t i) {
    if (Pixel* pixel = pixel_at(T_world_sensor * scan.point(i).position)) pixel->has_moving = true;
  });
}

Overview::Pixel* Overview::pixel_at(const Eigen::Vector3d& p) {
  const double x = (p.x() - low_.x()) * scale_;
  const double y = height_ - (p.y() - low_.y()) * scale_;
  if (!(x >= 0 && x < width_ && y >= 0 && y < height_)) return nullptr;
  std::vector<Pixel>& row = rows_[static_cast<std::size_t>(y)];
  if (row.empty()) row.resize(static_cast<std::size_t>(width_));
  return &row[static_cast<std::size_t>(x)];
}

Picture Overview::picture() const {
  const bool is_beside = height_ > width_;
  const int step_x = is_beside ? width_ + 2 * kStyle.inset : 0;
  const int step_y = is_beside ? 0 : kStyle.strip + height_ + 2 * kStyle.inset;
  Picture picture(width_ + 2 * step_x, kStyle.strip + height_ + 2 * step_y + kStyle.strip);
  const auto draw = [&](int panel, int x, int y, Colour colour) {
    picture.set(x + panel * step_x, y + kStyle.strip + panel * step_y, colour);
  };
  for (int y = 0; y < height_; ++y) {
    const std::vector<Pixel>& row = rows_[static_cast<std::size_t>(y)];
    for (int x = 0; x < static_cast<int>(row.size()); ++x) {
      const Pixel& pixel = row[static_cast<std::size_t>(x)];
      const Colour grey = {pixel.grey, pixel.grey, pixel.grey};
      if (pixel.has_moving) {
        draw(0, x, y, kStyle.moving);
        draw(2, x, y, kStyle.removed);
      } else if (pixel.has_static()) {
        draw(0, x, y, grey);
        draw(2, x, y, kStyle.pale);
      }
      if (pixel.has_static()) draw(1, x, y, grey);
    }
  }
  const Entries before = {{kStyle.grey, "static"}, {kStyle.moving, "moving"}};
  draw_title(picture, 0, 0, "before:", before);
  draw_title(picture, step_x, step_y, "after:", {{kStyle.grey, "static"}});
  draw_title(picture, 2 * step_x, 2 * step_y, "removed:", {{kStyle.removed, "moving"}});
  draw_scale(picture, scale_);
  return picture;
}

}  // namespace dynains::run
