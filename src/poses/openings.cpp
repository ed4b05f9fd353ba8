#include "openings.hpp"

#include <cstddef>
#include <utility>

#include "dynains/median.hpp"
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

std::vector<RecordingOptions> other_options(const Recording& recording,
                                            const std::optional<Eigen::Vector3d>& ray_origin) {
  std::vector<RecordingOptions> all;
  const auto add = [&](auto&& change) {
    all.push_back(recording.options());
    change(all.back());
  };
  const bool is_world = recording.frame() == PointFrame::kWorld;
  if (ray_origin) {
    constexpr double kSame = 0.1;  // m
    add([&](RecordingOptions& o) {
      o.sensor_origin = *ray_origin;
      if (ray_origin->norm() < kSame) o.sensor_origin.setZero();
      o.sensor_frame.clear();
    });
  }
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
