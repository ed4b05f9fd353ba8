#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/io/point_file.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"
#include "viewer/tileset_writer.hpp"

namespace {

namespace fs = std::filesystem;
using dynains::FilePoint;
using dynains::PointColumns;
using dynains::test::read_text;
using dynains::test::TemporaryFolder;
using dynains::viewer::TileCube;
using dynains::viewer::TileNode;
using dynains::viewer::TilesetWriter;
using Json = nlohmann::json;

PointColumns all_columns() {
  PointColumns columns;
  columns.intensity = columns.label = columns.time = columns.session = true;
  return columns;
}

/// Points of a hilly square with an edge of `edge` m about (5e5, 4e6, 100). The label is the index.
std::vector<FilePoint> hills(std::size_t count, double edge) {
  dynains::test::Random random(7);
  std::vector<FilePoint> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    FilePoint& point = points[i];
    const double x = random.uniform(0.0, edge);
    const double y = random.uniform(0.0, edge);
    point.position = Eigen::Vector3d(5e5 + x, 4e6 + y, 100 + 3 * std::sin(0.1 * x));
    point.label = static_cast<std::uint32_t>(i);
    point.intensity = static_cast<float>(i % 256);
    point.time = 1e9 + static_cast<double>(i);
    point.session = static_cast<std::uint16_t>(i % 7);
  }
  return points;
}

void write_tileset(const std::vector<FilePoint>& points, const fs::path& folder) {
  Eigen::AlignedBox3d bounds;
  for (const FilePoint& point : points) bounds.extend(point.position);
  TilesetWriter writer(folder, all_columns(), bounds.min(), bounds.max());
  for (const FilePoint& point : points) writer.add(point);
  CHECK(writer.size() == points.size());
  writer.commit();
}

template <class Number>
Number number_at(const std::string& bytes, std::size_t offset) {
  Number number;
  REQUIRE(offset + sizeof(number) <= bytes.size());
  std::memcpy(&number, bytes.data() + offset, sizeof(number));
  return number;
}

/// Reads a .pnts file by the text of the standard.
std::vector<FilePoint> read_tile(const fs::path& file) {
  const std::string bytes = read_text(file);
  REQUIRE(bytes.substr(0, 4) == "pnts");
  REQUIRE(number_at<std::uint32_t>(bytes, 4) == 1);
  REQUIRE(number_at<std::uint32_t>(bytes, 8) == bytes.size());
  std::array<std::size_t, 5> begin{28};
  for (std::size_t part = 0; part < 4; ++part) {
    begin[part + 1] = begin[part] + number_at<std::uint32_t>(bytes, 12 + 4 * part);
    REQUIRE(begin[part + 1] % 8 == 0);
  }
  REQUIRE(begin[4] == bytes.size());
  const Json features = Json::parse(bytes.substr(begin[0], begin[1] - begin[0]));
  const Json batch = Json::parse(bytes.substr(begin[2], begin[3] - begin[2]));
  const std::map<std::string, std::pair<std::string, std::size_t>> expected = {
      {"intensity", {"FLOAT", 4}},
      {"label", {"UNSIGNED_INT", 4}},
      {"time", {"DOUBLE", 8}},
      {"session", {"UNSIGNED_SHORT", 2}}};
  REQUIRE(batch.size() == expected.size());
  std::map<std::string, std::size_t> column;
  for (const auto& [name, type] : expected) {
    REQUIRE(batch.at(name).at("componentType") == type.first);
    REQUIRE(batch.at(name).at("type") == "SCALAR");
    const auto offset = batch.at(name).at("byteOffset").get<std::size_t>();
    REQUIRE(offset % type.second == 0);
    column[name] = begin[3] + offset;
  }
  const auto centre = features.at("RTC_CENTER").get<std::vector<double>>();
  const std::size_t xyz = begin[1] + features.at("POSITION").at("byteOffset").get<std::size_t>();
  std::vector<FilePoint> points(features.at("POINTS_LENGTH").get<std::size_t>());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      points[i].position[static_cast<Eigen::Index>(axis)] =
          centre[axis] + static_cast<double>(number_at<float>(bytes, xyz + 12 * i + 4 * axis));
    }
    points[i].intensity = number_at<float>(bytes, column["intensity"] + 4 * i);
    points[i].label = number_at<std::uint32_t>(bytes, column["label"] + 4 * i);
    points[i].time = number_at<double>(bytes, column["time"] + 8 * i);
    points[i].session = number_at<std::uint16_t>(bytes, column["session"] + 2 * i);
  }
  return points;
}

/// Half edges and centre of an upright box.
Eigen::AlignedBox3d box_of(const Json& tile) {
  const auto numbers = tile.at("boundingVolume").at("box").get<std::vector<double>>();
  REQUIRE(numbers.size() == 12);
  const Eigen::Vector3d centre(numbers[0], numbers[1], numbers[2]);
  const Eigen::Vector3d half(numbers[3], numbers[7], numbers[11]);
  return {centre - half, centre + half};
}

struct Tree {
  std::size_t tiles = 0;
  std::set<std::string> files;
  std::vector<FilePoint> points;
};

/// Checks a tile and those below it against the promises of the standard.
void read_tree(const fs::path& folder, const Json& tile, double parent_error,
               const Eigen::AlignedBox3d& parent, Tree& tree) {
  const auto error = tile.at("geometricError").get<double>();
  CHECK(error < parent_error);
  CHECK((error > 0.0) == tile.contains("children"));
  Eigen::AlignedBox3d box = box_of(tile);
  box.min().array() -= 1e-6;
  box.max().array() += 1e-6;
  CHECK(parent.contains(box_of(tile)));
  const auto uri = tile.at("content").at("uri").get<std::string>();
  tree.files.insert(uri);
  ++tree.tiles;
  const std::vector<FilePoint> points = read_tile(folder / uri);
  CHECK(tile.at("extras").at("points") == points.size());
  CHECK(std::all_of(points.begin(), points.end(),
                    [&](const FilePoint& point) { return box.contains(point.position); }));
  tree.points.insert(tree.points.end(), points.begin(), points.end());
  if (!tile.contains("children")) return;
  for (const Json& child : tile.at("children")) read_tree(folder, child, error, box, tree);
}

Tree read_tileset(const fs::path& folder) {
  const Json tileset = Json::parse(read_text(folder / "tileset.json"));
  CHECK(tileset.at("asset").at("version") == "1.0");
  CHECK(tileset.at("root").at("refine") == "ADD");
  Tree tree;
  Eigen::AlignedBox3d everything(Eigen::Vector3d::Constant(-1e9), Eigen::Vector3d::Constant(1e9));
  read_tree(folder, tileset.at("root"), tileset.at("geometricError").get<double>(), everything,
            tree);
  CHECK(tileset.at("extras").at("points") == tree.points.size());
  return tree;
}

/// Each written point is in one tile, with its attributes and at its place.
void check_points(const std::vector<FilePoint>& written, std::vector<FilePoint> read) {
  REQUIRE(read.size() == written.size());
  std::sort(read.begin(), read.end(),
            [](const FilePoint& a, const FilePoint& b) { return a.label < b.label; });
  std::size_t wrong = 0;
  double farthest = 0.0;
  for (std::size_t i = 0; i < written.size(); ++i) {
    const FilePoint& a = written[i];
    const FilePoint& b = read[i];
    wrong += a.label == b.label && a.intensity == b.intensity && a.time == b.time &&
                     a.session == b.session
                 ? 0
                 : 1;
    farthest = std::max(farthest, (a.position - b.position).cwiseAbs().maxCoeff());
  }
  CHECK(wrong == 0);
  CHECK(farthest < 1e-4);
}

}  // namespace

TEST_CASE("A small map is one tile with all its points, in their order") {
  const TemporaryFolder folder;
  const std::vector<FilePoint> points = hills(1000, 50.0);
  write_tileset(points, folder.path());
  const Tree tree = read_tileset(folder.path());
  CHECK(tree.tiles == 1);
  for (std::size_t i = 0; i < points.size(); ++i) REQUIRE(tree.points[i].label == i);
  check_points(points, tree.points);
  // Nothing but the set and its page is left.
  CHECK(dynains::test::count_entries(folder.path()) == 3);
  CHECK(dynains::test::count_entries(folder / "tileset") == 1);
}

TEST_CASE("Every point of a large map is in one tile, and coarse tiles have spread points") {
  const TemporaryFolder folder;
  const std::vector<FilePoint> points = hills(300000, 400.0);
  write_tileset(points, folder.path());
  const Tree tree = read_tileset(folder.path());
  CHECK(tree.tiles > 5);
  CHECK(tree.files.size() == tree.tiles);
  check_points(points, tree.points);

  // 512 m of the cube give cells of 4 m in the root: each has one point at most.
  const std::vector<FilePoint> root = read_tile(folder / "tileset/r.pnts");
  std::set<std::array<long, 3>> cells;
  for (const FilePoint& point : root) {
    const Eigen::Vector3d cell = (point.position.array() / 4.0).floor();
    cells.insert({std::lround(cell.x()), std::lround(cell.y()), std::lround(cell.z())});
  }
  CHECK(root.size() > 9000);  // 100 x 100 cells of ground
  CHECK(root.size() < points.size() / 10);
  CHECK(cells.size() > root.size() / 2);
}

TEST_CASE("More points than the memory holds are divided while they come in") {
  const TemporaryFolder folder;
  const std::size_t count = TilesetWriter::kMostPointsInMemory + 400000;
  const std::vector<FilePoint> points = hills(count, 100.0);
  write_tileset(points, folder.path());
  check_points(points, read_tileset(folder.path()).points);
}

TEST_CASE("The same points give the same bytes") {
  const TemporaryFolder first, second;
  const std::vector<FilePoint> points = hills(120000, 100.0);
  write_tileset(points, first.path());
  write_tileset(points, second.path());
  CHECK(read_text(first / "tileset.json") == read_text(second / "tileset.json"));
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(first / "tileset")) {
    const std::string name = entry.path().filename().string();
    CHECK(read_text(entry.path()) == read_text(second / ("tileset/" + name)));
    ++files;
  }
  CHECK(files > 1);
  CHECK(dynains::test::count_entries(second / "tileset") == files);
}

TEST_CASE("Many points at one place end at the deepest level") {
  const TemporaryFolder folder;
  std::vector<FilePoint> points(TilesetWriter::kLeafPoints + 100);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].label = static_cast<std::uint32_t>(i);
  }
  write_tileset(points, folder.path());
  const Tree tree = read_tileset(folder.path());
  CHECK(tree.points.size() == points.size());
}

TEST_CASE("A point outside of the announced bounds is refused") {
  const TemporaryFolder folder;
  TilesetWriter writer(folder.path(), {}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
  FilePoint point;
  point.position = Eigen::Vector3d(0.5, 0.5, 1e3);
  CHECK_THROWS_AS(writer.add(point), dynains::ConfigError);
  point.position.z() = std::nan("");
  CHECK_THROWS_AS(writer.add(point), dynains::ConfigError);
  CHECK(writer.size() == 0);
}

TEST_CASE("Names of nodes") {
  using dynains::viewer::is_tile_node_name;
  CHECK(is_tile_node_name("r"));
  CHECK(is_tile_node_name("r0127"));
  for (const char* name :
       {"", "0", "r8", "r/0", "../r", "rr", "r0.pnts", "r00000000000000000000000000"}) {
    INFO(name);
    CHECK_FALSE(is_tile_node_name(name));
  }
}
