#include <png.h>

#include "io/files.hpp"
#include "run/overview.hpp"
#include "support/catch.hpp"

namespace dynains::run {
namespace {

constexpr Colour kWhite = {255, 255, 255};
constexpr Colour kRed = {255, 0, 0};
constexpr Colour kBlue = {0, 0, 255};

/// A PNG file as a picture.
Picture read_picture(const std::filesystem::path& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_file(&image, path.c_str()) != 0);
  image.format = PNG_FORMAT_RGB;
  std::vector<unsigned char> bytes(PNG_IMAGE_SIZE(image));
  REQUIRE(png_image_finish_read(&image, nullptr, bytes.data(), 0, nullptr) != 0);
  Picture picture(static_cast<int>(image.width), static_cast<int>(image.height));
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      const unsigned char* p = &bytes[static_cast<std::size_t>(3 * (picture.width() * y + x))];
      picture.set(x, y, {p[0], p[1], p[2]});
    }
  }
  return picture;
}

}  // namespace

TEST_CASE("A picture is white at first, and is read back from its PNG file") {
  const test::TemporaryFolder folder;
  Picture picture(7, 3);
  picture.set(6, 0, kRed);
  picture.set(0, 2, kBlue);
  CHECK(picture.at(6, 0) == kRed);
  CHECK(picture.at(5, 0) == kWhite);
  const auto path = folder.path() / "picture.png";
  picture.write_png(path);

  const Picture read = read_picture(path);
  REQUIRE(read.width() == 7);
  REQUIRE(read.height() == 3);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 7; ++x) CHECK(picture.at(x, y) == read.at(x, y));
  }
  CHECK_THROWS_AS(picture.write_png(folder.path() / "missing" / "picture.png"), IoError);
}

}  // namespace dynains::run
