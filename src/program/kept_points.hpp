// Points of recorded scans that a finished run labelled static.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "dynains/pose.hpp"

namespace dynains::program {

/// Reads scans and their labels, and inserts the static points into a map.
class KeptPoints {
 public:
  /// `recording` outlives this. `labels`: folder of the label files.
  KeptPoints(const Recording& recording, std::filesystem::path labels)
      : recording_(recording), labels_(std::move(labels)) {}

  /// Inserts the static points of scan `i` in the order of the file. Throws IoError for files that
  /// cannot be read, labels of other scans, and labels that no run writes; the map is then
  /// incomplete.
  void insert_into(StaticMapAccumulator& map, std::size_t i, const Pose& T_world_sensor);

 private:
  const Recording& recording_;
  std::filesystem::path labels_;
  RecordedScan scan_;
  std::vector<std::uint32_t> label_block_;
};

}  // namespace dynains::program
