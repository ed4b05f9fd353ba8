#include "dynains/city/session_aligner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "dynains/errors.hpp"
#include "poses/cell_surfaces.hpp"

namespace dynains {
namespace {

constexpr double kReach = 40.0;     // m, points of a scan that count
constexpr double kNearest = 2.0;    // m
constexpr double kThinned = 0.4;    // m, edge of the voxels that keep one point of the session
constexpr std::size_t kNewest = 3;  // sessions in a tile that count
constexpr double kDegree = M_PI / 180.0;

/// Surfaces of the map in cells of one size.
class SurfaceGrid {
 public:
  explicit SurfaceGrid(double edge) : edge_(edge) {}

  void add(const Eigen::Vector3d& point) {
    const VoxelKey key = cell_key(point, edge_);
    const std::uint32_t number = index_.insert(key);
    if (number == moments_.size()) {
      moments_.emplace_back();
      moments_.back().origin = (point / edge_).array().floor() * edge_;
    }
    moments_[number].add(point);
  }
  void finish() {
    surfaces_.reserve(moments_.size());
    for (const CellMoments& m : moments_) surfaces_.push_back(surface_of(m, edge_));
    moments_ = {};
  }
  /// The surface around a point, or null. Ground at the border of two layers of cells may be in
  /// one of them only, so that the next layer counts if the cell of the point has no surface.
  const CellSurface* find(const Eigen::Vector3d& point) const {
    const CellSurface* found = find_at(cell_key(point, edge_));
    if (found != nullptr) return found;
    const double layer = point.z() / edge_;
    const double step = layer - std::floor(layer) < 0.5 ? -edge_ : edge_;
    found = find_at(cell_key({point.x(), point.y(), point.z() + step}, edge_));
    return found != nullptr && found->is_upright ? nullptr : found;
  }

 private:
  const CellSurface* find_at(VoxelKey key) const {
    const std::uint32_t number = index_.find(key);
    if (number == VoxelHashTable<>::kNone || surfaces_[number].direction_count == 0) return nullptr;
    return &surfaces_[number];
  }

  double edge_;
  VoxelHashTable<> index_;
  std::vector<CellMoments> moments_;
  std::vector<CellSurface> surfaces_;
};

using SurfaceMap = std::array<SurfaceGrid, kCellLevels>;

/// Normal equations at one motion, and how well its points fit.
struct SurfaceFit {
  NormalEquations equations;
  std::size_t upright = 0, upright_inliers = 0;
  double upright_weight = 0.0, other_weight = 0.0;
  std::size_t inliers = 0;
  double squares = 0.0;  // m^2, of inliers
};

constexpr double kInlier = 0.15;  // m

/// Fits points to surfaces.
class Fit {
 public:
  Fit(const SurfaceMap& map, const std::vector<Eigen::Vector3d>& points)
      : map_(map), points_(points) {}

  /// `scale`: m, distance at which the weight of a point is a fourth.
  SurfaceFit linearize(const Pose& T, std::size_t level, double scale) const {
    SurfaceFit sum;
    for (const Eigen::Vector3d& point : points_) {
      const Eigen::Vector3d p = T * point;
      const CellSurface* const surface = map_[level].find(p);
      if (surface == nullptr) continue;
      const auto [squared, weight] = sum.equations.add(p, *surface, scale);
      const bool is_inlier = squared <= kInlier * kInlier;
      if (surface->is_upright) {
        ++sum.upright;
        sum.upright_inliers += is_inlier ? 1 : 0;
        sum.upright_weight += weight;
      } else {
        sum.other_weight += weight;
      }
      if (!is_inlier) continue;
      ++sum.inliers;
      sum.squares += squared;
    }
    return sum;
  }

  Pose refine(const Pose& T, std::size_t level, double scale, int most) const {
    return gauss_newton(T, most, 1e-6,
                        [&](const Pose& at) { return linearize(at, level, scale).equations; });
  }

 private:
  const SurfaceMap& map_;
  const std::vector<Eigen::Vector3d>& points_;
};

double rotation_angle(const Pose& T) {
  return Eigen::AngleAxisd(detail::Quaternion(T.linear())).angle() / kDegree;
}

std::string rounded(double value, int digits) {
  std::ostringstream text;
  text.setf(std::ios::fixed);
  text.precision(digits);
  text << value;
  return text.str();
}

[[noreturn]] void refuse(const City& city, const std::string& reason) {
  throw ConfigError(city.folder().string() + ": the session cannot be aligned: " + reason);
}

/// Motions around the start from which the search begins.
std::vector<Pose> guesses() {
  std::vector<Pose> result;
  for (const double yaw : {0.0, -2.0, 2.0, -4.0, 4.0}) {
    for (const double x : {0.0, -1.3, 1.3}) {
      for (const double y : {0.0, -1.3, 1.3}) {
        Pose T(Eigen::AngleAxisd(yaw * kDegree, Eigen::Vector3d::UnitZ()));
        T.translation() = Eigen::Vector3d(x, y, 0.0);
        result.push_back(T);
      }
    }
  }
  return result;
}

struct Coarse {
  Pose T = Pose::Identity();
  bool is_ambiguous = false;
};

/// Best of the results of all guesses.
Coarse search(const Fit& fit) {
  constexpr double kDistinct = 0.5;              // m
  constexpr double kAlmost = 0.95;               // ratio of scores
  std::vector<std::pair<double, Pose>> results;  // score, motion
  for (const Pose& guess : guesses()) {
    Pose T = fit.refine(guess, 0, 1.0, 12);
    T = fit.refine(T, 1, 0.4, 10);
    T = fit.refine(T, 2, 0.2, 5);
    const SurfaceFit sum = fit.linearize(T, 2, 0.15);
    // Both what is upright and the ground have to fit.
    results.emplace_back(std::sqrt(sum.upright_weight * (1.0 + sum.other_weight)), T);
  }
  const auto best =
      std::max_element(results.begin(), results.end(),
                       [](const auto& a, const auto& b) { return a.first < b.first; });
  const bool is_ambiguous = std::any_of(results.begin(), results.end(), [&](const auto& other) {
    return (other.second.translation() - best->second.translation()).norm() > kDistinct &&
           other.first > kAlmost * best->first;
  });
  return {best->second, is_ambiguous};
}

/// Tiles of a city, each with the newest of its sessions.
class TileSessions {
 public:
  explicit TileSessions(const City& city) : city_(city), sessions_(city.sessions()) {
    for (std::size_t i = sessions_.size(); i-- > 0;) {
      for (const auto& tile : sessions_[i].tiles) {
        std::vector<std::size_t>& chosen = by_tile_[tile.first];
        if (chosen.size() < kNewest) chosen.push_back(i);
      }
    }
  }

  TileIndex tile_at(const Eigen::Vector3d& position) const {
    const double edge = city_.grid().tile;
    return {static_cast<std::int32_t>(std::floor(position.x() / edge)),
            static_cast<std::int32_t>(std::floor(position.y() / edge))};
  }
  bool has(const TileIndex& tile) const { return by_tile_.count(tile) > 0; }

  /// Calls `visit(position)` for the points (m, frame of the city) of the chosen sessions that are
  /// up to `reach` from one of `places`, seen from above. Adds the names of these sessions.
  template <class Visitor>
  void for_each_near(const std::vector<Eigen::Vector3d>& places, double reach,
                     std::set<std::string>& names, Visitor&& visit) const {
    const Eigen::Vector3d margin(reach, reach, 0.0);
    std::map<TileIndex, std::vector<Eigen::Vector3d>> wanted;
    for (const Eigen::Vector3d& place : places) {
      const TileIndex first = tile_at(place - margin), last = tile_at(place + margin);
      for (std::int32_t x = first[0]; x <= last[0]; ++x) {
        for (std::int32_t y = first[1]; y <= last[1]; ++y) {
          if (has({x, y})) wanted[{x, y}].push_back(place);
        }
      }
    }
    for (const auto& [tile, near] : wanted) {
      const Eigen::Vector3d corner = tile_corner(city_.grid(), tile);
      for (const std::size_t session : by_tile_.at(tile)) {
        names.insert(sessions_[session].name);
        for (const SessionPoint& point : city_.read_tile(sessions_[session], tile)) {
          const Eigen::Vector3d position =
              corner + Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
          const bool is_near = std::any_of(near.begin(), near.end(), [&](const auto& place) {
            return (position - place).template head<2>().squaredNorm() < reach * reach;
          });
          if (is_near) visit(position);
        }
      }
    }
  }

 private:
  const City& city_;
  std::vector<SessionInfo> sessions_;
  std::map<TileIndex, std::vector<std::size_t>> by_tile_;
};

/// Every n-th point, so that about `most` are left.
std::vector<Eigen::Vector3d> thinned(const std::vector<Eigen::Vector3d>& points, std::size_t most) {
  const std::size_t step = 1 + points.size() / most;
  std::vector<Eigen::Vector3d> result;
  for (std::size_t i = 0; i < points.size(); i += step) result.push_back(points[i]);
  return result;
}

/// Throws ConfigError unless a result is a fit.
void check_fit(const City& city, const SurfaceFit& sum, const Pose& T_correction, bool is_ambiguous,
               const SessionAlignment& alignment) {
  constexpr std::size_t kFewest = 200;  // points at upright surfaces
  constexpr double kLeastFitting = 0.7;
  constexpr double kMostUncertain = 0.05;  // m
  if (sum.upright < kFewest) {
    refuse(city, "only " + std::to_string(sum.upright) +
                     " of its points meet walls, poles or the like of the map; expected at least " +
                     std::to_string(kFewest));
  }
  if (alignment.fitting < kLeastFitting) {
    refuse(city, "it does not fit: " + rounded(100.0 * alignment.fitting, 0) +
                     " % of its points at upright surfaces are within " + rounded(kInlier, 2) +
                     " m of them; expected at least " + rounded(100.0 * kLeastFitting, 0) +
                     " %. Is the start within " + rounded(SessionAligner::kMostTranslation, 0) +
                     " m and " + rounded(SessionAligner::kMostRotation, 0) + " degrees?");
  }
  if (alignment.uncertainty > kMostUncertain) {
    refuse(city, "one direction is uncertain by " + rounded(alignment.uncertainty, 2) +
                     " m; expected at most " + rounded(kMostUncertain, 2) + " m");
  }
  if (is_ambiguous) refuse(city, "it fits nearly as well at another place");
  constexpr double kSlack = 1.1;
  const double way = T_correction.translation().norm(), angle = rotation_angle(T_correction);
  if (way > kSlack * SessionAligner::kMostTranslation ||
      angle > kSlack * SessionAligner::kMostRotation) {
    refuse(city, "the best fit is " + rounded(way, 2) + " m and " + rounded(angle, 2) +
                     " degrees from the start; expected at most " +
                     rounded(SessionAligner::kMostTranslation, 0) + " m and " +
                     rounded(SessionAligner::kMostRotation, 0) + " degrees");
  }
}

}  // namespace

void SessionAligner::add(PointsView points, const Pose& T_session_sensor) {
  Scan scan{T_session_sensor.translation(), points_.size(), 0};
  const Eigen::Vector3d origin = scans_.empty() ? scan.sensor : scans_.front().sensor;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d local(static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
                                static_cast<double>(points.z[i]));
    const double range = local.norm();
    if (!(range > kNearest && range < kReach)) continue;
    const Eigen::Vector3d point = T_session_sensor * local;
    const std::size_t count = taken_.size();
    if (taken_.insert(cell_key(point - origin, kThinned)) == count) points_.push_back(point);
  }
  scan.end = points_.size();
  scans_.push_back(scan);
}

SessionAlignment SessionAligner::align(const Pose& T_city_start) const {
  const TileSessions tiles(city_);
  const auto seed = std::find_if(scans_.begin(), scans_.end(), [&](const Scan& scan) {
    return tiles.has(tiles.tile_at(T_city_start * scan.sensor));
  });
  if (seed == scans_.end()) refuse(city_, "the map has no points where it begins from the start");
  const Eigen::Vector3d centre = T_city_start * seed->sensor;
  // Frame of the fit: axes of the city, origin at the seed.
  const auto to_fit = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return T_city_start.linear() * (p - seed->sensor);
  };

  SessionAlignment alignment;
  alignment.T_city_start = T_city_start;
  Pose T = Pose::Identity();
  SurfaceFit sum;
  bool is_ambiguous = false;
  double farthest = 0.0;
  for (const Scan& scan : scans_) farthest = std::max(farthest, to_fit(scan.sensor).norm());
  std::set<std::string> names;
  // Scans near the seed come first: they determine the rotation. A wrong rotation displaces distant
  // scans by more than the registration can correct.
  constexpr double kFirstRadius = 25.0;  // m
  for (double radius = kFirstRadius;; radius *= 2.0) {
    const bool is_first = radius == kFirstRadius;
    std::vector<Eigen::Vector3d> places, points;
    for (const Scan& scan : scans_) {
      const Eigen::Vector3d sensor = to_fit(scan.sensor);
      if (sensor.norm() > radius) continue;
      places.push_back(centre + T * sensor);
      for (std::size_t i = scan.begin; i < scan.end; ++i) points.push_back(to_fit(points_[i]));
    }
    SurfaceMap map = {SurfaceGrid(kCellEdges[0]), SurfaceGrid(kCellEdges[1]),
                      SurfaceGrid(kCellEdges[2])};
    const double slack = is_first ? 8.0 : 3.0;  // m
    tiles.for_each_near(places, kReach + slack, names, [&](const Eigen::Vector3d& position) {
      for (SurfaceGrid& grid : map) grid.add(position - centre);
    });
    for (SurfaceGrid& grid : map) grid.finish();
    if (is_first) {
      constexpr std::size_t kSearched = 3000;
      const std::vector<Eigen::Vector3d> few = thinned(points, kSearched);
      const Coarse coarse = search(Fit(map, few));
      T = coarse.T;
      is_ambiguous = coarse.is_ambiguous;
    }
    const Fit fit(map, points);
    T = fit.refine(T, 1, 0.3, 8);
    T = fit.refine(T, 2, 0.1, 20);
    if (radius < farthest) continue;
    sum = fit.linearize(T, 2, 0.1);
    break;
  }
  alignment.T_city_session = T;
  alignment.T_city_session.pretranslate(centre);
  alignment.T_city_session = alignment.T_city_session * Pose(T_city_start.linear());
  alignment.T_city_session.translate(-seed->sensor);
  alignment.residual =
      std::sqrt(sum.squares / static_cast<double>(std::max<std::size_t>(sum.inliers, 1)));
  alignment.fitting = static_cast<double>(sum.upright_inliers) /
                      static_cast<double>(std::max<std::size_t>(sum.upright, 1));
  alignment.uncertainty = sum.equations.uncertainty();
  alignment.sessions.assign(names.begin(), names.end());
  check_fit(city_, sum, T, is_ambiguous, alignment);
  return alignment;
}

}  // namespace dynains
