// Static map in files, of which only tiles near the sensor are in memory.
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
#include "dynains/stage/voxel_hash_table.hpp"

namespace dynains {

/// Static map (Eq. 1) in a folder of files. The tiles in memory stay within a budget.
///
/// As in StaticMapAccumulator, the first measured point of a voxel stays. A tile has 256 x 256
/// voxels and a file of its own, to which `insert` appends new points. So the files hold the whole
/// map after every `insert`. A process that is killed during an `insert` loses some of its points,
/// no earlier ones. Tiles that are farthest from the sensor leave the memory first, and are read
/// again when a point falls into them. The result does not depend on the budget.
///
/// Only one map at a time can have a folder, in all processes.
///
/// Replaces the map in memory as `Stages::Map`:
///
///     struct Stages : dynains::DefaultStages { using Map = dynains::TiledStaticMap; };
///     dynains::BasicDynaInsRemover<Stages>::Config config;
///     config.map.map_folder = "map";
///
/// To make the files survive a power cut, call `sync_files(folder)`.
class TiledStaticMap {
 public:
  struct Config {
    double map_voxel = 0.2;   ///< m, edge of a voxel; 0 keeps every point
    double map_memory = 256;  ///< MB, budget of the tiles in memory between two inserts
    /// Folder of the tiles; created if missing. A map in it is continued.
    std::filesystem::path map_folder;

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"map_voxel", self.map_voxel, closed(0, 10), "m",
                        "resolution of the static map, one measured point per voxel; 0 keeps all"});
      visitor(Parameter{"map_memory", self.map_memory, closed(0, 1e6), "MB",
                        "memory that the static map may take; what is farthest goes to the disk"});
    }

    /// Throws ConfigError.
    void validate() const;
  };

  /// Throws ConfigError; UsageError while another map has the folder; IoError if the folder cannot
  /// be used or holds a map with another voxel size.
  explicit TiledStaticMap(const Config& config);

  const Config& config() const { return config_; }

  /// Adds the points of one scan (metres, sensor frame) whose `keep` flag is not zero; an empty
  /// `keep` adds all. Throws IoError if a tile cannot be read or written. Points that could not be
  /// written stay in memory, beyond the budget if necessary, and the next `insert` writes them.
  void insert(PointsView points, Span<const std::uint8_t> keep,
              const Eigen::Isometry3d& T_world_sensor);

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  /// Removes all points and their files. Throws IoError.
  void clear();

  /// Bytes of the tiles in memory.
  std::size_t memory_bytes() const;

  /// Calls `visit(Eigen::Vector3d)` for every point (world frame, m), tile by tile, ordered by
  /// their indices. Needs the memory of one more tile. Throws IoError.
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

  // Points in the order of insertion, and a hash table of their voxels.
  struct Tile {
    std::vector<Point> points;
    VoxelHashTable<std::uint32_t> filled;  // Point::voxel of each; empty if every point is kept

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
  double voxel_;  // m, edge of the voxels that tiles count in
  std::size_t size_ = 0;
  std::map<Place, std::size_t> stored_;  // number of points in the file of each tile
  std::map<Place, Tile> tiles_;          // tiles in memory
};

}  // namespace dynains
