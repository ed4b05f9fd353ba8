// Scans that no other scan is compared with.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>

#include "dynains/config.hpp"
#include "dynains/io/recording.hpp"

namespace dynains::program {

/// A remark for the user if most of the scans `first` to `last` (inclusive) begin a new window,
/// because the time or distance from the scan before is too large, or if there is only one.
inline std::optional<std::string> remark_on_lone_scans(const Recording& recording,
                                                       std::size_t first, std::size_t last,
                                                       const RemoverConfig& config) {
  if (first == last) {
    return "one scan alone is compared with no other, and nothing is removed from it";
  }
  std::size_t breaks = 0;
  for (std::size_t i = first + 1; i <= last; ++i) {
    const Eigen::Vector3d step =
        recording.T_world_sensor(i).translation() - recording.T_world_sensor(i - 1).translation();
    const double pause = recording.time(i) - recording.time(i - 1);
    breaks += config.starts_epoch(pause, step.norm()) ? 1 : 0;
  }
  if (2 * breaks <= last - first) return std::nullopt;
  return std::to_string(breaks) + " of " + std::to_string(last - first + 1) +
         " scans come so long after the one before, or so far from it, that they are not compared, "
         "and nothing is removed from scans that stand alone; are times in seconds and poses in "
         "metres? If so, see --max-gap and --max-speed";
}

}  // namespace dynains::program
