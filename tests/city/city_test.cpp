// A map of many sessions: order, repetition, removal, damage and failure.
#include "dynains/city/city.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "dynains/city/change_clusters.hpp"
#include "dynains/city/city_map.hpp"
#include "dynains/city/session_writer.hpp"
#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "support/box_street.hpp"
#include "support/catch.hpp"

using namespace dynains;
namespace fs = std::filesystem;

namespace {

constexpr std::uint32_t kParked = 10, kContainer = 99;
const test::StreetBox kParkedCar = {{4, 3, 0}, {8, 5, 1.5}, kParked};
const test::StreetBox kNewContainer = {{-6, -8, 0}, {-2, -6, 2}, kContainer};

struct Session {
  std::string name;
  double begin;
  std::vector<test::StreetBox> boxes;
};

/// A car is there on the first day only, a container from the second day on.
const std::vector<Session> kDays = {{"monday", 0.0, {kParkedCar}},
                                    {"tuesday", 86400.0, {kNewContainer}},
                                    {"wednesday", 172800.0, {kNewContainer}}};

void add(const City& city, const Session& session, const std::vector<test::BoxScan>& scans,
         const SessionPointsConfig& config = {}) {
  SessionInfo info;
  info.name = session.name;
  info.begin = session.begin;
  info.fingerprint = session.name;
  SessionWriter writer(city, info, config);
  std::uint32_t number = 0;
  for (const test::BoxScan& scan : scans) {
    writer.add(scan.points, scan.verdicts, scan.labels, scan.T_world_sensor, number++);
  }
  writer.commit();
}

void add(const City& city, const Session& session) {
  add(city, session, test::drive_along(session.boxes, -5.0, 5.0));
}

City city_of(const fs::path& folder, const std::vector<Session>& sessions) {
  const City city = City::open_or_make(folder, {});
  for (const Session& session : sessions) add(city, session);
  return city;
}

/// Everything that the map tells, as bytes.
std::string map_bytes(const City& city, std::uint32_t last = TileHistory::kNever) {
  const CityMap map(city);
  std::string bytes;
  for (const TileIndex& tile : map.tiles()) {
    const TileHistory history = map.history(tile, last);
    history.for_each_standing(last, [&](std::size_t session, std::size_t i) {
      const SessionPoint& point = history.points(session)[i];
      bytes += map.sessions()[session].name;
      const float coordinates[] = {point.x, point.y, point.z};
      bytes.append(reinterpret_cast<const char*>(coordinates), sizeof(coordinates));
      bytes += std::to_string(point.scan) + ' ' + std::to_string(point.label) +
               (point.is_ground ? 'g' : 'o');
    });
  }
  return bytes;
}

/// Number of points of the map by label.
std::map<std::uint32_t, std::size_t> label_counts(const City& city,
                                                  std::uint32_t last = TileHistory::kNever) {
  const CityMap map(city);
  std::map<std::uint32_t, std::size_t> counts;
  for (const TileIndex& tile : map.tiles()) {
    const TileHistory history = map.history(tile, last);
    history.for_each_standing(last, [&](std::size_t session, std::size_t i) {
      ++counts[history.points(session)[i].label];
    });
  }
  return counts;
}

/// Path and content of every file below a folder.
std::map<std::string, std::string> files_below(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) {
      files[entry.path().string()] = "folder";
      continue;
    }
    std::ifstream file(entry.path(), std::ios::binary);
    files[entry.path().string()] =
        std::string(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return files;
}

fs::path some_tile(const City& city, const std::string& session) {
  std::vector<fs::path> tiles;
  for (const auto& entry : fs::directory_iterator(city.session_folder(session) / "tiles")) {
    tiles.push_back(entry.path());
  }
  REQUIRE_FALSE(tiles.empty());
  return *std::min_element(tiles.begin(), tiles.end());
}

void change_byte(const fs::path& path, std::streamoff at) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekg(at);
  const int byte = file.get();
  file.seekp(at);
  file.put(static_cast<char>(byte ^ 1));
}

bool names(const std::vector<std::string>& defects, const std::string& text) {
  return std::any_of(defects.begin(), defects.end(), [&](const std::string& defect) {
    return defect.find(text) != std::string::npos;
  });
}

}  // namespace

TEST_CASE("a city: sessions in any order give the same map and the same files") {
  const test::TemporaryFolder folder;
  std::vector<std::size_t> order = {0, 1, 2};
  std::string expected;
  std::size_t orders = 0;
  do {
    const City city = city_of(folder.path() / std::to_string(orders++),
                              {kDays[order[0]], kDays[order[1]], kDays[order[2]]});
    const std::string bytes = map_bytes(city);
    if (expected.empty()) expected = bytes;
    CHECK(bytes.size() > 1000);
    CHECK(bytes == expected);
    CHECK(city.check().empty());
  } while (std::next_permutation(order.begin(), order.end()));
  CHECK(orders == 6);
}

TEST_CASE("a city: what a later session sees through leaves, what it sees standing comes in") {
  const test::TemporaryFolder folder;
  const City city = city_of(folder.path() / "city", kDays);
  auto first = label_counts(city, 0);
  auto second = label_counts(city, 1);
  REQUIRE(first[kParked] > 100);
  CHECK(first[kContainer] == 0);
  CHECK(second[kContainer] > 100);
  CHECK(second[50] > first[50] * 99 / 100);
  CHECK(second[40] > first[40] * 99 / 100);

  const CityMap map(city);
  for (const TileIndex& tile : map.tiles()) {
    const TileHistory history = map.history(tile, 1);
    for (std::size_t i = 0; i < history.points(0).size(); ++i) {
      const SessionPoint& point = history.points(0)[i];
      if (point.label != kParked) continue;
      CHECK_FALSE(history.stands(0, i, 1));
      CHECK(history.stands(0, i, 0));
      CHECK(history.removal(0, i).session == 1);
      CHECK(history.removal(0, i).scan <= 10);
    }
  }
}

TEST_CASE("a city: what a later session did not see stays") {
  const test::TemporaryFolder folder;
  const City city = city_of(folder.path() / "city", {kDays[0]});
  const test::StreetBox wall = {{-40, 2.0, 0}, {40, 2.2, 5}, 50};
  add(city, {"tuesday", 86400.0, {wall}});
  auto before = label_counts(city, 0);
  auto after = label_counts(city, 1);
  REQUIRE(before[kParked] > 100);
  CHECK(after[kParked] == before[kParked]);
}

TEST_CASE("a city: what a run missed does not come in where earlier sessions saw free space") {
  const test::TemporaryFolder folder;
  // A car drives ahead, and the run of tuesday does not see that it moves.
  std::vector<test::BoxScan> scans;
  for (const double x : {0.0, 1.0}) {
    const double rear = 3.0 + 6.0 * x;
    scans.push_back(test::scan_boxes({{{rear, 3, 0}, {rear + 4, 5, 1.5}, kParked}}, x, 0.0));
  }
  const City without = city_of(folder.path() / "without", {});
  add(without, {"tuesday", 86400.0, {}}, scans);
  City with = city_of(folder.path() / "with", {{"monday", 0.0, {}}});
  add(with, {"tuesday", 86400.0, {}}, scans);
  REQUIRE(label_counts(without)[kParked] > 20);
  CHECK(label_counts(with)[kParked] == 0);
  CHECK(label_counts(with)[40] > label_counts(without)[40] * 99 / 100);
  with.drop("monday");
  CHECK(map_bytes(with) == map_bytes(without));
}

TEST_CASE("a city: beams that end at moving points remove nothing") {
  const test::TemporaryFolder folder;
  const City city = city_of(folder.path() / "city", {kDays[0]});
  // All beams through the place of the car end behind it, at points with a dynamic verdict.
  std::vector<test::BoxScan> scans =
      test::drive_along({{{-20, 3.4, 0}, {30, 6, 4}, kContainer}}, -5.0, 5.0);
  const City seen_through = city_of(folder.path() / "seen_through", {kDays[0]});
  add(seen_through, kDays[1], scans);
  for (test::BoxScan& scan : scans) {
    for (std::size_t i = 0; i < scan.labels.size(); ++i) {
      if (scan.labels[i] == kContainer) scan.verdicts[i] = PointLabel::kDynamic;
    }
  }
  add(city, kDays[1], scans);
  auto before = label_counts(city, 0);
  CHECK(label_counts(seen_through, 1)[kParked] < before[kParked] / 2);
  CHECK(label_counts(city, 1)[kParked] > before[kParked] * 9 / 10);
}

TEST_CASE("a city: an object of which a part is seen through leaves as a whole") {
  const test::TemporaryFolder folder;
  const City city = city_of(folder.path() / "city", {kDays[0]});
  // A wall hides most of the place of the car.
  add(city, {"tuesday", 86400.0, {{{-40, 2.0, 0}, {5.5, 2.2, 5}, 50}}});
  REQUIRE(label_counts(city, 0)[kParked] > 100);
  CHECK(label_counts(city, 1)[kParked] == 0);
}

TEST_CASE("a city: changes are objects that came or left") {
  const test::TemporaryFolder folder;
  const City city = city_of(folder.path() / "city", kDays);
  const CityMap map(city);
  const auto labels = [&](std::uint32_t a, std::uint32_t b, auto member) {
    std::map<std::uint32_t, std::size_t> counts;
    for (const TileIndex& tile : map.tiles()) {
      const CityChanges changes = map.changes(tile, a, b);
      for (const CityPoint& p : changes.*member) ++counts[p.point.label];
    }
    return counts;
  };
  auto removed = labels(0, 1, &CityChanges::removed);
  CHECK(removed.size() == 1);
  CHECK(removed[kParked] > 100);
  auto added = labels(0, 2, &CityChanges::added);
  CHECK(added.size() == 1);
  CHECK(added[kContainer] > 100);
  CHECK(labels(1, 2, &CityChanges::added).empty());
  CHECK(labels(1, 2, &CityChanges::removed).empty());
  CHECK_THROWS_AS(map.changes(map.tiles().front(), 1, 1), ConfigError);
}

TEST_CASE("a city: an object has come if a session before its own saw its place empty") {
  // On monday, a wall hides the place of the container.
  const test::StreetBox wall = {{-40, -3.2, 0}, {40, -3.0, 5}, 50};
  const bool is_seen_on_tuesday = GENERATE(false, true);
  CAPTURE(is_seen_on_tuesday);
  const std::vector<test::StreetBox> tuesday =
      is_seen_on_tuesday ? std::vector<test::StreetBox>() : std::vector{wall};
  const test::TemporaryFolder folder;
  const City city = city_of(folder.path() / "city",
                            {{"monday", 0.0, {wall}}, {"tuesday", 86400.0, tuesday}, kDays[2]});
  const CityMap map(city);
  std::size_t added = 0;
  for (const TileIndex& tile : map.tiles()) {
    for (const CityPoint& p : map.changes(tile, 0, 2).added) {
      added += p.point.label == kContainer ? 1 : 0;
    }
  }
  CHECK(label_counts(city)[kContainer] > 100);
  CHECK((added > 100) == is_seen_on_tuesday);
  CHECK((added == 0) != is_seen_on_tuesday);
}

TEST_CASE("clusters of changes: small ones, parts and what was seen too briefly are none") {
  const SessionGrid grid;
  // A wall of points 0.2 m apart, 2 m long and 1.6 m high.
  const auto wall = [](float height, std::uint32_t hits) {
    std::vector<ChangedPoint> points;
    for (int column = 0; column < 10; ++column) {
      const float x = 5.1F + 0.2F * static_cast<float>(column);
      for (float z = 0.1F; z < height; z += 0.2F) {
        points.push_back({{x, 5.1F, z, 0, 0, false}, hits, false});
      }
    }
    return points;
  };
  const auto selected = [&](const ChangeClusters& clusters,
                            const std::vector<ChangedPoint>& points) {
    const std::vector<bool> is_selected = clusters.select(points);
    return std::count(is_selected.begin(), is_selected.end(), true);
  };
  const ChangeClusters alone(grid);
  CHECK(selected(alone, wall(1.6F, 5)) == 80);
  CHECK(selected(alone, wall(0.4F, 5)) == 0);  // lower than 0.4 m
  CHECK(selected(alone, wall(1.6F, 2)) == 0);
  CHECK(selected(alone, {}) == 0);
  // An object moved if beams of its own session passed through its place.
  std::vector<ChangedPoint> waiting = wall(1.6F, 5);
  for (std::size_t i = 0; i < 4; ++i) waiting[10 * i].is_passed = true;
  CHECK(selected(alone, waiting) == 80);  // 5 %
  waiting.back().is_passed = true;
  CHECK(selected(alone, waiting) == 0);
  ChangeClusters in_a_corner(grid), in_a_bush(grid);
  for (const ChangedPoint& changed : wall(1.6F, 5)) {
    SessionPoint beside = changed.point;
    beside.y += 0.4F;
    if (beside.x < 5.4F) in_a_corner.add_standing(beside);
    in_a_bush.add_standing(beside);
  }
  CHECK(selected(in_a_corner, wall(1.6F, 5)) == 80);
  CHECK(selected(in_a_bush, wall(1.6F, 5)) == 0);
}

TEST_CASE("a city: points beyond the contribution range do not come in") {
  const test::TemporaryFolder folder;
  SessionPointsConfig near;
  near.contribution_range = 20.0;
  const std::vector<test::BoxScan> scans = {test::scan_boxes({}, 0.0, 0.0)};
  const City city = city_of(folder.path() / "city", {});
  add(city, kDays[0], scans, near);
  const SessionInfo session = city.sessions().at(0);
  CHECK(session.points > 1000);
  CHECK(session.highest.head<2>().cwiseAbs().maxCoeff() <= 20.0);
  CHECK(session.lowest.head<2>().cwiseAbs().maxCoeff() > 15.0);
  near.contribution_range = 0.0;
  CHECK_THROWS_WITH(add(city, kDays[1], scans, near), ContainsSubstring("contribution_range"));
}

TEST_CASE("a city: tiles behind the sensor are on the disk, and come back with it") {
  const test::TemporaryFolder folder;
  SessionGrid grid;
  grid.tile = 10.0;
  SessionPointsConfig config;
  config.contribution_range = 15.0;
  const City city = City::open_or_make(folder.path() / "city", grid);
  const test::BoxScan scan = test::scan_boxes({kParkedCar}, 0.0, 0.0);
  SessionInfo info;
  info.name = "monday";
  SessionWriter writer(city, info, config);
  SessionPoints all(grid, config);
  std::size_t most = 0;
  // Away, back, and over the same places again, at other heights within their voxels.
  for (std::uint32_t number = 0; number < 60; ++number) {
    const double way = 8.0 * (number < 40 ? number : 80 - number);
    Eigen::Isometry3d T_world_sensor = scan.T_world_sensor;
    T_world_sensor.translation() += Eigen::Vector3d(way, 0.3 * way, 0.01 * number);
    writer.add(scan.points, scan.verdicts, scan.labels, T_world_sensor, number);
    all.add(scan.points, scan.verdicts, scan.labels, T_world_sensor, number);
    most = std::max(most, writer.held_points());
  }
  CHECK(most < all.size() / 4);
  writer.commit();
  const SessionInfo session = city.sessions().at(0);
  CHECK(session.points == all.size());
  std::size_t tiles = 0;
  all.for_each_tile([&](const TileIndex& tile, const std::vector<SessionPoint>& expected) {
    ++tiles;
    const std::vector<SessionPoint> found = city.read_tile(session, tile);
    REQUIRE(found.size() == expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      REQUIRE(found[i].x == expected[i].x);
      REQUIRE(found[i].y == expected[i].y);
      REQUIRE(found[i].z == expected[i].z);
      REQUIRE(found[i].scan == expected[i].scan);
    }
  });
  CHECK(session.tiles.size() == tiles);
}

TEST_CASE("a city: a dropped session leaves the bytes of never having had it") {
  const test::TemporaryFolder folder;
  const City without = city_of(folder.path() / "without", {kDays[0]});
  City with = city_of(folder.path() / "with", {kDays[0], kDays[1]});
  REQUIRE(label_counts(with)[kParked] == 0);
  with.drop("tuesday");
  // The car that the dropped session saw through is back.
  CHECK(label_counts(with)[kParked] > 100);
  CHECK(map_bytes(with) == map_bytes(without));
  for (std::size_t dropped = 0; dropped < kDays.size(); ++dropped) {
    std::vector<Session> others = kDays;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(dropped));
    City all = city_of(folder.path() / ("all" + std::to_string(dropped)), kDays);
    all.drop(kDays[dropped].name);
    CHECK(map_bytes(all) ==
          map_bytes(city_of(folder.path() / ("others" + std::to_string(dropped)), others)));
  }
  CHECK(with.sessions().size() == 1);
  CHECK_FALSE(fs::exists(with.session_folder("tuesday")));
  for (const auto& entry : fs::directory_iterator(with.folder())) {
    CHECK(entry.path().filename().string().front() != '.');
  }
  CHECK_THROWS_AS(with.drop("tuesday"), IoError);
  CHECK_THROWS_AS(with.drop("../with"), IoError);
}

TEST_CASE("a city: files that are not of the session are not removed") {
  const test::TemporaryFolder folder;
  City city = city_of(folder.path() / "city", {kDays[0]});
  std::ofstream(city.session_folder("monday") / "notes.txt") << "mine";
  const auto before = files_below(city.folder());
  CHECK_THROWS_WITH(city.drop("monday"), ContainsSubstring("notes.txt"));
  CHECK(files_below(city.folder()) == before);
}

TEST_CASE("a city: the same session twice is refused") {
  const test::TemporaryFolder folder;
  const City city = city_of(folder.path() / "city", {kDays[0]});
  const auto before = files_below(city.folder());
  CHECK_THROWS_AS(add(city, kDays[0]), UsageError);
  SessionInfo again;
  again.name = "another";
  again.fingerprint = "monday";
  CHECK_THROWS_WITH(SessionWriter(city, again), ContainsSubstring("monday"));
  SessionInfo nameless;
  nameless.name = "../monday";
  CHECK_THROWS_AS(SessionWriter(city, nameless), ConfigError);
  CHECK(files_below(city.folder()) == before);
}

TEST_CASE("a city: another grid or version is refused") {
  const test::TemporaryFolder folder;
  const City city = city_of(folder.path() / "city", {kDays[0]});
  SessionGrid coarse;
  coarse.map_voxel = 0.3;
  CHECK_THROWS_WITH(City::open_or_make(city.folder(), coarse),
                    ContainsSubstring("map_voxel = 0.2 m") && ContainsSubstring("0.3"));
  const fs::path tile = some_tile(city, "monday");
  change_byte(tile, 8);
  CHECK_THROWS_WITH(map_bytes(city), ContainsSubstring("version 0; expected version 1"));

  std::ofstream(city.folder() / "city.json")
      << R"({"format": "dynains city", "format_version": 2, "map_voxel": 0.2, "tile": 50})";
  CHECK_THROWS_WITH(City(city.folder()), ContainsSubstring("expected version 1"));

  fs::create_directory(folder.path() / "other");
  std::ofstream(folder.path() / "other" / "holiday.txt") << "mine";
  CHECK_THROWS_AS(City::open_or_make(folder.path() / "other", {}), IoError);
  CHECK_THROWS_AS(City(folder.path() / "nothing"), IoError);
}

TEST_CASE("a city: every damage is named by path and position") {
  const test::TemporaryFolder folder;
  const City city = city_of(folder.path() / "city", {kDays[0]});
  REQUIRE(city.check().empty());
  const fs::path tile = some_tile(city, "monday");
  const fs::path references = city.session_folder("monday") / "references.bin";
  const auto size = static_cast<std::streamoff>(fs::file_size(tile));
  for (const std::streamoff at :
       {std::streamoff{0}, std::streamoff{9}, std::streamoff{17}, std::streamoff{33},
        std::streamoff{41}, std::streamoff{60}, size - 3}) {
    change_byte(tile, at);
    const auto defects = city.check();
    REQUIRE(defects.size() == 1);
    CHECK(names(defects, tile.string() + ": byte "));
    change_byte(tile, at);
  }
  REQUIRE(city.check().empty());

  for (const std::streamoff at : {0, 8, 20, 47, 60, 400}) {
    change_byte(references, at);
    CHECK(names(city.check(), references.string() + ": byte "));
    change_byte(references, at);
  }
  fs::resize_file(references, fs::file_size(references) - 1);
  CHECK(names(city.check(), references.string()));
  fs::resize_file(tile, fs::file_size(tile) - 1);
  CHECK(names(city.check(), tile.string() + ": byte 40"));
  fs::rename(tile, tile.parent_path() / "77_77.tile");
  const auto defects = city.check();
  CHECK(names(defects, tile.string()));
  CHECK(names(defects, "77_77.tile: session.json does not list it"));
}

TEST_CASE("a city: a change of session.json and a link in place of a session are defects") {
  const test::TemporaryFolder folder;
  City city = city_of(folder.path() / "city", {kDays[0]});
  const fs::path file = city.session_folder("monday") / "session.json";
  const auto text_of = [](const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  const std::string whole = text_of(file);
  REQUIRE(city.check().empty());
  for (const std::string name : {"begin", "scans", "points", "lowest", "highest", "recording"}) {
    CAPTURE(name);
    std::string changed = whole;
    const std::size_t at =
        changed.find_first_of("0123456789y", changed.find('"' + name + "\":") + name.size() + 3);
    changed[at] = changed[at] == '1' ? '2' : '1';
    std::ofstream(file, std::ios::binary) << changed;
    CHECK(names(city.check(), file.string() + ": /checksum: expected"));
    CHECK_THROWS_AS(city.sessions(), IoError);
    // Whoever removes the checksum cannot hide it.
    changed.erase(changed.rfind(',', changed.find("\"checksum\"")));
    std::ofstream(file, std::ios::binary) << changed << "\n}\n";
    CHECK(names(city.check(), file.string() + ": /checksum: expected"));
  }
  std::ofstream(file, std::ios::binary) << whole << std::string(1, '\0') << "more";
  CHECK(names(city.check(), file.string() + ": byte " + std::to_string(whole.size()) +
                                ": expected nothing behind the JSON"));
  std::ofstream(file, std::ios::binary) << whole;
  REQUIRE(city.check().empty());

  fs::rename(city.session_folder("monday"), folder.path() / "elsewhere");
  fs::create_directory_symlink(folder.path() / "elsewhere", city.session_folder("monday"));
  CHECK(city.sessions().empty());
  CHECK(names(city.check(), "monday: is a link, which is no session"));
  CHECK_THROWS_WITH(city.drop("monday"), ContainsSubstring("has no session \"monday\""));
}

TEST_CASE("a city: a session that is not committed changes nothing") {
  const test::TemporaryFolder folder;
  const City city = city_of(folder.path() / "city", {kDays[0]});
  const auto before = files_below(city.folder());
  SessionInfo info;
  info.name = "tuesday";
  {
    SessionWriter writer(city, info);
    const test::BoxScan scan = test::scan_boxes({}, 0.0, 0.0);
    writer.add(scan.points, scan.verdicts, scan.labels, scan.T_world_sensor, 0);
    CHECK(files_below(city.folder()) != before);
    CHECK(city.sessions().size() == 1);
    CHECK(city.check().empty());
    // Another writer leaves the folder of this one alone.
    add(city, kDays[2]);
    writer.add(scan.points, scan.verdicts, scan.labels, scan.T_world_sensor, 1);
  }
  City changed = city;
  changed.drop("wednesday");
  CHECK(files_below(city.folder()) == before);

  // As left by a killed process.
  const fs::path begun = city.folder().string() + "_begun";
  fs::create_directories(begun);
  std::ofstream(begun / ".city.json.0123456789abcdef.tmp") << "half";
  City::open_or_make(begun, city.grid());
  CHECK(files_below(begun).size() == 1);
  const fs::path stale = city.folder() / ".tuesday.0123456789abcdef.staging";
  fs::create_directories(stale / "tiles");
  std::ofstream(stale / "tiles" / "0_0.tile") << "half";
  std::ofstream(stale / "references.bin") << "half";
  const fs::path foreign = city.folder() / ".friday.0123456789abcdef.staging";
  fs::create_directories(foreign);
  std::ofstream(foreign / "notes.txt") << "mine";
  add(city, kDays[1]);
  CHECK_FALSE(fs::exists(stale));
  CHECK(fs::exists(foreign / "notes.txt"));
  CHECK(city.sessions().size() == 2);
}

TEST_CASE("references of a session: coded images are the images") {
  RecordingReferences recorder(RecordingReferencesConfig(), FreeSpaceConfig().lateral_margin);
  const test::BoxScan scan = test::scan_boxes({kParkedCar}, 0.0, 0.0);
  const RecordingReference* const reference =
      recorder.add(scan.points, scan.verdicts, scan.T_world_sensor, 0);
  REQUIRE(reference != nullptr);
  const RangeImageGrid& grid = recorder.grid();
  std::vector<std::uint8_t> bytes(most_packed_bytes(grid));
  const std::uint8_t* const end = pack_image(reference->image, bytes.data());
  bytes.resize(static_cast<std::size_t>(end - bytes.data()));
  CHECK(bytes.size() < grid.cell_count() * 2);
  RangeImage image;
  REQUIRE(unpack_image(grid, bytes, image));
  for (std::int32_t row = 0; row < grid.rows; ++row) {
    for (std::int32_t column = 0; column < grid.columns; ++column) {
      const std::size_t cell = grid.cell(row, column);
      REQUIRE(image[cell].nearest == reference->image[cell].nearest);
      REQUIRE(image[cell].around == reference->image[cell].around);
    }
  }
  bytes.push_back(0);
  CHECK_FALSE(unpack_image(grid, bytes, image));
  bytes.resize(bytes.size() / 2);
  CHECK_FALSE(unpack_image(grid, bytes, image));
  CHECK(recorder.add(scan.points, scan.verdicts, scan.T_world_sensor, 1) == nullptr);
}
