#include "thinning.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace dynains::viewer {
namespace {

/// A bijective mixing of 64 bits: multiplications by odd numbers and shifts.
std::uint64_t mixed(std::uint64_t value) {
  value ^= value >> 31U;
  value *= 0x9E3779B97F4A7C15U;
  value ^= value >> 29U;
  value *= 0xD6E8FEB86659FD93U;
  return value ^ value >> 32U;
}

}  // namespace

ThinnedPoints::ThinnedPoints(std::size_t budget, double cell, std::size_t scans)
    : budget_(budget), cell_(cell), scans_per_cell_(scans) {}

void ThinnedPoints::add(const ViewPoint& point) {
  if (!is_first(point)) return;
  points_.push_back(point);
  // Rarely, so that the time is linear: each call goes over all points.
  if (points_.size() > 2 * budget_ + 1000) thin();
}

std::vector<ViewPoint> ThinnedPoints::take(std::size_t most) {
  while (points_.size() > most) thin();
  occupied_.clear();
  return std::move(points_);
}

bool ThinnedPoints::is_first(const ViewPoint& point) {
  std::uint64_t key = point.scan / scans_per_cell_;
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(static_cast<double>(point.local[axis]) / cell_);
    key = mixed(key) + static_cast<std::uint64_t>(static_cast<std::int64_t>(cell));
  }
  return occupied_.insert(mixed(key)).second;
}

void ThinnedPoints::thin() {
  // Scans share cells from a width of 0.6 m on.
  if (cell_ < 0.6 || scans_per_cell_ > std::numeric_limits<ViewPoint::ScanIndex>::max()) {
    cell_ *= 1.25;
  } else {
    scans_per_cell_ *= 2;
  }
  occupied_.clear();
  std::size_t kept = 0;
  for (const ViewPoint& point : points_) {
    if (is_first(point)) points_[kept++] = point;
  }
  points_.resize(kept);
}

}  // namespace dynains::viewer
