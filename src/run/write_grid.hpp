// Occupancy grids of a run, and of a map.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "grid/grid_maker.hpp"

namespace dynains::run {

/// The description of a grid, by whole_path(). Throws ConfigError unless the name ends in .yaml.
std::filesystem::path grid_file(const std::filesystem::path& name);
/// Beside the description `file` (.yaml): the image of a grid.
std::filesystem::path grid_image(const std::filesystem::path& file);

/// A finished grid: where its positions are measured from, m, world frame.
struct PlacedGrid {
  grid::OccupancyGrid grid;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
  std::vector<std::string> doubts = {};  ///< for warnings

  /// Cells and their shares, for reports.
  nlohmann::ordered_json summary() const;
};

/// Reads the final labels of a scan of the recording, whose points are given.
using LabelReader = std::function<void(std::size_t scan, const RecordedScan& points,
                                       std::vector<PointLabel>& labels)>;

/// The grid of these scans by the final labels of their run. All scans are read
/// twice: first the ground, then what is on it. `keep_moving`: what moved counts as if it were
/// static. Calls `progress` before the first scan and after each. Throws IoError, ConfigError,
/// Interrupted.
PlacedGrid grid_of_run(const LabelReader& read_labels, const Recording& recording,
                       const std::vector<std::size_t>& scans, const grid::Config& config,
                       bool keep_moving, const std::function<void(std::size_t done)>& progress);

/// The grid of a map alone: free is where ground was seen. Throws IoError, ConfigError.
PlacedGrid grid_of_map(const std::filesystem::path& map, const grid::Config& config);

}  // namespace dynains::run
