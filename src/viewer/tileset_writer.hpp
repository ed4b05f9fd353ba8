// A map as OGC 3D Tiles 1.0: an octree of tiles of points with levels of detail.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/point_file.hpp"
#include "point_spill.hpp"
#include "tile_point.hpp"

namespace dynains::viewer {

inline constexpr const char* kTilesetFile = "tileset.json";
/// The page that shows the tiles, beside kTilesetFile.
inline constexpr const char* kTilesetPage = "map.html";
inline constexpr const char* kTilesetFolder = "tileset";  ///< beside it, of the tiles
inline constexpr const char* kPointTileExtension = ".pnts";

/// The rule of the levels of detail. Each point is in exactly one tile.
///
/// A node that at most kLeafPoints points reach keeps all of them. Another node keeps the first
/// point of each of its 128^3 cells and passes the others on to its children. So the order of the
/// points alone decides, and the same points give the same bytes. The geometric error of a tile
/// with children is 8 times the edge of its cells: a viewer with the usual limit of 16 pixels shows
/// points that are about 2 pixels apart.
///
/// Memory does not grow with the number of points, except by some 300 kB for each million of them:
/// nodes that more than kMostPointsInMemory points reach are divided while points are added, and
/// lists of points are in a temporary file of some 32 bytes per point.
class TilesetWriter {
 public:
  static constexpr std::size_t kLeafPoints = 50000;
  static constexpr std::size_t kMostPointsInMemory = 1000000;

  /// `folder` exists. `columns`: see encode_point_tile(). `lowest`, `highest`: bounds of all
  /// points, m, world frame. Throws ConfigError, IoError.
  TilesetWriter(std::filesystem::path folder, const PointColumns& columns,
                const Eigen::Vector3d& lowest, const Eigen::Vector3d& highest);
  ~TilesetWriter();
  TilesetWriter(const TilesetWriter&) = delete;
  TilesetWriter& operator=(const TilesetWriter&) = delete;

  /// Throws ConfigError for a point outside of the bounds, and IoError.
  void add(const FilePoint& point);
  std::size_t size() const { return size_; }

  /// Writes the tiles into the folder kTilesetFolder, then kTilesetPage and kTilesetFile, each
  /// atomically. All are on the disk afterwards. Throws IoError.
  void commit();

 private:
  struct Node;
  struct Written {
    nlohmann::ordered_json json;  // of the tile and those below
    Eigen::AlignedBox3d bounds;   // m, world frame
  };

  void insert(Node& start, const TilePoint& point);
  void divide(Node& node);
  Written write(Node& node);
  Written write(const TileNode& place, std::vector<TilePoint> points);
  Written write_tile(const TileNode& place, const std::vector<TilePoint>& points,
                     std::vector<Written> children);

  std::filesystem::path folder_;
  PointColumns columns_;
  TileCube cube_;
  std::optional<PointSpill> spill_;  // until commit()
  std::unique_ptr<Node> root_;
  std::size_t size_ = 0;
};

}  // namespace dynains::viewer
