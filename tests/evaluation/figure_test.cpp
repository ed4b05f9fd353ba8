#include "figure.hpp"

#include <png.h>

#include <string>
#include <vector>

#include "dynains/errors.hpp"
#include "picture.hpp"
#include "sequences.hpp"
#include "support/catch.hpp"
#include "verdict_cloud.hpp"

namespace dynains::program {

using namespace evaluation::testing;

namespace {

constexpr Colour kWhite = {255, 255, 255};
constexpr Colour kRed = {255, 0, 0};
constexpr Colour kBlue = {0, 0, 255};

/// One point for each of the four outcomes, 10 m from the sensor.
VerdictCloud four_fates() {
  OwnedScan scan;
  scan.T_world_sensor.translation() = Eigen::Vector3d(1e6, 0, 0);
  scan.add(10.0F, 0.0F, 0.0F, kRoad, 1);
  scan.add(0.0F, 10.0F, 0.0F, kMovingCar, 0);
  scan.add(-10.0F, 0.0F, 0.0F, kRoad, 0);
  scan.add(0.0F, -10.0F, 0.0F, kMovingCar, 1);
  scan.add(0.01F, -10.0F, 0.01F, kMovingCar, 1);  // the same voxel
  scan.add(0.0F, -10.0F, 0.0F, 0, 1);             // ignored
  scan.add(1.0F, 0.0F, 0.0F, kRoad, 1);           // too near
  scan.add(60.0F, 0.0F, 0.0F, kRoad, 1);          // too far
  VerdictCloud cloud(0.1, 2.7, 50, evaluation::TruthClasses());
  cloud.add(scan.view());
  return cloud;
}

}  // namespace

TEST_CASE("A figure of the map shows the kept points, and no others") {
  VerdictCloud cloud = four_fates();
  OwnedScan scan;
  scan.T_world_sensor.translation() = Eigen::Vector3d(1e6, 0, 0);
  scan.add(5.0F, 0.0F, 0.0F, kRoad, 1);
  cloud.add(scan.view());
  const Picture map = draw_from_above(cloud, Content::kMap, 200);
  std::size_t kept = 0, missed = 0, others = 0;
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      const Colour colour = map.at(x, y);
      if (colour == kFateColours[static_cast<std::size_t>(Fate::kMissedDynamic)]) {
        ++missed;
      } else if (colour.r == colour.g && colour.g == colour.b) {
        kept += colour == kWhite ? 0 : 1;
      } else {
        ++others;
      }
    }
  }
  CHECK(kept > 0);
  CHECK(missed > 0);
  CHECK(others == 0);
}

TEST_CASE("Within a layer the nearest point is visible, and later layers cover earlier ones") {
  Picture picture(10, 5);
  CHECK(picture.at(3, 2) == kWhite);
  picture.splat(3.5, 2.5, 1.0, 0, kRed);
  picture.splat(3.5, 2.5, 2.0, 1, kBlue);  // farther, but larger
  CHECK(picture.at(3, 2) == kRed);
  CHECK(picture.at(2, 1) == kBlue);
  CHECK(picture.at(4, 3) == kBlue);
  CHECK(picture.at(5, 2) == kWhite);
  picture.begin_layer();
  picture.splat(3.5, 2.5, 9.0, 0, kBlue);
  CHECK(picture.at(3, 2) == kBlue);
  // Points at the border of the picture and far outside.
  picture.splat(-0.5, -0.5, 0, 1, kRed);
  CHECK(picture.at(0, 0) == kRed);
  picture.splat(1e300, -1e300, 0, 1, kRed);
  CHECK_THROWS_AS(Picture(0, 5), ConfigError);
  CHECK_THROWS_AS(Picture(5, 20000), ConfigError);
}

TEST_CASE("A picture is read back from its PNG file") {
  const TemporaryFolder folder;
  Picture picture(7, 3);
  picture.splat(6.5, 0.5, 0, 0, kRed);
  picture.splat(0.5, 2.5, 0, 0, kBlue);
  const auto path = folder.path() / "picture.png";
  picture.write_png(path);

  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_file(&image, path.c_str()) != 0);
  CHECK(image.width == 7);
  CHECK(image.height == 3);
  image.format = PNG_FORMAT_RGB;
  std::vector<unsigned char> bytes(PNG_IMAGE_SIZE(image));
  REQUIRE(png_image_finish_read(&image, nullptr, bytes.data(), 0, nullptr) != 0);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 7; ++x) {
      const unsigned char* pixel = &bytes[static_cast<std::size_t>(3 * (7 * y + x))];
      CHECK(picture.at(x, y) == Colour{pixel[0], pixel[1], pixel[2]});
    }
  }
  CHECK_THROWS_AS(picture.write_png(folder.path() / "missing" / "picture.png"), IoError);
}

TEST_CASE("A cloud of verdicts keeps one point per voxel and outcome") {
  const VerdictCloud cloud = four_fates();
  REQUIRE(cloud.points().size() == 4);
  CHECK(cloud.points()[0].fate == Fate::kKeptStatic);
  CHECK(cloud.points()[1].fate == Fate::kRemovedDynamic);
  CHECK(cloud.points()[2].fate == Fate::kLostStatic);
  CHECK(cloud.points()[3].fate == Fate::kMissedDynamic);
  CHECK(cloud.points()[0].local == Eigen::Vector3f(10, 0, 0));
  CHECK(cloud.origin().x() == 1e6);
}

TEST_CASE("A static point with a kept point in its voxel is not lost") {
  OwnedScan scan;
  scan.add(10.01F, 0.01F, 0.01F, kRoad, 0);  // lost, but kept in the same voxel
  scan.add(10.02F, 0.01F, 0.01F, kRoad, 1);
  scan.add(12.01F, 0.01F, 0.01F, kRoad, 0);  // lost for good
  scan.add(14.01F, 0.01F, 0.01F, kMovingCar, 1);
  scan.add(14.02F, 0.01F, 0.01F, kMovingCar, 0);  // removed, but missed in the same voxel
  VerdictCloud cloud(0.1, 2.7, 50, evaluation::TruthClasses());
  cloud.add(scan.view());
  CHECK(cloud.points().size() == 5);
  cloud.drop_covered();
  REQUIRE(cloud.points().size() == 3);
  CHECK(cloud.points()[0].fate == Fate::kKeptStatic);
  CHECK(cloud.points()[1].fate == Fate::kLostStatic);
  CHECK(cloud.points()[2].fate == Fate::kMissedDynamic);
}

TEST_CASE("Figures show each outcome at its place and in its colour") {
  const VerdictCloud cloud = four_fates();
  // 20 m by 20 m on 200 pixels: x to the right, y up.
  const Picture cleaned = draw_from_above(cloud, Content::kVerdict, 200);
  CHECK(cleaned.width() == 200);
  CHECK(cleaned.height() == 200);
  CHECK(cleaned.at(100, 0) == colour_of(Fate::kRemovedDynamic, Content::kVerdict));
  CHECK(cleaned.at(0, 100) == colour_of(Fate::kLostStatic, Content::kVerdict));
  CHECK(cleaned.at(100, 199) == colour_of(Fate::kMissedDynamic, Content::kVerdict));
  CHECK(cleaned.at(50, 50) == kWhite);
  const Picture raw = draw_from_above(cloud, Content::kRaw, 200);
  CHECK(raw.at(100, 0) == kRawDynamicColour);
  CHECK(raw.at(100, 199) == kRawDynamicColour);
  CHECK(!(raw.at(0, 100) == kWhite));
  CHECK(!(raw.at(0, 100) == colour_of(Fate::kLostStatic, Content::kVerdict)));

  // An empty cloud gives a white picture.
  const VerdictCloud nothing(0.1, 2.7, 50, evaluation::TruthClasses());
  CHECK(draw_from_above(nothing, Content::kRaw, 50).at(0, 0) == kWhite);
  CHECK(draw_perspective(nothing, Content::kRaw, 50).at(25, 10) == kWhite);
}

}  // namespace dynains::program
