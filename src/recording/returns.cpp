#include "dynains/recording/returns.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace dynains {
namespace {

constexpr double kWay = 5.0;        // m, between two key scans
constexpr double kNear = 12.0;      // m, between two sensors
constexpr float kFarthest = 60.0F;  // m, of points that count
constexpr float kStep = 0.002F;     // m, of stored coordinates
constexpr std::size_t kMostPoints = 24000;
constexpr std::size_t kMostScans = 8;

using Steps = std::array<std::int16_t, 3>;

}  // namespace

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
      return static_cast<std::int16_t>(std::lround(metres / kStep));
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
      return static_cast<double>(kStep * static_cast<float>(at[axis]));
    };
    block.push_back(T, metres(0), metres(1), metres(2));
    if (block.is_full()) planes_.add(block);
  }
  planes_.add(block);
}

// Aligns the newest key scan with those in near_.
ReturnToPlace Returns::aligned(const KeyScan& nearest, const Pose& T_world_sensor) {
  planes_.clear();
  const Pose T_origin_world = nearest.T_world_sensor.inverse();
  for (const KeyScan* const key : near_) add_planes(*key, T_origin_world);
  detail::AlignmentPoints selected(0.0, 0.0);
  selected.select(kept_, {});
  detail::PlaneAligner aligner;
  const detail::Alignment alignment =
      aligner.align(selected, planes_, T_origin_world * T_world_sensor, false);
  ReturnToPlace result = {nearest.scan, scans_ - 1};
  if (alignment.matched == 0) return result;
  result.inliers = static_cast<double>(alignment.inliers) / static_cast<double>(alignment.matched);
  result.movement = detail::movement(alignment.found);
  for (std::size_t i = 0; i < 6; ++i) {
    const double lever = i < 3 ? 1.0 : detail::kLever;
    result.deviation =
        std::max(result.deviation, lever * std::sqrt(std::max(0.0, alignment.covariance[i][i])));
  }
  return result;
}

std::optional<ReturnToPlace> Returns::add(PointsView points, Span<const PointLabel> verdicts,
                                          const Pose& T_world_sensor, std::uint32_t first) {
  const std::uint32_t scan = scans_++;
  const Eigen::Vector3d sensor = T_world_sensor.translation();
  if (!keys_.empty()) way_ += (sensor - latest_).norm();
  latest_ = sensor;
  if (!keys_.empty() && way_ < kWay) return std::nullopt;
  way_ = 0.0;
  keep(points, verdicts);
  const KeyScan newest = {scan, T_world_sensor, store_.append(bytes_), bytes_.size()};
  const auto distance = [&](const KeyScan* key) {
    return (key->T_world_sensor.translation() - sensor).norm();
  };
  near_.clear();
  for (const KeyScan& key : keys_) {
    const bool is_old = key.scan >= first && key.scan + compared_ <= scan;
    if (is_old && distance(&key) < kNear) near_.push_back(&key);
  }
  std::sort(near_.begin(), near_.end(),
            [&](const KeyScan* a, const KeyScan* b) { return distance(a) < distance(b); });
  near_.resize(std::min(near_.size(), kMostScans));
  std::optional<ReturnToPlace> result;
  if (!near_.empty()) result = aligned(*near_.front(), T_world_sensor);
  keys_.push_back(newest);
  return result;
}

}  // namespace dynains
