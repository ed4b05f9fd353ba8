#include "dynains/io/tiled_map.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "dynains/io/atomic_file.hpp"
#include "failure.hpp"
#include "input_file.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

constexpr double kVoxelOfAll = 0.2;  // m, edge of the voxels if every point is kept
constexpr int kSideBits = 8;         // bits of x and of y in the number of a voxel in its tile
constexpr int kHeightBits = 16;      // bits of z
const char* const kExtension = ".tile";

/// Header of the file of a tile, before its points.
struct TileHeader {
  char magic[8] = {'D', 'Y', 'N', 'A', 'T', 'I', 'L', 'E'};
  std::uint64_t version = 1;
  double map_voxel = 0.0;
  std::array<std::int64_t, 3> place = {};
};

/// X_Y_Z.tile
std::optional<std::array<std::int64_t, 3>> place_of(const fs::path& path) {
  if (path.extension() != kExtension) return std::nullopt;
  const std::string stem = path.stem().string();
  std::array<std::int64_t, 3> place = {};
  const char* at = stem.c_str();
  for (std::int64_t& number : place) {
    char* end = nullptr;
    errno = 0;
    number = std::strtoll(at, &end, 10);
    const char separator = &number == &place.back() ? '\0' : '_';
    if (end == at || *end != separator || errno != 0) return std::nullopt;
    at = end + 1;
  }
  return place;
}

/// Writes into an existing file. Throws IoError.
void write_at(const fs::path& path, std::size_t offset, const void* data, std::size_t size) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0) fail_by_system(path, "cannot be written", errno);
  const char* next = static_cast<const char*>(data);
  int error = 0;
  while (size > 0 && error == 0) {
    const ssize_t count = ::pwrite(descriptor, next, size, static_cast<off_t>(offset));
    if (count < 0) {
      error = errno == EINTR ? 0 : errno;
      continue;
    }
    next += count;
    offset += static_cast<std::size_t>(count);
    size -= static_cast<std::size_t>(count);
  }
  if (::close(descriptor) != 0 && error == 0) error = errno;
  if (error != 0) fail_by_system(path, "cannot be written to the end", error);
}

/// Creates `folder` if it is missing. Throws IoError.
const fs::path& made(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) fail_by_system(folder, "cannot be created", error.value());
  return folder;
}

}  // namespace

void TiledStaticMap::Config::validate() const {
  validate_parameters("TiledStaticMap", *this);
  if (map_voxel > 0.0 && map_voxel < 0.005) {
    throw ConfigError("TiledStaticMap.map_voxel = " + std::to_string(map_voxel) +
                      " must be 0 or at least 0.005 m");
  }
  if (map_folder.empty()) throw ConfigError("TiledStaticMap.map_folder must name a folder");
}

TiledStaticMap::TiledStaticMap(const Config& config)
    : config_((config.validate(), config)),
      lock_(made(config_.map_folder)),
      voxel_(config.map_voxel > 0.0 ? config.map_voxel : kVoxelOfAll) {
  const fs::path& folder = config_.map_folder;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const auto place = place_of(entry->path());
    if (!place) continue;
    stored_[*place] = count_stored(*place);
    size_ += stored_[*place];
  }
  if (error) fail_by_system(folder, "cannot be listed", error.value());
}

void TiledStaticMap::insert(PointsView points, Span<const std::uint8_t> keep,
                            const Pose& T_world_sensor) {
  const bool keep_all = config_.map_voxel == 0.0;
  Place last{};
  Tile* tile = nullptr;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!keep.empty() && keep[i] == 0) continue;
    const Eigen::Vector3d world =
        T_world_sensor * Eigen::Vector3f(points.x[i], points.y[i], points.z[i]).cast<double>();
    const Eigen::Array3d corner = (world.array() / voxel_).floor();
    const Eigen::Array<std::int64_t, 3, 1> voxel = corner.cast<std::int64_t>();
    // Arithmetic shifts are floor division.
    const Place place = {voxel.x() >> kSideBits, voxel.y() >> kSideBits, voxel.z() >> kHeightBits};
    if (tile == nullptr || place != last) tile = &tile_at(place);
    last = place;
    const auto number =
        static_cast<std::uint32_t>((voxel.x() & 0xFF) | (voxel.y() & 0xFF) << kSideBits |
                                   (voxel.z() & 0xFFFF) << (2 * kSideBits));
    if (!keep_all && !tile->fill(number)) continue;
    const Eigen::Vector3f local = (world.array() - corner * voxel_).matrix().cast<float>();
    tile->points.push_back({number, local.x(), local.y(), local.z()});
    ++size_;
  }
  write_new_points();
  free_far_tiles(T_world_sensor.translation());
}

void TiledStaticMap::clear() {
  for (auto tile = stored_.begin(); tile != stored_.end(); tile = stored_.erase(tile)) {
    const fs::path path = path_of(tile->first);
    std::error_code error;
    fs::remove(path, error);
    if (error) fail_by_system(path, "cannot be removed", error.value());
    const auto in_memory = tiles_.find(tile->first);
    size_ -= in_memory == tiles_.end() ? tile->second : in_memory->second.points.size();
    if (in_memory != tiles_.end()) tiles_.erase(in_memory);
  }
}

std::size_t TiledStaticMap::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& tile : tiles_) bytes += tile.second.memory_bytes();
  return bytes;
}

std::size_t TiledStaticMap::Tile::memory_bytes() const {
  return points.capacity() * sizeof(Point) + filled.memory_bytes();
}

/// False if the voxel has a point already; otherwise marks it as filled.
bool TiledStaticMap::Tile::fill(std::uint32_t voxel) {
  const std::size_t before = filled.size();
  filled.insert(voxel);
  return filled.size() > before;
}

fs::path TiledStaticMap::path_of(const Place& place) const {
  return config_.map_folder / (std::to_string(place[0]) + '_' + std::to_string(place[1]) + '_' +
                               std::to_string(place[2]) + kExtension);
}

Eigen::Vector3d TiledStaticMap::to_world(const Place& place, const Point& point) const {
  const std::array<std::uint32_t, 3> in_tile = {
      point.voxel & 0xFFU, point.voxel >> kSideBits & 0xFFU, point.voxel >> (2 * kSideBits)};
  const std::array<float, 3> local = {point.x, point.y, point.z};
  Eigen::Vector3d world;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t side = std::int64_t{1} << (axis < 2 ? kSideBits : kHeightBits);
    const std::int64_t voxel = place[axis] * side + in_tile[axis];
    world[static_cast<Eigen::Index>(axis)] =
        static_cast<double>(voxel) * voxel_ + static_cast<double>(local[axis]);
  }
  return world;
}

TiledStaticMap::Tile& TiledStaticMap::tile_at(const Place& place) {
  const auto found = tiles_.find(place);
  if (found != tiles_.end()) return found->second;
  Tile tile;
  tile.points = read(place, stored_[place]);
  if (config_.map_voxel > 0.0) {
    tile.filled.reserve(tile.points.size());
    for (const Point& point : tile.points) tile.filled.insert(point.voxel);
  }
  return tiles_.emplace(place, std::move(tile)).first->second;
}

/// Number of whole points in the file of a tile: a write may have been interrupted.
std::size_t TiledStaticMap::count_stored(const Place& place) const {
  const fs::path path = path_of(place);
  std::ifstream file = open_input(path);
  TileHeader header;
  file.read(reinterpret_cast<char*>(&header), sizeof(header));
  if (file.bad()) fail_to_read(file, path, 0, sizeof(header));
  const TileHeader ours;
  if (!file || std::memcmp(header.magic, ours.magic, sizeof(ours.magic)) != 0) {
    fail_at_byte(path, 0, "expected a tile of a static map");
  }
  if (header.version != ours.version) {
    fail_at_byte(path, 8,
                 "expected version " + std::to_string(ours.version) + " of a tile, got " +
                     std::to_string(header.version));
  }
  if (header.map_voxel != config_.map_voxel) {
    fail_at_byte(path, 16,
                 "expected a map with map_voxel = " + std::to_string(config_.map_voxel) + ", got " +
                     std::to_string(header.map_voxel));
  }
  if (header.place != place) fail_at_byte(path, 24, "expected the place that is in its name");
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) fail_by_system(path, "cannot be read", error.value());
  return (static_cast<std::size_t>(size) - sizeof(TileHeader)) / sizeof(Point);
}

std::vector<TiledStaticMap::Point> TiledStaticMap::read(const Place& place,
                                                        std::size_t count) const {
  std::vector<Point> points(count);
  if (count == 0) return points;
  const fs::path path = path_of(place);
  std::ifstream file = open_input(path);
  file.seekg(sizeof(TileHeader));
  const auto size = static_cast<std::streamsize>(count * sizeof(Point));
  file.read(reinterpret_cast<char*>(points.data()), size);
  if (file.gcount() != size) {
    const std::size_t end = sizeof(TileHeader) + count * sizeof(Point);
    fail_to_read(file, path, end - static_cast<std::size_t>(size - file.gcount()), end);
  }
  const auto outside = std::find_if(points.begin(), points.end(), [this](const Point& point) {
    const Eigen::Array3f share =
        Eigen::Array3f(point.x, point.y, point.z) / static_cast<float>(voxel_);
    return !((share > -0.01F).all() && (share < 1.01F).all());  // true for NaN, too
  });
  if (outside != points.end()) {
    const auto index = static_cast<std::size_t>(outside - points.begin());
    fail_at_byte(path, sizeof(TileHeader) + index * sizeof(Point), "expected a point in its voxel");
  }
  return points;
}

void TiledStaticMap::write_new_points() {
  for (const auto& [place, tile] : tiles_) {
    std::size_t& stored = stored_[place];
    if (stored == tile.points.size()) continue;
    const fs::path path = path_of(place);
    if (stored == 0) {
      TileHeader header;
      header.map_voxel = config_.map_voxel;
      header.place = place;
      AtomicFile file(path);
      file.stream().write(reinterpret_cast<const char*>(&header), sizeof(header));
      file.commit(AtomicFile::Sync::kLater);
    }
    write_at(path, sizeof(TileHeader) + stored * sizeof(Point), &tile.points[stored],
             (tile.points.size() - stored) * sizeof(Point));
    stored = tile.points.size();
  }
}

/// Frees the farthest tiles first. All points have been written before.
void TiledStaticMap::free_far_tiles(const Eigen::Vector3d& sensor) {
  const double budget = 1e6 * config_.map_memory;
  std::size_t bytes = memory_bytes();
  if (static_cast<double>(bytes) <= budget) return;
  const double side = voxel_ * (1 << kSideBits);
  std::vector<std::pair<double, Place>> by_distance;
  for (const auto& tile : tiles_) {
    const Place& place = tile.first;
    const Eigen::Vector2d centre(static_cast<double>(place[0]) + 0.5,
                                 static_cast<double>(place[1]) + 0.5);
    by_distance.emplace_back((side * centre - sensor.head<2>()).norm(), place);
  }
  std::sort(by_distance.begin(), by_distance.end());
  while (!by_distance.empty() && static_cast<double>(bytes) > budget) {
    const auto tile = tiles_.find(by_distance.back().second);
    bytes -= tile->second.memory_bytes();
    tiles_.erase(tile);
    by_distance.pop_back();
  }
}

}  // namespace dynains
