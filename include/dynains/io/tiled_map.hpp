// Static map in files. Only tiles near the sensor are in memory.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "dynains/io/folder_lock.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Static map (Eq. 1) in a folder of files, with a memory budget for its tiles.
///
/// As in StaticMapAccumulator, the first inserted point of a voxel is kept. A tile has 256 x 256
/// voxels and one file. `insert` appends new points to the files, so the files contain the whole
/// map after each `insert`. If a process is killed during an `insert`, some points of that `insert`
/// are lost, but no earlier points. The tiles farthest from the sensor are freed first, and read
/// again when a point falls into them. The map does not depend on the budget.
///
/// A folder can be open in one map at a time, in all processes of this machine.
///
/// Use as `Stages::Map`:
///
///     struct Stages : dynains::DefaultStages { using Map = dynains::TiledStaticMap; };
///     dynains::BasicDynaInsRemover<Stages>::Config config;
///     config.map.map_folder = "map";
///
/// `sync_files(folder)` synchronizes the files with the disk.
class TiledStaticMap {
 public:
  struct Config {
    double map_voxel = 0.2;   ///< m, edge of a voxel; 0 keeps every point
    double map_memory = 256;  ///< MB, budget of the tiles in memory between two inserts
    /// Folder of the tiles; created if missing. New points are added to an existing map.
    std::filesystem::path map_folder;

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"map_voxel", self.map_voxel, closed(0, 10), "m",
                        "resolution of the static map, one measured point per voxel; 0 keeps all"});
      visitor(Parameter{"map_memory", self.map_memory, closed(0, 1e6), "MB",
                        "memory budget of the static map; the farthest tiles are only on disk"});
    }

    /// Throws ConfigError.
    void validate() const;
  };

  /// Throws ConfigError; UsageError if the folder is open in another map; IoError if the folder is
  /// not accessible or contains a map with another voxel size.
  explicit TiledStaticMap(const Config& config);

  const Config& config() const { return config_; }

  /// Adds the points of one scan (m, sensor frame) whose `keep` flag is not zero. `keep`: by point;
  /// empty for all points. Throws IoError if a tile cannot be read or written. Points that were not
  /// written stay in memory, beyond the budget if necessary, and the next `insert` writes them.
  void insert(PointsView points, Span<const std::uint8_t> keep, const Pose& T_world_sensor);

  /// Number of points.
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  /// Removes all points and their files. Throws IoError.
  void clear();

  /// Memory of the loaded tiles, bytes.
  std::size_t memory_bytes() const;

  /// Calls `visit(Eigen::Vector3d)` for each point (m, world frame), tile by tile in the order of
  /// tile indices. Requires the memory of one additional tile. Throws IoError.
  template <class Visitor>
  void for_each(Visitor&& visit) const {
    for (const auto& [place, stored] : stored_) {
      const auto found = tiles_.find(place);
      if (found != tiles_.end()) {
        for (const Point& point : found->second.points) visit(to_world(place, point));
      } else {
        for (const Point& point : read(place, stored)) visit(to_world(place, point));
      }
    }
  }

 private:
  using Place = std::array<std::int64_t, 3>;  // index of a tile in the world

  struct Point {
    std::uint32_t voxel;  // in the tile: x, y in 8 bits each, z in 16
    float x, y, z;        // m, relative to the corner of the voxel
  };

  // Points in the order of insertion, and the set of their voxels.
  struct Tile {
    std::vector<Point> points;
    VoxelHashTable<std::uint32_t> filled;  // Point::voxel of each point; empty for map_voxel 0

    std::size_t memory_bytes() const;
    bool fill(std::uint32_t voxel);
  };

  std::filesystem::path path_of(const Place& place) const;
  Eigen::Vector3d to_world(const Place& place, const Point& point) const;
  Tile& tile_at(const Place& place);
  std::vector<Point> read(const Place& place, std::size_t count) const;
  std::size_t count_stored(const Place& place) const;
  void write_new_points();
  void free_far_tiles(const Eigen::Vector3d& sensor);

  Config config_;
  FolderLock lock_;
  double voxel_;  // m, edge of the voxels of a tile
  std::size_t size_ = 0;
  std::map<Place, std::size_t> stored_;  // number of points in the file of each tile
  std::map<Place, Tile> tiles_;          // tiles in memory
};

}  // namespace dynains
