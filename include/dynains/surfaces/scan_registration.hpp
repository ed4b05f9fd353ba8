// Registration of a scan by the surfaces of another one, or of a map.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/registration/normal_equations.hpp"
#include "dynains/surfaces/surface_grid.hpp"

namespace dynains {

// Not aligned, since the alignment of the types of Eigen depends on flags.
using Vector6 = Eigen::Matrix<double, 6, 1, Eigen::DontAlign>;
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

using detail::kLever;

/// Angle of a rotation, rad, [0, pi].
inline double angle_of(const Eigen::Matrix3d& R) {
  return std::abs(Eigen::AngleAxisd(detail::Quaternion(R)).angle());
}

/// Size of a motion, m, for points kLever away.
inline double extent_of(const Pose& T) {
  return std::hypot(T.translation().norm(), kLever * angle_of(T.linear()));
}

/// One scan as a reference and as a source of a registration.
class RegistrationScan {
 public:
  /// `points`: m, sensor frame, finite. Those more than 2 m and less than `farthest` (m) away
  /// count.
  explicit RegistrationScan(PointsView points, double farthest = 60.0);

  /// One point for each voxel of 0.4 m.
  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  const SurfaceGrid& surfaces() const { return surfaces_; }

 private:
  std::vector<Eigen::Vector3d> points_;
  SurfaceGrid surfaces_;
};

/// Edge (m) of the voxels that keep one point each.
inline constexpr double kThinned = 0.4;
/// Results farther apart (m) are other places.
inline constexpr double kDistinct = 0.5;
/// Ratio of what is nearly as good as the best.
inline constexpr double kAlmost = 0.93;
/// Points at planes and poles that a registration needs.
inline constexpr std::size_t kMinMatches = 100;
/// Score that registrations of other places hardly reach, of dense scans.
inline constexpr double kMinScore = 0.45;
/// Maximum standard deviation (m) of the translation of a registration that places a scan or
/// session.
inline constexpr double kMaxUncertain = 0.05;

/// A component of the translation that is known otherwise.
struct KnownTranslation {
  Eigen::Vector3d direction;  ///< unit vector, frame of a
  double place;               ///< m, along direction
  double deviation;           ///< m
};

/// Points `b` that meet the surfaces `a`, m.
struct Overlap {
  const SurfaceGrid* a;
  const std::vector<Eigen::Vector3d>* b;
};

/// Gauss-Newton steps until they are short.
struct FitStage {
  std::size_t level;  ///< of the surfaces
  double scale;       ///< m, see detail::robust_weight()
  int max_steps;
  std::size_t stride = 1;  ///< every `stride`-th point counts
};

struct Registration {
  Pose T_a_b = Pose::Identity();
  double score = 0.0;        ///< mean weight of the points at planes and poles, [0, 1]
  double uncertainty = 0.0;  ///< m, of the translation along its least certain direction
  /// The two directions that planes determine worst, the worst first; unit vectors, frame of a.
  std::array<Eigen::Vector3d, 2> uncertain = {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()};
  int free_directions = 0;  ///< of six, that the surfaces do not determine; they keep the guess
  /// Whether another result is nearly as good, as in traffic that moves with the sensor.
  bool is_ambiguous = false;
  std::optional<KnownTranslation> way = {};  ///< as given
};

/// The motion near `T_a_b` by which the points of all overlaps, at least one, fit to the surfaces.
Pose refined(const std::vector<Overlap>& overlaps, Pose T_a_b, const FitStage& by,
             const std::optional<KnownTranslation>& way = {});

/// Mean weight of those of the points `b` (m) that meet planes or poles of `a`, [0, 1].
double fit_of(const SurfaceGrid& a, const std::vector<Eigen::Vector3d>& b, const Pose& T_a_b);

/// Registers the points `b` (m) to the surfaces `a` from several guesses of T_a_b; the best result
/// counts. Empty if too few points meet a surface.
std::optional<Registration> register_scans(const SurfaceGrid& a,
                                           const std::vector<Eigen::Vector3d>& b,
                                           const std::vector<Pose>& guesses);

/// As register_scans(), by small steps from `guess`.
std::optional<Registration> register_near(const SurfaceGrid& a,
                                          const std::vector<Eigen::Vector3d>& b, const Pose& guess,
                                          const std::optional<KnownTranslation>& way = {});

}  // namespace dynains
