#include "scan_preparation.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/median.hpp"
#include "dynains/surfaces/scan_registration.hpp"
#include "dynains/surfaces/surface_grid.hpp"
#include "dynains/surfaces/way_search.hpp"

namespace dynains::odometry {
namespace {

constexpr double kMaxOffset = 0.5;     // s from the stamp, of offsets that can be right
constexpr std::size_t kWanted = 2000;  // keypoints

}  // namespace

void ScanPreparation::take(const detail::CloudView& cloud, Span<const double> offsets) {
  measured_.resize(3 * cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    float* const p = &measured_[3 * i];
    cloud.copy(i, 1, p, p + 1, p + 2);
  }
  sensors_.resize(origins_.size() > 1 ? cloud.size() : 0);
  if (!sensors_.empty()) cloud.copy_sensors(sensors_.data());
  for (const std::uint8_t sensor : sensors_) {
    if (sensor < origins_.size()) continue;
    throw CloudError("a point is of sensor " + std::to_string(sensor) + ", there are " +
                     std::to_string(origins_.size()));
  }
  offsets_.assign(offsets.begin(), offsets.end());
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < offsets_.size(); ++i) {
    if (!is_timed(i)) continue;
    sum += offsets_[i];
    ++count;
  }
  mean_offset_ = count > 0 ? sum / static_cast<double>(count) : 0.0;
  choose_scale();
}

Eigen::Vector3d ScanPreparation::centre() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& origin : origins_) sum += origin;
  return sum / static_cast<double>(origins_.size());
}

void ScanPreparation::choose_scale() {
  constexpr double kNarrow = 4.0, kWide = 12.0;  // m, median ranges that end a scale of 1
  constexpr double kMinScale = 0.125;
  constexpr std::size_t kStep = 8;  // every 8th point
  std::vector<double> ranges;
  for (std::size_t i = 0; 3 * i < measured_.size(); i += kStep) {
    const Eigen::Map<const Eigen::Vector3f> p(&measured_[3 * i]);
    const double range = (p - origin_of(i).cast<float>()).norm();
    if (!p.isZero(0.0F) && range > kMinScale * nearest_ && range < farthest_)
      ranges.push_back(range);
  }
  if (ranges.empty()) return;
  const double middle = median(std::move(ranges));
  while (scale_ < 1.0 && middle > kWide * scale_) scale_ *= 2.0;
  while (scale_ > kMinScale && middle < kNarrow * scale_) scale_ *= 0.5;
}

/// Whether a point is a return with a time.
bool ScanPreparation::is_timed(std::size_t i) const {
  const Eigen::Map<const Eigen::Vector3f> p(&measured_[3 * i]);
  return std::abs(offsets_[i]) <= kMaxOffset && p.allFinite() && !p.isZero(0.0F);
}

/// Moves points by the nearest of equally spaced poses of the sensor.
void ScanPreparation::deskew(const Pose& motion, double period) {
  constexpr double kStep = 0.0005;  // s
  constexpr auto kSteps = static_cast<std::size_t>(4.0 * kMaxOffset / kStep);
  std::vector<Pose> T_mean_point(kSteps + 1);
  for (std::size_t k = 0; k <= kSteps; ++k) {
    const double time = static_cast<double>(k) * kStep - 2.0 * kMaxOffset;
    T_mean_point[k] = detail::scaled_motion(motion, time / period);
  }
  for (std::size_t i = 0; i < offsets_.size(); ++i) {
    if (!is_timed(i)) continue;
    Eigen::Map<Eigen::Vector3f> p(&cloud_[3 * i]);
    const double time = offsets_[i] - mean_offset_ + 2.0 * kMaxOffset;
    p = (T_mean_point[static_cast<std::size_t>(std::lround(time / kStep))] * p.cast<double>())
            .cast<float>();
  }
}

void ScanPreparation::prepare(const Pose& motion, double period) {
  cloud_ = measured_;
  if (!offsets_.empty()) deskew(motion, period);
  thin_out();
}

void ScanPreparation::thin_out() {
  constexpr double kSmall = 0.25;  // m
  const double small = scale_ * kSmall, nearest = scale_ * nearest_;
  map_points_.clear();
  taken_.clear();
  for (std::size_t i = 0; 3 * i < cloud_.size(); ++i) {
    const Eigen::Vector3d p = Eigen::Map<const Eigen::Vector3f>(&cloud_[3 * i]).cast<double>();
    const double squared = (p - origin_of(i)).squaredNorm();
    if (p.isZero(0.0) || !(squared > nearest * nearest && squared < farthest_ * farthest_))
      continue;
    if (adds(taken_, voxel_at(p, small))) map_points_.push_back({p, i});
  }
  for (used_edge_ = std::max(edge_, small);; used_edge_ = std::max(0.7 * used_edge_, small)) {
    keypoints_.clear();
    taken_.clear();
    for (const Point& point : map_points_) {
      if (adds(taken_, voxel_at(point.position, used_edge_))) keypoints_.push_back(point.position);
    }
    if (2 * keypoints_.size() > kWanted || used_edge_ == small) break;
  }
}

double ScanPreparation::expected_fit() const {
  SurfaceGrid half(true, scale_);
  std::vector<Eigen::Vector3d> others;
  VoxelHashTable<> taken;
  std::mt19937 random;  // halves by any order of points would be those of different beams
  for (const Point& point : map_points_) {
    if (random() % 2 == 0) {
      half.insert(point.position);
    } else if (adds(taken, voxel_at(point.position, used_edge_))) {
      others.push_back(point.position);
    }
  }
  return fit_of(half, others, Pose::Identity());
}

Landmarks ScanPreparation::landmarks() const {
  PointBuffer points;
  for (const Point& point : map_points_) {
    const float* const p = &cloud_[3 * point.index];
    points.push_back(p[0], p[1], p[2]);
  }
  return Landmarks(points, estimate_mounting(points), kWayRange);
}

void ScanPreparation::adapt() {
  const double share = static_cast<double>(keypoints_.size()) / static_cast<double>(kWanted);
  edge_ = std::clamp(used_edge_ * std::sqrt(std::clamp(share, 0.5, 2.0)), scale_ * 0.3,
                     scale_ * 1.5);  // m
}

}  // namespace dynains::odometry
