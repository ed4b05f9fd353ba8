#include "picture.hpp"

#include <png.h>

#include <memory>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"

namespace dynains::run {

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

}  // namespace dynains::run
