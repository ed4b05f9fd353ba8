#include "sightings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dynains::viewer {
namespace {

// Cells of equal azimuth and elevation.
constexpr int kColumns = 900;  // of 0.4 deg
constexpr int kRows = 450;     // of 0.4 deg
constexpr float kCellsPerRadian = static_cast<float>(kColumns / (2.0 * M_PI));
constexpr float kNothing = std::numeric_limits<float>::infinity();

float margin_at(float range) { return 0.3F + 0.01F * range; }

struct ImageCell {
  int row;
  int column;
};

/// `range`: norm of `p`, above 0.
ImageCell cell_of(const Eigen::Vector3f& p, float range) {
  const float azimuth = std::atan2(p.y(), p.x()) + static_cast<float>(M_PI);
  const float elevation =
      std::asin(std::clamp(p.z() / range, -1.0F, 1.0F)) + static_cast<float>(0.5 * M_PI);
  return {std::min(static_cast<int>(elevation * kCellsPerRadian), kRows - 1),
          static_cast<int>(azimuth * kCellsPerRadian) % kColumns};
}

std::size_t index_of(int row, int column) {
  return static_cast<std::size_t>(row) * kColumns + static_cast<std::size_t>(column);
}

}  // namespace

SightingFinder::SightingFinder(const std::vector<ViewPoint>& points, const ReferenceWindow& window)
    : points_(points), window_(window), sightings_(points.size()) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t scan = points[i].scan;
    if (scan >= by_scan_.size()) by_scan_.resize(scan + 1);
    by_scan_[scan].push_back(static_cast<std::uint32_t>(i));
  }
}

void SightingFinder::compare(std::size_t reference, const Pose& T_sensor_local,
                             const std::vector<float>& xyzi) {
  make_image(xyzi);
  const Eigen::Isometry3f T = T_sensor_local.cast<float>();
  const std::size_t end = std::min(by_scan_.size(), reference + window_.lookback() + 1);
  for (std::size_t scan = 0; scan < end; ++scan) {
    if (!window_.contains(scan, reference)) continue;
    const std::size_t bit = (reference - window_.first(scan)) / window_.step();
    for (const std::uint32_t point : by_scan_[scan]) {
      const Eigen::Vector3f p = T * points_[point].local;
      const float range = p.norm();
      if (!(range > 0.0F)) continue;
      const float nearest = nearest_around(p);
      const float margin = margin_at(range);
      if (nearest == kNothing || nearest < range - margin) continue;
      const bool passed = nearest > range + margin;
      (passed ? sightings_[point].passed : sightings_[point].returned) |= std::uint64_t{1} << bit;
    }
  }
}

void SightingFinder::make_image(const std::vector<float>& xyzi) {
  image_.assign(static_cast<std::size_t>(kRows) * kColumns, kNothing);
  for (std::size_t i = 0; i + 3 < xyzi.size(); i += 4) {
    const Eigen::Vector3f p(xyzi[i], xyzi[i + 1], xyzi[i + 2]);
    const float range = p.norm();
    if (!std::isfinite(range) || !(range > 0.0F)) continue;
    const ImageCell cell = cell_of(p, range);
    float& nearest = image_[index_of(cell.row, cell.column)];
    nearest = std::min(nearest, range);
  }
}

float SightingFinder::nearest_around(const Eigen::Vector3f& p) const {
  const ImageCell cell = cell_of(p, p.norm());
  float nearest = kNothing;
  for (int row = std::max(cell.row - 1, 0); row <= std::min(cell.row + 1, kRows - 1); ++row) {
    for (int step = -1; step <= 1; ++step) {
      const int column = (cell.column + step + kColumns) % kColumns;
      nearest = std::min(nearest, image_[index_of(row, column)]);
    }
  }
  return nearest;
}

}  // namespace dynains::viewer
