// A map of many sessions: order, repetition, removal, damage and failure.
#include "dynains/city/city.hpp"

#include "dynains/city/session_writer.hpp"
#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "reliability/tree.hpp"
#include "support/box_street.hpp"
#include "support/catch.hpp"
#include "support/visibility.hpp"

using namespace dynains;

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

void add(City& city, const Session& session, const std::vector<test::BoxScan>& scans) {
  SessionInfo info;
  info.name = session.name;
  info.begin = session.begin;
  info.fingerprint = session.name;
  SessionWriter writer(city, info);
  std::uint32_t number = 0;
  for (const test::BoxScan& scan : scans) {
    writer.add(scan.points, scan.verdicts, scan.labels, scan.T_world_sensor, number++);
  }
  writer.commit();
  city.reload();
}

void add(City& city, const Session& session) {
  add(city, session, test::drive_along(session.boxes, -5.0, 5.0));
}

City city_of(const fs::path& folder, const std::vector<Session>& sessions) {
  City city = City::open_or_make(folder, {});
  for (const Session& session : sessions) add(city, session);
  return city;
}

/// Calls visit(name of the session, point) for each point that stands after session `last`.
template <class Visit>
void for_each_point(const City& city, std::uint32_t last, const Visit& visit) {
  for (const TileIndex& tile : city.tiles()) {
    const TileHistory history = city.history(tile, last);
    history.for_each_standing(last, [&](std::size_t session, std::size_t i) {
      visit(city.sessions()[session].name, history.points(session)[i]);
    });
  }
}

/// Everything that the map tells, as bytes.
std::string map_bytes(const City& city) {
  std::string bytes;
  for_each_point(city, TileHistory::kNever, [&](const auto& name, const SessionPoint& point) {
    const float coordinates[] = {point.x, point.y, point.z};
    bytes += name;
    bytes.append(reinterpret_cast<const char*>(coordinates), sizeof(coordinates));
    bytes += std::to_string(point.scan) + ' ' + std::to_string(point.label) +
             (point.is_ground != 0 ? 'g' : 'o');
  });
  return bytes;
}

/// Number of points of the map by label.
std::map<std::uint32_t, std::size_t> label_counts(const City& city,
                                                  std::uint32_t last = TileHistory::kNever) {
  std::map<std::uint32_t, std::size_t> counts;
  for_each_point(city, last, [&](const auto&, const auto& point) { ++counts[point.label]; });
  return counts;
}

/// Number of points that came or left between two sessions, by label.
std::map<std::uint32_t, std::size_t> change_counts(
    const City& city, std::uint32_t before, std::uint32_t after,
    std::vector<CityPoint> CityChanges::*kind = &CityChanges::added) {
  std::map<std::uint32_t, std::size_t> counts;
  for (const TileIndex& tile : city.tiles()) {
    const CityChanges changes = city.changes(tile, before, after);
    for (const CityPoint& p : changes.*kind) ++counts[p.point.label];
  }
  return counts;
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
    City city = city_of(folder.path() / std::to_string(orders++),
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
  City city = city_of(folder.path() / "city", kDays);
  auto first = label_counts(city, 0);
  auto second = label_counts(city, 1);
  REQUIRE(first[kParked] > 100);
  CHECK(first[kContainer] == 0);
  CHECK(second[kContainer] > 100);
  CHECK(second[50] > first[50] * 99 / 100);
  CHECK(second[40] > first[40] * 99 / 100);

  for (const TileIndex& tile : city.tiles()) {
    const TileHistory history = city.history(tile, 1);
    for (std::size_t i = 0; i < history.points(0).size(); ++i) {
      const SessionPoint& point = history.points(0)[i];
      if (point.label != kParked) continue;
      CHECK_FALSE(history.stands(0, i, 1));
      CHECK(history.stands(0, i, 0));
      CHECK(history.removed_by(0, i) == 1);
    }
  }
}

TEST_CASE("a city: what a later session did not see stays, but an object leaves as a whole") {
  const double end = GENERATE(40.0, 5.5);  // of a wall that hides the car, or most of its place
  const test::TemporaryFolder folder;
  City city = city_of(folder.path() / "city", {kDays[0]});
  add(city, {"tuesday", 86400.0, {{{-40, 2.0, 0}, {end, 2.2, 5}, 50}}});
  auto before = label_counts(city, 0);
  REQUIRE(before[kParked] > 100);
  CHECK(label_counts(city, 1)[kParked] == (end < 40.0 ? 0 : before[kParked]));
}

TEST_CASE("a city: what a run missed does not come in where earlier sessions saw free space") {
  const test::TemporaryFolder folder;
  // A car drives ahead, and the run of tuesday does not see that it moves.
  std::vector<test::BoxScan> scans;
  for (const double x : {0.0, 1.0}) {
    const double rear = 3.0 + 6.0 * x;
    scans.push_back(test::scan_boxes({{{rear, 3, 0}, {rear + 4, 5, 1.5}, kParked}}, x, 0.0));
  }
  City without = city_of(folder.path() / "without", {});
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
  City city = city_of(folder.path() / "city", {kDays[0]});
  // All beams through the place of the car end behind it, at points with a dynamic verdict.
  std::vector<test::BoxScan> scans =
      test::drive_along({{{-20, 3.4, 0}, {30, 6, 4}, kContainer}}, -5.0, 5.0);
  City seen_through = city_of(folder.path() / "seen_through", {kDays[0]});
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

TEST_CASE("a city: changes are objects that came or left") {
  const test::TemporaryFolder folder;
  City city = city_of(folder.path() / "city", kDays);
  auto removed = change_counts(city, 0, 1, &CityChanges::removed);
  CHECK(removed.size() == 1);
  CHECK(removed[kParked] > 100);
  auto added = change_counts(city, 0, 2);
  CHECK(added.size() == 1);
  CHECK(added[kContainer] > 100);
  CHECK(change_counts(city, 1, 2).empty());
  CHECK(change_counts(city, 1, 2, &CityChanges::removed).empty());
  CHECK_THROWS_AS(city.changes(city.tiles().front(), 1, 1), ConfigError);
}

TEST_CASE("a city: an object has come if a session before its own saw its place empty") {
  // On monday, a wall hides the place of the container.
  const test::StreetBox wall = {{-40, -3.2, 0}, {40, -3.0, 5}, 50};
  const bool is_seen_on_tuesday = GENERATE(false, true);
  CAPTURE(is_seen_on_tuesday);
  const std::vector<test::StreetBox> tuesday =
      is_seen_on_tuesday ? std::vector<test::StreetBox>() : std::vector{wall};
  const test::TemporaryFolder folder;
  City city = city_of(folder.path() / "city",
                      {{"monday", 0.0, {wall}}, {"tuesday", 86400.0, tuesday}, kDays[2]});
  const std::size_t added = change_counts(city, 0, 2)[kContainer];
  CHECK(label_counts(city)[kContainer] > 100);
  CHECK((added > 100) == is_seen_on_tuesday);
  CHECK((added == 0) != is_seen_on_tuesday);
}

TEST_CASE("a city: clusters that are small, parts of others or seen too briefly are no changes") {
  const SessionGrid grid;
  // A wall of points 0.2 m apart, 2 m long, that comes on the second of two days. References of
  // the first day pass through its place, `hits` ones of the second day hit it, after `passes`.
  const auto added = [&](float height, int hits, int passes,
                         const std::vector<SessionPoint>& beside) {
    std::vector<SessionPoint> wall = beside;
    for (int column = 0; column < 10; ++column) {
      const float x = 5.1F + 0.2F * static_cast<float>(column);
      for (float z = 0.1F; z < height; z += 0.2F) wall.push_back({x, 5.1F, z, 0, 7, 0});
    }
    TileHistory history(grid);
    history.add_session(beside);
    history.add_session(std::move(wall));
    const auto revise = [&](int count, test::BeamResult result) {
      const Eigen::Vector3d sensor(5.0, 0.0, 1.0);
      detail::Visibility visibility;
      for (int i = 0; i < count; ++i) {
        history.revise(
            sensor,
            [&](const PointBuffer& points, std::size_t size,
                const Eigen::Vector3d& origin) -> const auto& {
              const auto beam = [&](const Eigen::Vector3d& p) {
                return p.y() < 5.2 ? result : test::BeamResult::kUnknown;
              };
              return visibility = test::visibility_by(beam, points, size, origin);
            });
      }
    };
    revise(4, test::BeamResult::kFree);
    history.end_session();
    revise(passes, test::BeamResult::kFree);
    revise(hits, test::BeamResult::kHit);
    history.end_session();
    return find_changes(grid, history, 0, 1).added.size();
  };
  CHECK(added(1.6F, 5, 0, {}) == 80);
  CHECK(added(0.4F, 5, 0, {}) == 0);  // lower than 0.4 m
  CHECK(added(1.6F, 2, 0, {}) == 0);
  CHECK(added(1.6F, 9, 4, {}) == 0);  // beams of its own session passed through its place
  std::vector<SessionPoint> corner, bush;
  for (int column = 0; column < 10; ++column) {
    for (float z = 0.1F; z < 1.6F; z += 0.2F) {
      bush.push_back({5.1F + 0.2F * static_cast<float>(column), 5.5F, z, 0, 8, 0});
      if (column < 2) corner.push_back(bush.back());
    }
  }
  CHECK(added(1.6F, 5, 0, corner) == 80);
  CHECK(added(1.6F, 5, 0, bush) == 0);
}

TEST_CASE("a city: points beyond the contribution range do not come in") {
  const test::TemporaryFolder folder;
  test::BoxScan scan = test::scan_boxes({}, 0.0, 0.0);
  for (float& x : scan.points.x) x *= 2.0F;
  City city = city_of(folder.path() / "city", {});
  add(city, kDays[0], {scan});
  const SessionInfo session = city.sessions().at(0);
  CHECK(session.points > 1000);
  CHECK(session.highest.head<2>().cwiseAbs().maxCoeff() <= 60.0);
  CHECK(session.lowest.head<2>().cwiseAbs().maxCoeff() > 45.0);
}

TEST_CASE("a city: the file of a session has the points of the session, tile by tile") {
  const test::TemporaryFolder folder;
  SessionGrid grid;
  grid.tile = 10.0;
  City city = City::open_or_make(folder.path() / "city", grid);
  const test::BoxScan scan = test::scan_boxes({kParkedCar}, 0.0, 0.0);
  SessionInfo info;
  info.name = "monday";
  SessionWriter writer(city, info);
  ByteStore store(std::filesystem::temp_directory_path());
  SessionPoints all(grid, kTestRange, store);
  // Away, back, and over the same places again, at other heights within their voxels.
  for (std::uint32_t number = 0; number < 60; ++number) {
    const double way = 8.0 * (number < 40 ? number : 80 - number);
    Eigen::Isometry3d T_world_sensor = scan.T_world_sensor;
    T_world_sensor.translation() += Eigen::Vector3d(way, 0.3 * way, 0.01 * number);
    writer.add(scan.points, scan.verdicts, scan.labels, T_world_sensor, number);
    all.add(scan.points, scan.verdicts, scan.labels, T_world_sensor, number);
  }
  writer.commit();
  city.reload();
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
  CHECK_FALSE(fs::exists(with.session_file("tuesday")));
  for (const auto& entry : fs::directory_iterator(with.folder())) {
    CHECK(entry.path().filename().string().front() != '.');
  }
  CHECK_THROWS_AS(with.drop("tuesday"), IoError);
  CHECK_THROWS_AS(with.drop("../with"), IoError);
}

TEST_CASE("a city: another grid or version and a name that leads out are refused") {
  const test::TemporaryFolder folder;
  City city = city_of(folder.path() / "city", {kDays[0]});
  SessionGrid coarse;
  coarse.map_voxel = 0.3;
  CHECK_THROWS_WITH(City::open_or_make(city.folder(), coarse),
                    ContainsSubstring("map_voxel = 0.2 m") && ContainsSubstring("0.3"));
  std::ofstream(folder.path() / "old.session") << "DYNSESS1 and more";
  fs::create_directory(folder.path() / "older");
  fs::rename(folder.path() / "old.session", folder.path() / "older" / "monday.session");
  CHECK_THROWS_WITH(City(folder.path() / "older"), ContainsSubstring("expected \"DYNSESS5\""));

  fs::create_directory(folder.path() / "other");
  std::ofstream(folder.path() / "other" / "holiday.txt") << "mine";
  CHECK_THROWS_AS(City::open_or_make(folder.path() / "other", {}), IoError);
  CHECK_THROWS_AS(City(folder.path() / "nothing"), IoError);
  SessionInfo outside;
  outside.name = "../monday";
  CHECK_THROWS_AS(SessionWriter(city, outside), ConfigError);
}

TEST_CASE("a city: every damage is named by path and position") {
  const test::TemporaryFolder folder;
  City city = city_of(folder.path() / "city", {kDays[0]});
  REQUIRE(city.check().empty());
  const SessionInfo session = city.sessions().at(0);
  const fs::path file = city.session_file("monday");
  const auto size = static_cast<std::streamoff>(fs::file_size(file));
  const SessionBlock tile = session.tiles.begin()->second;
  const SessionBlock image = session.references.at(1).block;
  for (const std::uint64_t at :
       {std::uint64_t{0}, tile.offset, tile.offset + 60, tile.offset + tile.size + 3,
        image.offset + 20, image.offset + 200, image.offset + image.size}) {
    CAPTURE(at);
    change_byte(file, static_cast<std::streamoff>(at));
    const auto defects = city.check();
    REQUIRE(defects.size() == 1);
    CHECK(names(defects, file.string() + ": byte "));
    change_byte(file, static_cast<std::streamoff>(at));
  }
  // All that tells of the session is at the end.
  for (const std::streamoff at : {size - 1, size - 9, size - 16, size - 17, size - 300}) {
    CAPTURE(at);
    change_byte(file, at);
    CHECK(names(city.check(), file.string() + ": byte "));
    CHECK_THROWS_AS(city.reload(), IoError);
    change_byte(file, at);
  }
  REQUIRE(city.check().empty());
  fs::copy_file(file, folder.path() / "whole");
  for (const std::streamoff left : {size - 1, size / 2, std::streamoff{20}, std::streamoff{4}}) {
    fs::resize_file(file, static_cast<std::uintmax_t>(left));
    CHECK(names(city.check(), file.string()));
    fs::copy_file(folder.path() / "whole", file, fs::copy_options::overwrite_existing);
  }
  REQUIRE(city.check().empty());

  // A link is no session.
  fs::rename(file, folder.path() / "elsewhere");
  fs::create_symlink(folder.path() / "elsewhere", file);
  city.reload();
  CHECK(city.sessions().empty());
  CHECK_THROWS_WITH(city.drop("monday"), ContainsSubstring("has no session \"monday\""));
}

TEST_CASE("a city: a session that is not committed changes nothing") {
  const test::TemporaryFolder folder;
  City city = city_of(folder.path() / "city", {kDays[0]});
  const auto before = test::read_tree(city.folder());
  SessionInfo info;
  info.name = "tuesday";
  const test::BoxScan scan = test::scan_boxes({}, 0.0, 0.0);
  {
    SessionWriter writer(city, info);
    writer.add(scan.points, scan.verdicts, scan.labels, scan.T_world_sensor, 0);
    // Another writer changes nothing for this one.
    add(city, kDays[2]);
    writer.add(scan.points, scan.verdicts, scan.labels, scan.T_world_sensor, 1);
    writer.prepare();
    CHECK(city.sessions().size() == 2);
    CHECK(city.check().empty());
  }
  City changed = city;
  changed.drop("wednesday");
  CHECK(test::read_tree(city.folder()) == before);

  // As left by a killed process.
  const fs::path stale = city.folder() / ".tuesday.session.0123456789abcdef.tmp";
  std::ofstream(stale) << "half";
  const fs::path foreign = city.folder() / ".friday.0123456789abcdef.tmp";
  std::ofstream(foreign) << "mine";
  add(city, kDays[1]);
  CHECK_FALSE(fs::exists(stale));
  CHECK(fs::exists(foreign));
  CHECK(city.sessions().size() == 2);
}

TEST_CASE("references of a session: coded images are the images") {
  RecordingReferences recorder(10, FreeSpaceConfig().lateral_margin);
  const test::BoxScan scan = test::scan_boxes({kParkedCar}, 0.0, 0.0);
  const RecordingReference* const reference =
      recorder.add(scan.points, scan.verdicts, scan.T_world_sensor, 0);
  REQUIRE(reference != nullptr);
  const RangeImageGrid& grid = recorder.grid();
  std::vector<std::uint8_t> bytes;
  pack_image(reference->image, bytes);
  CHECK(bytes.size() < grid.cell_count() * 3);
  RangeImage image;
  REQUIRE(unpack_image(grid, bytes, image));
  for (std::int32_t row = 0; row < grid.rows; ++row) {
    for (std::int32_t column = 0; column < grid.columns; ++column) {
      const std::size_t cell = grid.cell(row, column);
      REQUIRE(image[cell].nearest == reference->image[cell].nearest);
      REQUIRE(image[cell].around == reference->image[cell].around);
      REQUIRE(image.beams()[cell] == reference->image.beams()[cell]);
    }
  }
  bytes.push_back(0);
  CHECK_FALSE(unpack_image(grid, bytes, image));
  bytes.resize(bytes.size() / 2);
  CHECK_FALSE(unpack_image(grid, bytes, image));
  CHECK(recorder.add(scan.points, scan.verdicts, scan.T_world_sensor, 1) == nullptr);
}
