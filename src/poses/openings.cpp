#include "openings.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "cell_surfaces.hpp"
#include "dynains/median.hpp"
#include "dynains/sensor/mounting.hpp"
#include "io/points/finite_points.hpp"

namespace dynains {
namespace {

/// The coordinate of a scan in the files for which half of the points are smaller, by axis.
Eigen::Vector3d middle_in_file(const Recording& recording, std::size_t i) {
  const PointBuffer points = finite_points(recording.read_scan(i));
  const bool is_world = recording.frame() == PointFrame::kWorld;
  const Pose T_file_sensor = is_world ? recording.T_world_sensor(i) : Pose::Identity();
  std::vector<double> x, y, z;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Eigen::Vector3d p =
        T_file_sensor * Eigen::Vector3f(points.x[k], points.y[k], points.z[k]).cast<double>();
    x.push_back(p.x());
    y.push_back(p.y());
    z.push_back(p.z());
  }
  return {median(std::move(x)), median(std::move(y)), median(std::move(z))};
}

/// How much the elevations of points, seen from `origin` (m), gather, as those of the beams of a
/// spinning sensor do: about 1 for a smooth distribution.
double sharpness(const PointBuffer& points, const Eigen::Vector3d& origin) {
  constexpr double kBinsPerRad = 570.0;  // ten a degree
  constexpr std::size_t kWindow = 40;    // bins over which a smooth distribution hardly changes
  std::vector<double> counts(static_cast<std::size_t>(kBinsPerRad * M_PI) + 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p =
        Eigen::Vector3f(points.x[i], points.y[i], points.z[i]).cast<double>() - origin;
    if (!(p.norm() > kMinPoint)) continue;
    const double elevation = std::asin(std::clamp(p.z() / p.norm(), -1.0, 1.0));
    counts[static_cast<std::size_t>(kBinsPerRad * (elevation + M_PI / 2))] += 1.0;
  }
  double squares = 0.0, smooth = 0.0;
  for (std::size_t i = 0; i < counts.size(); i += kWindow) {
    double sum = 0.0;
    for (std::size_t k = i; k < std::min(i + kWindow, counts.size()); ++k) {
      sum += counts[k];
      squares += counts[k] * counts[k];
    }
    smooth += sum * sum / static_cast<double>(kWindow);
  }
  return smooth > 0.0 ? squares / smooth : 1.0;
}

}  // namespace

std::optional<bool> follow_sensor(const Recording& recording, double min_way) {
  std::size_t farthest = 0;
  const auto way_to = [&](std::size_t i) -> Eigen::Vector3d {
    return recording.T_world_sensor(i).translation() - recording.T_world_sensor(0).translation();
  };
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (way_to(i).norm() > way_to(farthest).norm()) farthest = i;
  }
  const Eigen::Vector3d way = way_to(farthest);
  if (!(way.norm() > min_way)) return std::nullopt;
  const Eigen::Vector3d moved = middle_in_file(recording, farthest) - middle_in_file(recording, 0);
  return moved.dot(way) > 0.5 * way.squaredNorm();
}

bool has_wrong_origin(const Recording& recording) {
  constexpr double kClearly = 1.3;     // ratio
  constexpr double kOverGround = 0.3;  // m; seen from a point on it, level ground is one beam
  if (recording.sensor_origin().isZero(0.0) || recording.size() == 0) return false;
  const PointBuffer all = finite_points(recording.read_scan(recording.size() / 2));
  const Mounting mounting = estimate_mounting(all);
  if (!mounting.known) return false;
  PointBuffer points;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Eigen::Vector3d p = Eigen::Vector3f(all.x[i], all.y[i], all.z[i]).cast<double>();
    if (mounting.up_sensor.dot(p) + mounting.height < kOverGround) continue;
    points.push_back(all.x[i], all.y[i], all.z[i]);
  }
  return sharpness(points, -recording.sensor_origin()) >
         kClearly * sharpness(points, Eigen::Vector3d::Zero());
}

std::vector<RecordingOptions> other_options(const Recording& recording) {
  std::vector<RecordingOptions> all;
  const auto add = [&](auto&& change) {
    all.push_back(recording.options());
    change(all.back());
  };
  const bool is_world = recording.frame() == PointFrame::kWorld;
  if (has_wrong_origin(recording)) add([](RecordingOptions& o) { o.sensor_origin.setZero(); });
  if (recording.columns().time && !is_world) add([](RecordingOptions& o) { o.deskew = !o.deskew; });
  // A short way is weak evidence, but a proposal must also agree.
  constexpr double kMinWay = 1.0;  // m
  if (recording.size() > 0 && follow_sensor(recording, kMinWay) == !is_world) {
    add([&](RecordingOptions& o) {
      o.frame = is_world ? PointFrame::kSensor : PointFrame::kWorld;
      o.deskew = false;
    });
  }
  return all;
}

}  // namespace dynains
