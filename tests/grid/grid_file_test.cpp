#include "grid/grid_maker.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::grid;
using namespace dynains::test;

namespace {

/// A map as the map server of nav2 loads it: -1 unknown, 0 free, 100 occupied, from the lowest row.
struct ServedMap {
  double resolution = 0.0;
  std::vector<double> origin;
  int width = 0, height = 0;
  std::vector<int> data;
};

/// The text behind `key: ` in a description.
std::string value_of(const std::string& yaml, const std::string& key) {
  const std::size_t at = yaml.find(key + ": ") + key.size() + 2;
  return yaml.substr(at, yaml.find('\n', at) - at);
}

ServedMap load(const std::string& description) {
  const std::string yaml = read_text(description);
  ServedMap map;
  REQUIRE(value_of(yaml, "mode") == "trinary");
  REQUIRE(value_of(yaml, "negate") == "0");
  map.resolution = std::stod(value_of(yaml, "resolution"));
  std::string origin = value_of(yaml, "origin");
  for (char& c : origin) c = std::string("[],").find(c) == std::string::npos ? c : ' ';
  std::istringstream numbers(origin);
  for (double number = 0.0; numbers >> number;) map.origin.push_back(number);
  const double occupied = std::stod(value_of(yaml, "occupied_thresh"));
  const double free = std::stod(value_of(yaml, "free_thresh"));

  const std::string name = value_of(yaml, "image");
  std::ifstream image(
      std::filesystem::path(description).parent_path() / name.substr(1, name.size() - 2),
      std::ios::binary);
  std::string kind;
  int most = 0;
  image >> kind >> map.width >> map.height >> most;
  image.get();
  REQUIRE(kind == "P5");
  REQUIRE(most == 255);
  map.data.resize(static_cast<std::size_t>(map.width * map.height));
  for (int y = map.height; y-- > 0;) {
    for (int x = 0; x < map.width; ++x) {
      const double shade = image.get() / 255.0;
      int& cell = map.data[static_cast<std::size_t>(y * map.width + x)];
      cell = 1.0 - shade > occupied ? 100 : 1.0 - shade < free ? 0 : -1;
    }
  }
  REQUIRE(image);
  return map;
}

}  // namespace

TEST_CASE("the map server of nav2 reads the states and the place of cells") {
  OccupancyGrid grid;
  grid.columns.edge = 0.05;
  grid.columns.origin = {-1.25, 2.5};
  grid.columns.width = 3;
  grid.columns.height = 2;
  grid.cells = {CellState::kFree,    CellState::kOccupied, CellState::kUnknown,
                CellState::kUnknown, CellState::kFree,     CellState::kFree};
  const TemporaryFolder folder;
  write_grid(folder / "a \"map\".pgm", folder / "map.yaml", grid, {500000.0, 4000.0});
  // The server unescapes the name.
  const std::string yaml = read_text(folder / "map.yaml");
  CHECK(value_of(yaml, "image") == "\"a \\\"map\\\".pgm\"");
  std::filesystem::rename(folder / "a \"map\".pgm", folder / "map.pgm");
  write_grid(folder / "map.pgm", folder / "map.yaml", grid, {500000.0, 4000.0});
  const ServedMap map = load(folder / "map.yaml");
  CHECK(map.resolution == 0.05);
  CHECK(map.origin == std::vector<double>{499998.75, 4002.5, 0.0});
  CHECK(map.width == 3);
  CHECK(map.height == 2);
  CHECK(map.data == std::vector<int>{0, 100, -1, -1, 0, 0});
}
