#include "dynains/io/tiled_map.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <string>
#include <utility>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/errors.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"
#include "support/own_stages.hpp"
#include "support/random.hpp"
#include "support/runs.hpp"
#include "support/scene.hpp"

using namespace dynains;
using namespace dynains::test;
namespace fs = std::filesystem;

namespace {

TiledStaticMap::Config config_of(const fs::path& folder, double megabytes, double voxel = 0.25) {
  TiledStaticMap::Config config;
  config.map_voxel = voxel;
  config.map_memory = megabytes;
  config.map_folder = folder;
  return config;
}

struct MapScan {
  PointBuffer points;
  std::vector<std::uint8_t> keep;
  Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
};

/// A closed loop of 300 m around `centre`. All coordinates are multiples of 1/64 m, so that floats
/// and doubles need no rounding.
std::vector<MapScan> loop(const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  std::vector<MapScan> scans;
  Random random(11);
  for (int i = 0; i <= 24; ++i) {
    const double angle = 2.0 * M_PI * (i % 24) / 24.0;
    MapScan scan;
    scan.T_world_sensor.translation() =
        centre + Eigen::Vector3d(std::round(48.0 * std::cos(angle)),
                                 std::round(48.0 * std::sin(angle)), 1.5);
    for (int k = 0; k < 3000; ++k) {
      for (std::vector<float>* axis : {&scan.points.x, &scan.points.y, &scan.points.z}) {
        const double reach = axis == &scan.points.z ? 4.0 : 40.0;
        axis->push_back(
            static_cast<float>(std::round(64.0 * random.uniform(-reach, reach)) / 64.0));
      }
      scan.keep.push_back(k % 5 == 0 ? 0 : 1);
    }
    scans.push_back(scan);
  }
  return scans;
}

using Points = std::vector<std::array<double, 3>>;

template <class Map>
Points points_of(const Map& map) {
  Points points;
  map.for_each([&](const Eigen::Vector3d& p) { points.push_back({p.x(), p.y(), p.z()}); });
  REQUIRE(points.size() == map.size());
  return points;
}

Points sorted(Points points) {
  std::sort(points.begin(), points.end());
  return points;
}

void insert(TiledStaticMap& map, const MapScan& scan) {
  map.insert(scan.points, scan.keep, scan.T_world_sensor);
}

fs::path any_tile(const fs::path& folder) {
  std::vector<fs::path> tiles;
  for (const auto& entry : fs::directory_iterator(folder)) tiles.push_back(entry.path());
  return *std::max_element(tiles.begin(), tiles.end(), [](const fs::path& a, const fs::path& b) {
    return fs::file_size(a) < fs::file_size(b);
  });
}

/// Bounds the size of every file that is written, like a disk that becomes full during a write.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

}  // namespace

TEST_CASE("a map in tiles holds the points of the map in memory, for any memory budget") {
  const Eigen::Vector3d centre =
      GENERATE(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(691200, 5334016, -70));
  const double voxel = GENERATE(0.25, 0.0);
  const std::vector<MapScan> scans = loop(centre);
  StaticMapAccumulator::Config in_memory;
  in_memory.map_voxel = voxel;
  StaticMapAccumulator expected(in_memory);
  for (const MapScan& scan : scans) {
    expected.insert(scan.points, scan.keep, scan.T_world_sensor);
  }
  Points whole;
  for (const double megabytes : {1000.0, 0.3, 0.0}) {
    const TemporaryFolder folder;
    TiledStaticMap map(config_of(folder / "map", megabytes, voxel));
    std::size_t most = 0;
    for (const MapScan& scan : scans) {
      insert(map, scan);
      most = std::max(most, map.memory_bytes());
    }
    CHECK(static_cast<double>(most) <= megabytes * 1e6);
    const Points points = points_of(map);
    CHECK(points.size() == expected.size());
    // Corners of voxels of 0.25 m need no rounding, those of 0.2 m do.
    if (voxel > 0.0) CHECK((sorted(points) == sorted(points_of(expected))));
    if (whole.empty()) whole = points;
    CHECK((points == whole));
  }
  CHECK(whole.size() > 20000);
}

TEST_CASE("an empty list of flags keeps all points; clear removes them and their files") {
  const TemporaryFolder folder;
  TiledStaticMap map(config_of(folder / "map", 0.1));
  CHECK(map.empty());
  const MapScan scan = loop()[0];
  map.insert(scan.points, {}, scan.T_world_sensor);
  const std::size_t all = map.size();
  CHECK(count_entries(folder / "map") > 1);
  write_text(folder / "map/notes.txt", "of the user");
  map.clear();
  CHECK(map.empty());
  CHECK(map.memory_bytes() == 0);
  CHECK(points_of(map).empty());
  CHECK(count_entries(folder / "map") == 1);
  insert(map, scan);
  CHECK(map.size() > all / 2);
  CHECK(map.size() < all);
}

TEST_CASE("an existing map is continued after an interrupted write, for any bytes at its end") {
  const TemporaryFolder folder;
  const std::vector<MapScan> scans = loop();
  Points before;
  {
    TiledStaticMap map(config_of(folder.path(), 100));
    for (std::size_t i = 0; i < 12; ++i) insert(map, scans[i]);
    before = points_of(map);
  }
  write_text(any_tile(folder.path()), read_text(any_tile(folder.path())) + "1234567");
  write_text(folder / ".0_0_0.tile.17.tmp", "of a killed process");
  TiledStaticMap map(config_of(folder.path(), 0.2));
  CHECK(map.memory_bytes() == 0);
  CHECK((points_of(map) == before));
  for (std::size_t i = 0; i < 12; ++i) insert(map, scans[i]);
  CHECK((points_of(map) == before));
  for (std::size_t i = 12; i < scans.size(); ++i) insert(map, scans[i]);

  const TemporaryFolder other;
  TiledStaticMap undisturbed(config_of(other.path(), 100));
  for (const MapScan& scan : scans) insert(undisturbed, scan);
  CHECK((points_of(map) == points_of(undisturbed)));
}

TEST_CASE("kill -9 at any moment leaves every inserted scan in the files") {
  const std::vector<MapScan> scans = loop();
  Random random(3);
  std::size_t interrupted = 0;
  for (int kill_number = 0; kill_number < 12; ++kill_number) {
    const TemporaryFolder folder;
    int done[2];
    REQUIRE(::pipe(done) == 0);
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      TiledStaticMap map(config_of(folder.path(), 0.1));
      for (const MapScan& scan : scans) {
        insert(map, scan);
        if (::write(done[1], "+", 1) != 1) break;
      }
      ::_exit(0);
    }
    ::close(done[1]);
    // Killed during a scan after a random one, independently of the speed of the machine.
    const std::size_t before = random.index(scans.size() / 2);
    std::size_t inserted = 0;
    char byte = 0;
    while (inserted < before && ::read(done[0], &byte, 1) == 1) ++inserted;
    ::usleep(static_cast<useconds_t>(random.index(1000)));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    while (::read(done[0], &byte, 1) == 1) ++inserted;
    ::close(done[0]);
    if (inserted > 0 && inserted < scans.size()) ++interrupted;

    const TiledStaticMap found(config_of(folder.path(), 0));
    const Points points = sorted(points_of(found));
    // The map has at least the scans that were inserted for certain, and at most the next scan,
    // too.
    StaticMapAccumulator::Config in_memory;
    in_memory.map_voxel = 0.25;
    StaticMapAccumulator expected(in_memory);
    for (std::size_t i = 0; i < inserted; ++i) {
      expected.insert(scans[i].points, scans[i].keep, scans[i].T_world_sensor);
    }
    const Points least = sorted(points_of(expected));
    CHECK(std::includes(points.begin(), points.end(), least.begin(), least.end()));
    if (inserted < scans.size()) {
      const MapScan& scan = scans[inserted];
      expected.insert(scan.points, scan.keep, scan.T_world_sensor);
    }
    const Points most = sorted(points_of(expected));
    CHECK(std::includes(most.begin(), most.end(), points.begin(), points.end()));
  }
  CHECK(interrupted > 0);
}

TEST_CASE("points that cannot be written stay in memory until they can") {
  const TemporaryFolder folder;
  const std::vector<MapScan> scans = loop();
  TiledStaticMap map(config_of(folder.path(), 0));
  std::size_t failed = 0;
  std::string message;
  {
    const FileSizeLimit limit(20001);
    for (const MapScan& scan : scans) {
      try {
        insert(map, scan);
      } catch (const IoError& error) {
        ++failed;
        message = error.what();
      }
    }
  }
  CHECK(failed > 5);
  CHECK_THAT(message, StartsWith(folder.path().string() + "/"));
  CHECK_THAT(message, ContainsSubstring(".tile: cannot be written to the end: File too large"));
  CHECK(map.memory_bytes() > 0);
  insert(map, scans.back());
  CHECK(map.memory_bytes() == 0);

  const TemporaryFolder other;
  TiledStaticMap undisturbed(config_of(other.path(), 100));
  for (const MapScan& scan : scans) insert(undisturbed, scan);
  CHECK((points_of(map) == points_of(undisturbed)));
}

TEST_CASE("a folder or a tile that cannot be used is an error with its path") {
  const TemporaryFolder folder;
  const auto error = [](const TiledStaticMap::Config& config) {
    return message_of<IoError>([&] { points_of(TiledStaticMap(config)); });
  };
  write_text(folder / "file", "");
  CHECK_THAT(error(config_of(folder / "file", 1)), StartsWith((folder / "file").string() + ": "));

  const fs::path map_folder = folder / "map";
  {
    TiledStaticMap map(config_of(map_folder, 1));
    insert(map, loop()[0]);
  }
  const fs::path tile = any_tile(map_folder);
  const std::string good = read_text(tile);
  CHECK_THAT(error(config_of(map_folder, 1, 0.5)),
             ContainsSubstring("byte 16: expected a map with map_voxel = 0.5"));
  const auto damaged = [&](const std::string& bytes) {
    write_text(tile, bytes);
    return error(config_of(map_folder, 1));
  };
  CHECK(damaged("") == tile.string() + ": byte 0: expected a tile of a static map");
  CHECK_THAT(damaged("PLY" + good.substr(3)), ContainsSubstring("expected a tile"));
  CHECK_THAT(damaged(good.substr(0, 8) + '\2' + good.substr(9)),
             ContainsSubstring("byte 8: expected version 1 of a tile, got 2"));
  CHECK_THAT(damaged(good.substr(0, 24) + '\7' + good.substr(25)), ContainsSubstring("byte 24"));
  CHECK_THAT(damaged(good.substr(0, 70) + "\x7F\x7F" + good.substr(72)),
             ContainsSubstring("byte 64: expected a point in its voxel"));
  write_text(tile, good);
  TiledStaticMap map(config_of(map_folder, 1));
  fs::remove(tile);
  CHECK_THAT(message_of<IoError>([&] { points_of(map); }),
             StartsWith(tile.string() + ": cannot be read: "));
}

TEST_CASE("a folder of tiles belongs to one map at a time, also after the map was moved") {
  const TemporaryFolder folder;
  const MapScan scan = loop()[0];
  const auto refusal = [&] {
    return message_of<UsageError>([&] { TiledStaticMap(config_of(folder / "map", 1)); });
  };
  std::size_t size = 0;
  {
    TiledStaticMap map(config_of(folder / "map", 1));
    CHECK_THAT(refusal(), StartsWith((folder / "map").string() + ": is in use"));
    TiledStaticMap moved = std::move(map);
    CHECK_THAT(refusal(), ContainsSubstring("is in use"));
    insert(moved, scan);
    size = moved.size();
  }
  CHECK(TiledStaticMap(config_of(folder / "map", 1)).size() == size);
  CHECK(size > 0);
}

TEST_CASE("the configuration of a map in tiles is checked") {
  CHECK_THROWS_WITH(TiledStaticMap(config_of("", 1)),
                    "TiledStaticMap.map_folder must name a folder");
  CHECK_THROWS_WITH(TiledStaticMap(config_of("unused", 1, 0.001)),
                    StartsWith("TiledStaticMap.map_voxel"));
  CHECK_THROWS_WITH(TiledStaticMap(config_of("unused", -1)),
                    StartsWith("TiledStaticMap.map_memory"));
  CHECK(!fs::exists("unused"));
}

namespace {

struct OnDisk : DefaultStages {
  using Map = TiledStaticMap;
};
using DiskRemover = BasicDynaInsRemover<OnDisk>;

}  // namespace

TEST_CASE("a remover keeps its map in tiles, and continues after a full disk") {
  const std::vector<Scan> scans = drive(yard(), 6, 10.0);
  const TemporaryFolder folder;
  DiskRemover::Config config = DiskRemover::Config::paper();
  config.map = config_of(folder / "whole", 0, 0.2);
  DiskRemover remover(config);
  const Run whole = run(remover, scans);
  DynaInsRemover in_memory(DynaInsRemover::Config::paper());
  const Run expected = run(in_memory, scans);
  CHECK((whole.final == expected.final));
  // At the border of two voxels, floats and doubles may round to different voxels.
  const auto size = static_cast<double>(in_memory.map().size());
  CHECK(std::abs(static_cast<double>(remover.map().size()) - size) < 1e-3 * size);

  config.map = config_of(folder / "broken", 0, 0.2);
  DiskRemover broken(config);
  std::size_t final = 0;
  std::size_t failed = 0;
  const auto push = [&](const Scan& scan) {
    try {
      const FrameResult frame = broken.push(scan.points, scan.T_world_sensor, scan.time);
      if (frame.finished) final += 1;
    } catch (const IoError&) {
      ++failed;
    }
  };
  {
    const FileSizeLimit limit(1000);
    for (std::size_t i = 0; i + 1 < scans.size(); ++i) push(scans[i]);
  }
  CHECK(failed > 0);
  push(scans.back());
  broken.flush([&](const ScanVerdict& verdict) {
    CHECK((verdict.labels.size() == scans[verdict.scan].points.size()));
    ++final;
  });
  // If the points of a scan cannot be written, only the verdict of this scan is lost.
  CHECK(final + failed == scans.size());
  CHECK((points_of(broken.map()) == points_of(remover.map())));
}
