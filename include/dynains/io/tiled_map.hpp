// The static map of a drive of any length: all of it on the disk, in memory what is near.
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
#include "dynains/voxel/voxel_hash_table.hpp"

namespace dynains {

/// Static map (Eq. 1) in a folder of files, of which no more than a budget stays in memory.
///
/// As in StaticMapAccumulator, the first measured point of a voxel stays. A tile is a square of 256
/// voxels and a file, to which `insert` appends what is new. So the files hold the whole map after
/// every `insert`, also if the process is killed then; of a kill in between they lose some of the
/// newest points and nothing else. Tiles that are farthest from the sensor leave the memory first,
/// and come back when a point falls into them. The result does not depend on the budget.
///
/// A folder belongs to one map at a time, in this process or another, as long as that lives.
///
/// Takes the place of the map in memory by `Stages::Map`:
///
///     struct Stages : dynains::DefaultStages { using Map = dynains::TiledStaticMap; };
///     dynains::BasicDynaInsRemover<Stages>::Config config;
///     config.map.map_folder = "map";
///
/// For a file that must survive a power cut as well, call `sync_files(folder)`.
class TiledStaticMap {
 public:
  struct Config {
    double map_voxel = 0.2;   ///< m, edge of a voxel; 0 keeps every point
    double map_memory = 256;  ///< MB that tiles may take between two inserts
    /// Where the tiles are; created if it lacks. A map that is there is continued.
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
  /// be used, or holds a map of other voxels.
  explicit TiledStaticMap(const Config& config);

  const Config& config() const { return config_; }

  /// Adds the points of one scan (metres, sensor frame) whose `keep` flag is not zero; an empty
  /// `keep` adds all. Throws IoError if a tile cannot be read or written. Points that could not be
  /// written stay in memory, whatever the budget, and are written by the next `insert` that can.
  void insert(PointsView points, Span<const std::uint8_t> keep,
              const Eigen::Isometry3d& T_world_sensor);

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  /// Forgets all points and removes their files. Throws IoError.
  void clear();

  /// Bytes held by tiles in memory.
  std::size_t memory_bytes() const;

  /// Calls `visit(Eigen::Vector3d)` for every point, in metres, world frame; tile by tile, in the
  /// order of their places. Takes the memory of one tile more. Throws IoError.
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
  using Place = std::array<std::int64_t, 3>;  // of a tile in the world, counted in tiles

  struct Point {
    std::uint32_t voxel;  // in the tile: x, y in 8 bits each, z in 16
    float x, y, z;        // m, relative to the corner of the voxel
  };

  // In memory: the points in the order in which they came, and which voxels they fill.
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
  double voxel_;  // m, also if every point is kept
  std::size_t size_ = 0;
  std::map<Place, std::size_t> stored_;  // points of every tile that are in its file
  std::map<Place, Tile> tiles_;          // those in memory
};

}  // namespace dynains
