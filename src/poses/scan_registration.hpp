// Registration of two scans by planes in the cells of a grid.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "cell_surfaces.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains {

/// One scan as a reference and as a source of a registration.
class RegistrationScan {
 public:
  /// `points`: m, sensor frame, finite. Those more than 2 m and less than `farthest` (m) away
  /// count.
  explicit RegistrationScan(PointsView points, double farthest = 60.0);

  /// One point for each voxel of 0.4 m.
  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  /// The surface in the cell around a point; null if it has too few points or no surface.
  const CellSurface* find(std::size_t level, const Eigen::Vector3d& point) const;

 private:
  std::vector<Eigen::Vector3d> points_;
  std::array<VoxelHashTable<>, kCellLevels> index_;
  std::array<std::vector<CellSurface>, kCellLevels> surfaces_;
};

struct Registration {
  Pose T_a_b = Pose::Identity();
  double score = 0.0;        ///< mean weight of the points of b, [0, 1]; higher is better
  double uncertainty = 0.0;  ///< m, of the translation along its least certain direction
  /// The two directions that planes determine worst, the worst first; unit vectors, frame of a.
  std::array<Eigen::Vector3d, 2> uncertain = {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()};
  /// Whether another result is nearly as good, as in traffic that moves with the sensor.
  bool is_ambiguous = false;
};

/// Registers `b` to `a` from several guesses of T_a_b; the best result counts. Empty if too few
/// points of `b` meet a cell of `a`.
std::optional<Registration> register_scans(const RegistrationScan& a, const RegistrationScan& b,
                                           const std::vector<Pose>& guesses);

/// A component of the translation that is known otherwise.
struct KnownTranslation {
  Eigen::Vector3d direction;  ///< unit vector, frame of a
  double deviation;           ///< m
};

/// As register_scans(), by small steps from `guess`, whose translation along `way` is known.
std::optional<Registration> register_near(const RegistrationScan& a, const RegistrationScan& b,
                                          const Pose& guess, const KnownTranslation& way);

}  // namespace dynains
