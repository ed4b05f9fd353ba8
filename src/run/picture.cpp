#include "picture.hpp"

#include <png.h>

#include <csetjmp>
#include <string>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"

namespace dynains::program {
namespace {

constexpr int kMaxSide = 16384;

int checked_side(int side) {
  if (side >= 1 && side <= kMaxSide) return side;
  throw ConfigError("picture side = " + std::to_string(side) + " must be in [1, 16384] pixels");
}

/// The bytes of a PNG file and, if it cannot be encoded, the reason.
struct Encoded {
  std::vector<char> bytes;
  std::string failure;
};

void append(png_structp writer, png_bytep data, std::size_t size) {
  auto& bytes = static_cast<Encoded*>(png_get_io_ptr(writer))->bytes;
  bytes.insert(bytes.end(), data, data + size);
}

[[noreturn]] void fail(png_structp writer, png_const_charp message) {
  static_cast<Encoded*>(png_get_error_ptr(writer))->failure = message;
  png_longjmp(writer, 1);
}

void ignore(png_structp, png_const_charp) {}

/// `encoded` has room for the whole file, so that no exception passes through libpng.
void encode(const Picture& picture, Encoded& encoded) {
  png_structp writer = png_create_write_struct(PNG_LIBPNG_VER_STRING, &encoded, fail, ignore);
  png_infop info = writer == nullptr ? nullptr : png_create_info_struct(writer);
  if (info == nullptr) {
    encoded.failure = "out of memory";
  } else if (setjmp(png_jmpbuf(writer)) == 0) {
    png_set_write_fn(writer, &encoded, append, nullptr);
    png_set_IHDR(writer, info, static_cast<png_uint_32>(picture.width()),
                 static_cast<png_uint_32>(picture.height()), 8, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    // A quarter to a half of the time of level 3, for files that are a tenth longer.
    png_set_compression_level(writer, 1);
    png_set_filter(writer, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);
    png_write_info(writer, info);
    for (int y = 0; y < picture.height(); ++y) {
      png_write_row(writer, picture.row(y));
    }
    png_write_end(writer, info);
  }
  png_destroy_write_struct(&writer, &info);
}

}  // namespace

Picture::Picture(int width, int height)
    : width_(checked_side(width)),
      height_(checked_side(height)),
      bytes_(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 255) {}

void Picture::write_png(const std::filesystem::path& path) const {
  png_image size{};
  size.width = static_cast<png_uint_32>(width_);
  size.height = static_cast<png_uint_32>(height_);
  size.format = PNG_FORMAT_RGB;
  Encoded encoded;
  encoded.bytes.reserve(PNG_IMAGE_PNG_SIZE_MAX(size));
  encode(*this, encoded);
  if (!encoded.failure.empty()) {
    throw IoError(path.string() + ": cannot be encoded as PNG: " + encoded.failure);
  }
  AtomicFile file(path);
  file.stream().write(encoded.bytes.data(), static_cast<std::streamsize>(encoded.bytes.size()));
  file.commit();
}

}  // namespace dynains::program
