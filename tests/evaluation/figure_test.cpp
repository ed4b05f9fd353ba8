#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/errors.hpp"
#include "program/change_picture.hpp"
#include "program/chart.hpp"
#include "program/verdict_figure.hpp"
#include "run/picture.hpp"
#include "run/verdict_cloud.hpp"
#include "sequences.hpp"
#include "support/catch.hpp"

namespace dynains::program {

using namespace evaluation::testing;

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

/// Whether a pixel at most 3 pixels away has a colour.
bool has_colour_near(const Picture& picture, int x, int y, Colour colour) {
  for (int row = y - 3; row <= y + 3; ++row) {
    for (int column = x - 3; column <= x + 3; ++column) {
      if (picture.at(column, row) == colour) return true;
    }
  }
  return false;
}

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

std::size_t count_dots(const Figure& figure) {
  std::size_t count = 0;
  for (const auto& layer : figure.layers) count += layer.size();
  return count;
}

}  // namespace

TEST_CASE("A figure of the map shows the kept points, and no others") {
  VerdictCloud cloud = four_fates();
  OwnedScan scan;
  scan.T_world_sensor.translation() = Eigen::Vector3d(1e6, 0, 0);
  scan.add(5.0F, 0.0F, 0.0F, kRoad, 1);
  cloud.add(scan.view());
  const Figure map = view_from_above(cloud, Content::kMap, 200);
  CHECK(map.layers[0].size() == 2);
  for (const Figure::Dot& dot : map.layers[0]) {
    CHECK(dot.colour.r == dot.colour.g);
    CHECK(dot.colour.g == dot.colour.b);
  }
  const auto missed = static_cast<std::size_t>(Fate::kMissedDynamic);
  REQUIRE(map.layers[missed].size() == 1);
  CHECK(map.layers[missed][0].colour == kFateColours[missed]);
  CHECK(count_dots(map) == 3);
}

TEST_CASE("A picture is white, and its sides are bounded") {
  Picture picture(10, 5);
  CHECK(picture.at(3, 2) == kWhite);
  picture.set(3, 2, kRed);
  CHECK(picture.at(3, 2) == kRed);
  CHECK(picture.at(2, 2) == kWhite);
  CHECK_THROWS_AS(Picture(0, 5), ConfigError);
  CHECK_THROWS_AS(Picture(5, 20000), ConfigError);
}

TEST_CASE("A picture is read back from its PNG file") {
  const TemporaryFolder folder;
  Picture picture(7, 3);
  picture.set(6, 0, kRed);
  picture.set(0, 2, kBlue);
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
  const Figure cleaned = view_from_above(cloud, Content::kVerdict, 200);
  CHECK(cleaned.width == 200);
  CHECK(cleaned.height == 200);
  const auto check = [](const Figure& figure, std::size_t layer, double x, double y,
                        Colour colour) {
    REQUIRE(figure.layers[layer].size() == 1);
    const Figure::Dot& dot = figure.layers[layer][0];
    CHECK(std::abs(static_cast<double>(dot.x) - x) < 0.11);  // half a cell of 0.2 m
    CHECK(std::abs(static_cast<double>(dot.y) - y) < 0.11);
    CHECK(dot.colour == colour);
  };
  const auto layer = [](Fate fate) { return static_cast<std::size_t>(fate); };
  check(cleaned, layer(Fate::kRemovedDynamic), 0, 10, kFateColours[1]);
  check(cleaned, layer(Fate::kLostStatic), -10, 0, kFateColours[2]);
  check(cleaned, layer(Fate::kMissedDynamic), 0, -10, kFateColours[3]);
  CHECK(cleaned.layers[0].size() == 1);
  const Figure raw = view_from_above(cloud, Content::kRaw, 200);
  REQUIRE(raw.layers[1].size() == 2);
  CHECK(raw.layers[1][0].colour == kRawDynamicColour);
  CHECK(raw.layers[0].size() == 2);

  const VerdictCloud nothing(0.1, 2.7, 50, evaluation::TruthClasses());
  CHECK(count_dots(view_from_above(nothing, Content::kRaw, 50)) == 0);
  CHECK(count_dots(view_in_perspective(nothing, Content::kRaw, 50)) == 0);
}

TEST_CASE("A cell of a figure has one dot: of the errors first, then of the nearest point") {
  OwnedScan scan;
  scan.add(20.0F, 20.0F, 0.0F, kRoad, 1);
  scan.add(-20.0F, -20.0F, 0.0F, kRoad, 1);
  scan.add(5.0F, 5.0F, -1.0F, kRoad, 1);
  scan.add(5.0F, 5.0F, 6.0F, kRoad, 1);  // above, hence lighter
  scan.add(-5.0F, 5.0F, 9.0F, kRoad, 1);
  scan.add(-5.0F, 5.0F, 0.0F, kMovingCar, 1);  // below, but missed
  VerdictCloud cloud(0.1, 2.7, 50, evaluation::TruthClasses());
  cloud.add(scan.view());
  const Figure figure = view_from_above(cloud, Content::kVerdict, 100);
  CHECK(figure.layers[0].size() == 3);
  CHECK(figure.layers[3].size() == 1);
  CHECK(count_dots(figure) == 4);
  const auto near = [](const Figure::Dot& dot) { return dot.x > 4.0F && dot.x < 6.0F; };
  const auto& plain = figure.layers[0];
  const auto found = std::find_if(plain.begin(), plain.end(), near);
  REQUIRE(found != plain.end());
  CHECK(found->colour.r > plain[0].colour.r);
}

TEST_CASE("gnuplot draws a figure from files in any folder") {
  const TemporaryFolder folder;
  // No shell reads this name.
  const std::filesystem::path strange = folder.path() / "it's \"$(touch broken)\" `x`\n; ";
  std::filesystem::create_directory(strange);
  const Figure figure = view_from_above(four_fates(), Content::kVerdict, 400);
  try {
    write_figure(figure, strange, "cleaned");
    draw_figure(strange, "cleaned");
  } catch (const IoError& error) {
    if (!has(error.what(), "is not installed")) throw;
    WARN("SKIPPED: no gnuplot");
    return;
  }
  CHECK(!std::filesystem::exists(strange / "broken"));
  CHECK(read_text(strange / "cleaned.dat").size() == 12 * count_dots(figure));
  const std::string script = read_text(strange / "cleaned.gp");
  CHECK(has(script, "x (m)"));
  CHECK(has(script, "\"5 m\""));  // the scale bar
  CHECK(has(script, "removed dynamic"));
  CHECK(!has(script, folder.path().string()));

  const Picture picture = read_picture(strange / "cleaned.png");
  CHECK(picture.width() == 640);
  CHECK(picture.height() == 510);
  // 20 m on 400 pixels, from 80 pixels on the left and 40 at the top.
  CHECK(has_colour_near(picture, 280, 41, kFateColours[1]));
  CHECK(has_colour_near(picture, 81, 240, kFateColours[2]));
  CHECK(has_colour_near(picture, 280, 438, kFateColours[3]));
  CHECK(!has_colour_near(picture, 150, 150, kFateColours[3]));
  // A second call writes equal bytes.
  write_figure(figure, folder.path(), "cleaned");
  draw_figure(folder.path(), "cleaned");
  for (const char* name : {"cleaned.dat", "cleaned.gp", "cleaned.png"}) {
    CHECK(read_text(folder.path() / name) == read_text(strange / name));
  }
}

TEST_CASE("Without gnuplot, the data stay, and the error names the package") {
  const TemporaryFolder folder;
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder.path().c_str(), 1);
  std::string message;
  try {
    write_figure(view_from_above(four_fates(), Content::kMap, 100), folder.path(), "map");
    draw_figure(folder.path(), "map");
  } catch (const IoError& error) {
    message = error.what();
  }
  ::setenv("PATH", path.c_str(), 1);
  CHECK(has(message, "gnuplot-nox"));
  CHECK(std::filesystem::exists(folder.path() / "map.gp"));
  CHECK(std::filesystem::exists(folder.path() / "map.dat"));
  CHECK(!std::filesystem::exists(folder.path() / "map.png"));
}

TEST_CASE("A picture of changes shows what came, what left and what stands, also far away") {
  SessionInfo first, second;
  first.lowest = Eigen::Vector3d(512310.0, -5403020.0, 0.0);
  first.highest = Eigen::Vector3d(512340.0, -5403000.0, 5.0);
  second.lowest = Eigen::Vector3d(512320.0, -5403020.0, 0.0);
  second.highest = Eigen::Vector3d(512350.0, -5403010.0, 5.0);
  ChangePicture changes({first, second}, 401);
  const auto at = [&](double x, double y, double z) {
    return Eigen::Vector3d(first.lowest + Eigen::Vector3d(x, y, z));
  };
  changes.add_standing(at(5.0, 5.0, 0.0), false);
  changes.add_standing(at(10.0, 5.0, 0.0), false);
  changes.add_standing(at(10.0, 5.0, 2.0), true);  // above the ground
  changes.add_removed(at(20.0, 15.0, 1.0));
  changes.add_standing(at(20.0, 15.0, 4.0), true);  // higher, but no change
  changes.add_added(at(30.0, 5.0, 1.0));
  changes.add_removed(at(30.0, 5.0, 2.0));
  changes.add_added(at(-1.0, 5.0, 1.0));  // outside
  const Figure figure = changes.figure();
  CHECK(figure.width == 401);  // 40 m
  CHECK(figure.height == 201);
  CHECK(figure.layers[0].size() == 2);
  CHECK(figure.layers[1].size() == 1);
  CHECK(figure.layers[2].size() == 1);
  CHECK(figure.legend.size() == 4);

  const TemporaryFolder folder;
  write_figure(figure, folder.path(), "changes");
  const std::string script = read_text(folder.path() / "changes.gp");
  CHECK(has(script, "\"x - 510000 (m)\""));
  CHECK(has(script, "\"y + 5400000 (m)\""));
  CHECK(has(script, "\"10 m\""));
  CHECK(has(script, "\"removed\""));
  try {
    draw_figure(folder.path(), "changes");
  } catch (const IoError& error) {
    if (!has(error.what(), "is not installed")) throw;
    WARN("SKIPPED: no gnuplot");
    return;
  }
  // 10 pixels per m, from 80 pixels on the left; y = 0 is 40 + 201 pixels below the top.
  const Picture picture = read_picture(folder.path() / "changes.png");
  CHECK(has_colour_near(picture, 80 + 50, 241 - 50, kStandingGroundColour));
  CHECK(has_colour_near(picture, 80 + 100, 241 - 50, kStandingObjectColour));
  CHECK(has_colour_near(picture, 80 + 200, 241 - 150, kRemovedColour));
  CHECK(!has_colour_near(picture, 80 + 200, 241 - 150, kStandingObjectColour));
  CHECK(has_colour_near(picture, 80 + 300, 241 - 50, kAddedColour));
  CHECK(!has_colour_near(picture, 80 + 300, 241 - 50, kRemovedColour));
  CHECK(!has_colour_near(picture, 80 + 300, 241 - 150, kRemovedColour));
}

TEST_CASE("A picture of a map without sessions is empty") {
  const Figure figure = ChangePicture({}, 100).figure();
  CHECK(count_dots(figure) == 0);
  CHECK(figure.width == 100);
  CHECK(figure.origin_x == 0.0);
}

TEST_CASE("The script of a chart has its data, with gaps, and texts that are only texts") {
  Chart numbers("tau-s", {"PR", "RR"});
  numbers.add("0.1", {99.5, std::nan("")});
  numbers.add("1e-1", {98, 50});
  const std::string script = numbers.script();
  CHECK(has(script, "\n0.1 99.500000 -\n1e-1 98.000000 50.000000\nEND\n"));
  CHECK(has(script, "set xlabel \"tau-s\""));
  CHECK(has(script, "using 1:3"));
  CHECK(has(script, "title \"RR\""));

  Chart texts("\"; system(\"touch broken\") #", {"PR"});
  texts.add("`date`\\", {1});
  texts.add("2", {2});
  CHECK(has(texts.script(), "set xlabel \"?; system(?touch broken?) #\"\n"));
  CHECK(has(texts.script(), "\n\"?date??\" 1.000000\n\"2\" 2.000000\n"));
  CHECK(has(texts.script(), "using 0:2:xtic(1)"));
}

}  // namespace dynains::program
