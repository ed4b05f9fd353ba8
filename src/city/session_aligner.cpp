#include "dynains/city/session_aligner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "dynains/errors.hpp"
#include "dynains/surfaces/scan_registration.hpp"
#include "io/text.hpp"

namespace dynains {
namespace {

/// Bounds of an alignment.
struct AlignmentBounds {
  double reach = 40.0;     ///< m, points of a scan that count
  std::size_t newest = 3;  ///< sessions in a tile that count
  double inlier = 0.15;    ///< m
  double upright = 200.0;  ///< points at upright surfaces, at least
  double fitting = 0.7;    ///< ratio of these that are inliers, at least
  double slack = 1.1;      ///< ratio, of SessionAligner::kMaxTranslation and kMaxRotation
  std::size_t points[2] = {3000, 60000};  ///< that are aligned, near the seed and all
};
constexpr AlignmentBounds kBounds;

using text::rounded;

[[noreturn]] void refuse(const City& city, const std::string& reason) {
  throw ConfigError(city.folder().string() + ": the session cannot be aligned: " + reason);
}

/// Motions around the start from which the search begins.
std::vector<Pose> guesses() {
  std::vector<Pose> result;
  for (const double yaw : {0.0, -2.0, 2.0, -4.0, 4.0}) {
    for (const double x : {0.0, -1.3, 1.3}) {
      for (const double y : {0.0, -1.3, 1.3}) {
        for (const double z : {0.0, -0.7, 0.7}) {
          Pose T(Eigen::AngleAxisd(yaw * detail::kRadians, Eigen::Vector3d::UnitZ()));
          T.translation() = Eigen::Vector3d(x, y, z);
          result.push_back(T);
        }
      }
    }
  }
  return result;
}

/// Points (m, relative to `origin`, axes of the city) of the newest sessions in the tiles that are
/// near `places` (m, frame of the city). Adds the names of these sessions.
PointBuffer points_near(const City& city, const std::vector<Eigen::Vector3d>& places,
                        const Eigen::Vector3d& origin, std::set<std::string>& names) {
  constexpr double near = kBounds.reach + SessionAligner::kMaxTranslation;  // m
  const SessionGrid& grid = city.grid();
  std::map<TileIndex, std::size_t> counts;
  PointBuffer points;
  const std::vector<SessionInfo>& sessions = city.sessions();
  for (auto session = sessions.rbegin(); session != sessions.rend(); ++session) {
    for (const auto& [tile, block] : session->tiles) {
      const Eigen::Vector3d corner = tile_corner(grid, tile);
      const auto is_near = [&](const Eigen::Vector3d& place) {
        const Eigen::Array2d from_corner = (place - corner).head<2>().array();
        return (from_corner > -near).all() && (from_corner < grid.tile + near).all();
      };
      if (!std::any_of(places.begin(), places.end(), is_near) || counts[tile]++ >= kBounds.newest)
        continue;
      names.insert(session->name);
      for (const SessionPoint& point : city.read_tile(*session, tile)) {
        const Eigen::Vector3f p = (position_of(grid, tile, point) - origin).cast<float>();
        points.push_back(p.x(), p.y(), p.z());
      }
    }
  }
  return points;
}

/// How well the points of a session fit to the surfaces of the map.
struct Fit {
  Pose T = Pose::Identity();  ///< from the start
  double uncertainty = 0.0;   ///< m, of the translation along its least certain direction
  double upright = 0.0, upright_inliers = 0.0, inliers = 0.0;  ///< points at surfaces
  double squares = 0.0;                                        ///< m^2, of inliers
  bool is_ambiguous = false;

  /// Both what is upright and the ground have to fit.
  double score() const { return upright_inliers * (1.0 + inliers - upright_inliers); }
  double fitting() const { return upright_inliers / std::max(upright, 1.0); }
};

/// From a guess of the motion. Without score if only few points meet surfaces.
Fit fitted(const RegistrationScan& map, const RegistrationScan& session, const Pose& guess) {
  Fit fit;
  const auto found = register_scans(map.surfaces(), session.points(), {guess});
  if (!found) return fit;
  fit.T = found->T_a_b;
  fit.uncertainty = found->uncertainty;
  for (const Eigen::Vector3d& point : session.points()) {
    const Eigen::Vector3d p = fit.T * point;
    const CellSurface* const surface = map.surfaces().find(kCellLevels - 1, p);
    if (surface == nullptr || surface->variance > 0.0) continue;
    const double squared = surface->squared_distance(p);
    const bool is_inlier = squared <= kBounds.inlier * kBounds.inlier;
    fit.upright += surface->is_upright ? 1.0 : 0.0;
    fit.upright_inliers += is_inlier && surface->is_upright ? 1.0 : 0.0;
    fit.inliers += is_inlier ? 1.0 : 0.0;
    fit.squares += is_inlier ? squared : 0.0;
  }
  return fit;
}

/// The best fit from all guesses.
Fit best_fit(const RegistrationScan& map, const RegistrationScan& session) {
  std::vector<Fit> fits;
  for (const Pose& guess : guesses()) fits.push_back(fitted(map, session, guess));
  Fit best = *std::max_element(fits.begin(), fits.end(),
                               [](const Fit& a, const Fit& b) { return a.score() < b.score(); });
  best.is_ambiguous = std::any_of(fits.begin(), fits.end(), [&](const Fit& other) {
    return (other.T.translation() - best.T.translation()).norm() > kDistinct &&
           other.score() > kAlmost * best.score();
  });
  return best;
}

/// Throws ConfigError unless a result is a fit.
void check_fit(const City& city, const Fit& fit) {
  const std::string limits = rounded(SessionAligner::kMaxTranslation, 0) + " m and " +
                             rounded(SessionAligner::kMaxRotation, 0) + " degrees";
  if (fit.upright < kBounds.upright) {
    refuse(city, "only " + rounded(fit.upright, 0) +
                     " of its points meet walls, poles or the like of the map; expected at least " +
                     rounded(kBounds.upright, 0));
  }
  if (fit.fitting() < kBounds.fitting) {
    refuse(city, "it does not fit: " + rounded(100.0 * fit.fitting(), 0) +
                     " % of its points at upright surfaces are within " +
                     rounded(kBounds.inlier, 2) + " m of them; expected at least " +
                     rounded(100.0 * kBounds.fitting, 0) + " %. Is the start within " + limits +
                     '?');
  }
  if (fit.uncertainty > kMaxUncertain) {
    refuse(city, "one direction is uncertain by " + rounded(fit.uncertainty, 2) +
                     " m; expected at most " + rounded(kMaxUncertain, 2) + " m");
  }
  if (fit.is_ambiguous) refuse(city, "it fits nearly as well at another place");
  const double way = fit.T.translation().norm();
  const double angle = angle_of(fit.T.linear()) / detail::kRadians;
  if (way > kBounds.slack * SessionAligner::kMaxTranslation ||
      angle > kBounds.slack * SessionAligner::kMaxRotation) {
    refuse(city, "the best fit is " + rounded(way, 2) + " m and " + rounded(angle, 2) +
                     " degrees from the start; expected at most " + limits);
  }
}

}  // namespace

void SessionAligner::add(PointsView points, const Pose& T_session_sensor) {
  sensors_.push_back(T_session_sensor.translation());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d local(static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
                                static_cast<double>(points.z[i]));
    const double range = local.norm();
    if (!(range > kMinPoint && range < kBounds.reach)) continue;
    const Eigen::Vector3d point = T_session_sensor * local;
    if (adds(taken_, voxel_at(point - sensors_.front(), kThinned))) points_.push_back(point);
  }
}

SessionAlignment SessionAligner::align(const Pose& T_city_start) const {
  const std::vector<SessionInfo>& sessions = city_.sessions();
  const auto seed = std::find_if(sensors_.begin(), sensors_.end(), [&](const auto& sensor) {
    const TileIndex tile = tile_index(city_.grid(), T_city_start * sensor);
    return std::any_of(sessions.begin(), sessions.end(),
                       [&](const SessionInfo& session) { return session.tiles.count(tile) > 0; });
  });
  if (seed == sensors_.end()) refuse(city_, "the map has no points where it begins from the start");
  // Walls at whole metres, as in simulated worlds, do not lie on borders of cells.
  const Eigen::Vector3d in_cell(0.37, 0.41, 0.43);  // m
  const Eigen::Vector3d centre = T_city_start * *seed + in_cell;
  std::vector<Eigen::Vector3d> places;
  for (const Eigen::Vector3d& sensor : sensors_) places.push_back(T_city_start * sensor);
  std::set<std::string> names;
  const PointBuffer of_map = points_near(city_, places, centre, names);

  // Points near the seed come first: they determine the rotation. A wrong rotation displaces
  // distant scans by more than the registration can correct.
  Fit fit;
  for (const bool is_first : {true, false}) {
    const double radius = is_first ? 60.0 : std::numeric_limits<double>::infinity();  // m
    std::vector<Eigen::Vector3f> near;
    for (const Eigen::Vector3d& point : points_) {
      const Eigen::Vector3d p = T_city_start * point - centre;
      if (p.norm() < radius) near.push_back(p.cast<float>());
    }
    PointBuffer of_session;
    const std::size_t stride = 1 + near.size() / kBounds.points[is_first ? 0 : 1];
    for (std::size_t i = 0; i < near.size(); i += stride) {
      of_session.push_back(near[i].x(), near[i].y(), near[i].z());
    }
    const RegistrationScan map(of_map, radius), session(of_session, radius);
    const bool is_ambiguous = fit.is_ambiguous;
    fit = is_first ? best_fit(map, session) : fitted(map, session, fit.T);
    fit.is_ambiguous = fit.is_ambiguous || is_ambiguous;
  }
  SessionAlignment alignment;
  alignment.T_city_start = T_city_start;
  Pose T_city_centre = Pose::Identity();
  T_city_centre.translation() = centre;
  alignment.T_city_session = T_city_centre * fit.T * T_city_centre.inverse() * T_city_start;
  alignment.residual = std::sqrt(fit.squares / std::max(fit.inliers, 1.0));
  alignment.fitting = fit.fitting();
  alignment.uncertainty = fit.uncertainty;
  alignment.sessions.assign(names.begin(), names.end());
  check_fit(city_, fit);
  return alignment;
}

}  // namespace dynains
