// All judged points of a sequence, thinned, with their fates.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/truth.hpp"
#include "picture.hpp"

namespace dynains::program {

/// In the order in which figures draw them: later ones cover earlier ones.
enum class Fate : std::uint8_t { kKeptStatic, kRemovedDynamic, kLostStatic, kMissedDynamic };

inline constexpr std::size_t kFateCount = 4;
inline constexpr std::array<Colour, kFateCount> kFateColours = {
    {{150, 150, 150}, {30, 160, 60}, {255, 140, 0}, {220, 20, 30}}};
/// Dynamic points in figures of the raw map.
inline constexpr Colour kRawDynamicColour = {30, 80, 220};

constexpr bool is_dynamic(Fate fate) {
  return fate == Fate::kRemovedDynamic || fate == Fate::kMissedDynamic;
}

/// Keeps one measured point per voxel and fate: memory is bounded by the map.
class VerdictCloud {
 public:
  struct Point {
    Eigen::Vector3f local;  ///< m, world axes, relative to origin()
    Fate fate;
  };

  /// `resolution`: edge of the voxels, m. Planar ranges in m.
  VerdictCloud(double resolution, double min_range, double max_range,
               const evaluation::TruthClasses& truth)
      : resolution_(resolution), min_range_(min_range), max_range_(max_range), truth_(truth) {}

  /// Adds the points of a scan as estimate 0 judges them.
  void add(const evaluation::LabelledScan& scan);

  /// After the last scan: drops lost static points where other scans kept some, and removed dynamic
  /// points where others were missed, because the map does not show them.
  void drop_covered();

  /// Position of the first sensor in the world, m.
  const Eigen::Vector3d& origin() const { return origin_; }
  const std::vector<Point>& points() const { return points_; }
  /// Sensor positions relative to origin(), m.
  const std::vector<Eigen::Vector3d>& path() const { return path_; }

 private:
  double resolution_;
  double min_range_;
  double max_range_;
  evaluation::TruthClasses truth_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::vector<Point> points_;
  std::vector<Eigen::Vector3d> path_;
  std::vector<std::uint64_t> voxels_;                      // of each point
  std::unordered_map<std::uint64_t, std::uint8_t> fates_;  // per voxel, one bit each
};

}  // namespace dynains::program
