// Occupancy grids: where a robot can drive, seen from above. Their files.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "grid/floors.hpp"

namespace dynains::grid {

struct Config {
  double resolution = 0.05;  ///< m
  double min_height = 0.1;   ///< m
  double max_height = 1.8;   ///< m

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"resolution", self.resolution, closed(0.01, 1.0), "m",
                      "edge of the cells of the occupancy grid"});
    visitor(Parameter{"min_height", self.min_height, closed(0.01, 1.0), "m",
                      "height over the ground from which points are obstacles of the grid; steps "
                      "of up to twice the height are none"});
    visitor(Parameter{"max_height", self.max_height, closed(0.05, 20.0), "m",
                      "height over the ground up to which points are obstacles of the grid: that "
                      "of the robot"});
  }

  /// Throws ConfigError.
  void validate() const;
};

enum class CellState : std::uint8_t { kUnknown, kFree, kOccupied };

/// Cells row by row from the lowest corner on, which has the smallest x and y.
struct OccupancyGrid {
  Columns columns;
  std::vector<CellState> cells;

  /// Cells in a state.
  std::size_t count(CellState state) const;
};

/// Makes a grid of points over floors. Positions are those of the floors.
class GridMaker {
 public:
  /// `floors` are finished, and outlive this. `spacing`: m, between points of a surface, if they
  /// are thinned; then each point counts as a scan. Throws ConfigError.
  GridMaker(const Config& config, const Floors& floors, double spacing = 0.0);

  /// Begins a scan, or any other set of points that were seen at a time.
  void begin_scan() { ++scan_; }
  /// Adds a point of the scan: as an obstacle, as ground, or as what has left its place.
  void add(const Eigen::Vector3d& point, bool is_moving);
  /// Marks the cells that beams of a scan cross below half of the maximum height as free: a higher
  /// beam misses low obstacles. `ends`: where they returned. Between both ends,
  /// the ground counts as a plane.
  void add_beams(const Eigen::Vector3d& sensor, Span<const Eigen::Vector3d> ends);
  /// The grid of all that was added, as far as cells are known. An obstacle was seen in three
  /// scans, or in all there are.
  OccupancyGrid grid() const;

 private:
  /// Numbers of scans, halved together so that they fit: their ratio counts.
  struct Cell {
    std::uint8_t obstacle = 0;  // with obstacles in this cell or one around it
    std::uint8_t clear = 0;     // of the others, with ground or what moved in this cell
    std::uint8_t latest_obstacle = 0, latest_clear = 0;  // of these scans, modulo 256
    bool has_obstacle = false;                           // itself
    bool is_free = false;                                // ground was seen, or a beam crossed it
  };

  std::optional<Floors::Height> height_of(const Eigen::Vector3d& point) const {
    return floors_.height_of(point, config_.min_height, config_.max_height);
  }
  Cell* cell_at(const Eigen::Vector3d& position);
  void add_obstacle(std::int64_t x, std::int64_t y);
  void count(std::uint8_t& scans, std::uint8_t& latest, Cell& cell) const;
  /// By three scans or more: fewer may show what passed unnoticed.
  bool is_obstacle(const Cell& cell) const {
    return cell.has_obstacle && cell.obstacle > cell.clear && cell.obstacle >= std::min(3, scan_);
  }
  void close_gaps(OccupancyGrid& grid) const;

  Config config_;
  std::int64_t reach_;  // cells, in which scans see one obstacle
  int scan_ = 0;        // number of the scans
  const Floors& floors_;
  Columns columns_;
  std::vector<Cell> cells_;
  std::vector<std::int32_t> begun_;  // by azimuth and range: free from here on, minus from here not
};

/// Writes an image (PGM) and its description (YAML), mode `trinary`, as the map server of nav2
/// reads them, each whole or not at all. `origin`: m, world frame, of the positions of the grid.
/// Throws IoError.
void write_grid(const std::filesystem::path& image, const std::filesystem::path& description,
                const OccupancyGrid& grid, const Eigen::Vector2d& origin);

}  // namespace dynains::grid
