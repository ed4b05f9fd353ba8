#include "dynains/recording/returns.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "dynains/recording/world_cells.hpp"

namespace dynains {
namespace {

constexpr struct ReturnBounds {
  double key_way = 2.0;         ///< m, between two key scans
  double min_inliers = 0.6;     ///< share of points
  double max_movement = 0.05;   ///< m, of points 10 m away, of scans that fit
  double max_deviation = 0.1;   ///< m, of an alignment, at 10 m
  double map_deviation = 0.03;  ///< m, of the earlier poses around, at 10 m
  float stored_step = 0.002F;   ///< m, of stored coordinates
} kBounds;

using Steps = std::array<std::int16_t, 3>;

}  // namespace

bool ReturnToPlace::fits() const { return is_known() && movement <= kBounds.max_movement; }

bool ReturnToPlace::is_wrong() const {
  return inliers < kBounds.min_inliers || movement > kBounds.max_movement;
}

bool ReturnToPlace::is_known() const {
  return inliers >= kBounds.min_inliers && deviation <= kBounds.max_deviation;
}

// Puts the points that stand into kept_, and into the store.
void Returns::keep(PointsView points, Span<const PointLabel> verdicts) {
  const std::size_t stride = 1 + points.size() / 12000;
  kept_.points.clear();
  bytes_.clear();
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const float x = points.x[i], y = points.y[i], z = points.z[i];
    if (!is_static(verdicts[i])) continue;
    if (std::max({std::abs(x), std::abs(y), std::abs(z)}) > static_cast<float>(kTestRange))
      continue;
    kept_.points.push_back(x, y, z);
    const auto steps = [](float metres) {
      return static_cast<std::int16_t>(std::lround(metres / kBounds.stored_step));
    };
    const Steps at = {steps(x), steps(y), steps(z)};
    add_bytes(&at, 1, bytes_);
  }
  kept_.count = kept_.points.size();
}

// The planes of the scans in near_, in the frame of the nearest one. An alignment starts within
// half an edge (m) of the truth.
detail::VoxelPlanes Returns::find_planes(double edge) {
  detail::VoxelPlanes planes(edge);
  const Pose T_origin_world = near_.front()->T_world_sensor.inverse();
  for (const KeyScan* const key : near_) {
    store_.read(key->offset, key->size, bytes_);
    planes.begin_scan(T_origin_world * key->T_world_sensor);
    detail::VoxelPlanes::Block block;
    for (std::size_t i = 0; i + sizeof(Steps) <= bytes_.size(); i += sizeof(Steps)) {
      Steps at;
      std::memcpy(at.data(), bytes_.data() + i, sizeof(at));
      const auto metres = [&](std::size_t axis) {
        return static_cast<double>(kBounds.stored_step * static_cast<float>(at[axis]));
      };
      block.push_back(metres(0), metres(1), metres(2));
      if (block.is_full()) planes.add(block);
    }
    planes.add(block);
  }
  return planes;
}

// Aligns the newest key scan with those in near_. Poses may be off by more than an alignment with
// small planes finds.
ReturnToPlace Returns::aligned(const Pose& T_world_sensor) {
  const Pose T_given = near_.front()->T_world_sensor.inverse() * T_world_sensor;
  detail::VoxelPlanes planes = find_planes(1.0);
  detail::select_points(kept_, selected_);
  const ReturnToPlace result = aligned_from(T_given, T_given, planes);
  if (!result.is_wrong()) return result;
  detail::VoxelPlanes coarse_planes = find_planes(4.0);
  const detail::Alignment coarse =
      detail::PlaneAligner().align(selected_, coarse_planes, T_given, false);
  const ReturnToPlace other = aligned_from(detail::moved(T_given, coarse.found), T_given, planes);
  return other.inliers > result.inliers ? other : result;
}

ReturnToPlace Returns::aligned_from(const Pose& T_guess, const Pose& T_given,
                                    detail::VoxelPlanes& planes) const {
  const detail::Alignment alignment =
      detail::PlaneAligner().align(selected_, planes, T_guess, false);
  ReturnToPlace result = {near_.front()->scan, scans_ - 1};
  result.T_earlier_later = detail::moved(T_guess, alignment.found);
  result.distance = T_given.translation().norm();
  if (alignment.matched == 0) return result;
  result.inliers = static_cast<double>(alignment.inliers) / static_cast<double>(alignment.matched);
  const Pose T_error = result.T_earlier_later * T_given.inverse();
  const double angle = Eigen::AngleAxisd(detail::Quaternion(T_error.linear())).angle();
  result.movement =
      std::hypot((result.T_earlier_later.translation() - T_given.translation()).norm(),
                 detail::kLever * angle);
  result.deviation = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    const double lever = i < 3 ? 1.0 : detail::kLever;
    result.deviation =
        std::max(result.deviation, lever * std::sqrt(std::max(0.0, alignment.covariance[i][i])));
  }
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) result.covariance[6 * i + j] = alignment.covariance[i][j];
    const double deviation = i < 3 ? kBounds.map_deviation : kBounds.map_deviation / detail::kLever;
    result.covariance[7 * i] += deviation * deviation;
  }
  Pose R_later_map = Pose::Identity();
  R_later_map.linear() = result.T_earlier_later.linear().transpose();
  result.covariance = detail::transported_covariance(result.covariance, R_later_map);
  return result;
}

// Whether the newest scan is a key scan: as the first of an epoch, by its way, or by its time.
bool Returns::is_key(const Eigen::Vector3d& sensor, bool begins) {
  if (!keys_.empty()) way_ += (sensor - latest_).norm();
  latest_ = sensor;
  if (!begins && way_ < kBounds.key_way && scans_ - keys_.back().scan <= compared_) return false;
  way_ = 0.0;
  return true;
}

// Puts the 16 old key scans of a visit that are nearest to the sensor into near_.
void Returns::choose_near(std::uint32_t visit, const Eigen::Vector3d& sensor) {
  const auto distance = [&](const KeyScan* key) {
    return (key->T_world_sensor.translation() - sensor).norm();
  };
  near_.clear();
  for (const KeyScan& key : keys_) {
    const bool is_old = key.scan + compared_ < scans_;
    if (key.visit == visit && is_old && distance(&key) < kTestRange) near_.push_back(&key);
  }
  std::stable_sort(near_.begin(), near_.end(),
                   [&](const KeyScan* a, const KeyScan* b) { return distance(a) < distance(b); });
  near_.resize(std::min<std::size_t>(near_.size(), 16));
}

void Returns::choose_visit(const Pose& T_world_sensor) {
  std::uint32_t chosen = visits_;
  bool is_known = false, leaves = false;
  for (std::uint32_t visit = 0; visit < visits_; ++visit) {
    choose_near(visit, T_world_sensor.translation());
    if (near_.empty()) continue;
    const ReturnToPlace place = aligned(T_world_sensor);
    found_.push_back(place);
    const bool fits = place.fits();
    // Sensors up to 8 m apart see the same surfaces.
    if (visit == visit_) leaves = place.is_wrong() || (!fits && place.distance < 8.0);
    if (!fits || (is_known && visit != visit_)) continue;
    is_known = true;
    chosen = visit;
  }
  if (is_known || leaves) visit_ = chosen;
}

std::uint32_t Returns::add(PointsView points, Span<const PointLabel> verdicts,
                           const ComparedPose& pose) {
  ++scans_;
  const bool begins = keys_.empty() || pose.epoch != epoch_;
  epoch_ = pose.epoch;
  if (!is_key(pose.T_world_sensor.translation(), begins)) return visit_;
  keep(points, verdicts);
  KeyScan key = {scans_ - 1, 0, pose.T_world_sensor, store_.append(bytes_), bytes_.size()};
  if (begins) visit_ = visits_;
  choose_visit(pose.T_world_sensor);
  visits_ = std::max(visits_, visit_ + 1);
  key.visit = visit_;
  keys_.push_back(key);
  return visit_;
}

}  // namespace dynains
