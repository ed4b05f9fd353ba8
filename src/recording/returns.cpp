#include "dynains/recording/returns.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace dynains {
namespace {

constexpr double kKeyWay = 2.0;         // m, between two key scans
constexpr double kLookReach = 60.0;     // m, between two sensors: that of looks at places
constexpr double kNearby = 8.0;         // m, between two sensors that see the same surfaces
constexpr double kMostMovement = 0.05;  // m, of points 10 m away, of scans that fit
constexpr float kFarthest = 60.0F;      // m, of points that count
constexpr float kStoredStep = 0.002F;   // m, of stored coordinates
constexpr std::size_t kMostPoints = 12000;
constexpr std::size_t kMostScans = 16;

using Steps = std::array<std::int16_t, 3>;

}  // namespace

bool ReturnToPlace::fits() const {
  constexpr double kMostDeviation = 0.1;  // m
  return !is_wrong() && deviation <= kMostDeviation;
}

bool ReturnToPlace::is_wrong() const {
  constexpr double kLeastInliers = 0.6;
  return inliers < kLeastInliers || movement > kMostMovement;
}

// Puts the points that stand into kept_, and into the store.
void Returns::keep(PointsView points, Span<const PointLabel> verdicts) {
  const std::size_t stride = 1 + points.size() / kMostPoints;
  kept_.points.clear();
  bytes_.clear();
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const float x = points.x[i], y = points.y[i], z = points.z[i];
    if (!is_static(verdicts[i])) continue;
    if (std::max({std::abs(x), std::abs(y), std::abs(z)}) > kFarthest) continue;
    kept_.points.push_back(x, y, z);
    const auto steps = [](float metres) {
      return static_cast<std::int16_t>(std::lround(metres / kStoredStep));
    };
    const Steps at = {steps(x), steps(y), steps(z)};
    bytes_.resize(bytes_.size() + sizeof(at));
    std::memcpy(bytes_.data() + bytes_.size() - sizeof(at), at.data(), sizeof(at));
  }
  kept_.count = kept_.points.size();
}

void Returns::add_planes(const KeyScan& key, const Pose& T_origin_world) {
  store_.read(key.offset, key.size, bytes_);
  const Pose T = T_origin_world * key.T_world_sensor;
  planes_.begin_scan(T);
  detail::VoxelPlanes::Block block;
  for (std::size_t i = 0; i + sizeof(Steps) <= bytes_.size(); i += sizeof(Steps)) {
    Steps at;
    std::memcpy(at.data(), bytes_.data() + i, sizeof(at));
    const auto metres = [&](std::size_t axis) {
      return static_cast<double>(kStoredStep * static_cast<float>(at[axis]));
    };
    block.push_back(T, metres(0), metres(1), metres(2));
    if (block.is_full()) planes_.add(block);
  }
  planes_.add(block);
}

// Aligns the newest key scan with those in near_.
ReturnToPlace Returns::aligned(const Pose& T_world_sensor) {
  planes_.clear();
  const Pose T_origin_world = near_.front()->T_world_sensor.inverse();
  for (const KeyScan* const key : near_) add_planes(*key, T_origin_world);
  detail::AlignmentPoints selected(0.0, 0.0);
  selected.select(kept_, {});
  detail::PlaneAligner aligner;
  const detail::Alignment alignment =
      aligner.align(selected, planes_, T_origin_world * T_world_sensor, false);
  ReturnToPlace result = {near_.front()->scan, scans_ - 1};
  result.distance = (T_origin_world * T_world_sensor).translation().norm();
  if (alignment.matched == 0) return result;
  result.inliers = static_cast<double>(alignment.inliers) / static_cast<double>(alignment.matched);
  result.movement = detail::movement(alignment.found);
  result.deviation = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    const double lever = i < 3 ? 1.0 : detail::kLever;
    result.deviation =
        std::max(result.deviation, lever * std::sqrt(std::max(0.0, alignment.covariance[i][i])));
  }
  return result;
}

// Whether the newest scan is a key scan: as the first of an epoch, by its way, or by its time.
bool Returns::is_key(const Eigen::Vector3d& sensor, bool begins) {
  if (!keys_.empty()) way_ += (sensor - latest_).norm();
  latest_ = sensor;
  if (!begins && way_ < kKeyWay && scans_ - keys_.back().scan <= compared_) return false;
  way_ = 0.0;
  return true;
}

// Puts the old key scans of a visit that are near the sensor into near_.
void Returns::choose_near(std::uint32_t visit, const Eigen::Vector3d& sensor) {
  const auto distance = [&](const KeyScan* key) {
    return (key->T_world_sensor.translation() - sensor).norm();
  };
  near_.clear();
  for (const KeyScan& key : keys_) {
    const bool is_old = key.scan + compared_ < scans_;
    if (key.visit == visit && is_old && distance(&key) < kLookReach) near_.push_back(&key);
  }
  std::stable_sort(near_.begin(), near_.end(),
                   [&](const KeyScan* a, const KeyScan* b) { return distance(a) < distance(b); });
  near_.resize(std::min(near_.size(), kMostScans));
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
    if (visit == visit_) leaves = place.is_wrong() || (!fits && place.distance < kNearby);
    if (!fits || (is_known && visit != visit_)) continue;
    is_known = true;
    chosen = visit;
  }
  if (is_known || leaves) visit_ = chosen;
}

std::uint32_t Returns::add(PointsView points, Span<const PointLabel> verdicts,
                           const ComparedPose& pose) {
  ++scans_;
  const bool begins = keys_.empty() || pose.begins_epoch;
  if (!is_key(pose.T_world_sensor.translation(), begins)) return visit_;
  keep(points, verdicts);
  if (begins) visit_ = visits_;
  choose_visit(pose.T_world_sensor);
  visits_ = std::max(visits_, visit_ + 1);
  keys_.push_back({scans_ - 1, visit_, pose.T_world_sensor, store_.append(bytes_), bytes_.size()});
  return visit_;
}

}  // namespace dynains
