#include "landmarks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {
namespace {

constexpr double kCell = 1.0;         // m, edge of a column
constexpr double kFarthestGap = 1.0;  // m, at most kCell

/// Number of a cell of a grid around the sensor, in the order of x, y and z.
std::uint64_t cell_of(const Eigen::Vector3d& p, double edge) {
  std::uint64_t key = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    key = key << 16U | static_cast<std::uint64_t>(std::floor(p[axis] / edge) + 4096.0);
  }
  return key;
}

/// Distance along one axis from a coordinate in cell 0 to cell `offset`, -1, 0 or 1.
double distance_to_cell(double in_cell, int offset) {
  return offset == 0 ? 0.0 : offset < 0 ? in_cell : kCell - in_cell;
}

}  // namespace

Landmarks::Landmarks(PointsView points, const Mounting& mounting, double farthest)
    : half_(static_cast<int>(std::ceil((farthest + kFarthestGap) / kCell)) + 1),
      columns_(4 * static_cast<std::size_t>(half_) * static_cast<std::size_t>(half_)) {
  constexpr double kNearest = 2.0;     // m; nearer points belong to the own vehicle
  constexpr double kOverGround = 0.5;  // m; ground agrees under every motion along it
  constexpr double kThinned = 0.25;    // m
  VoxelHashTable<> occupied;
  std::vector<std::pair<std::uint64_t, Eigen::Vector3d>> kept;  // the first point of each cell
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p(points.x[i], points.y[i], points.z[i]);
    const double range = p.norm();
    if (!(range > kNearest && range < farthest)) continue;
    if (mounting.known && mounting.up_sensor.dot(p) + mounting.height < kOverGround) continue;
    const std::uint64_t cell = cell_of(p, kThinned);
    const bool is_first = occupied.insert(cell) + 1 > kept.size();
    if (is_first) kept.emplace_back(cell, p);
  }
  const auto by_cell = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::sort(kept.begin(), kept.end(), by_cell);
  for (auto& [cell, p] : kept) cell = cell_of(p, kCell);
  std::stable_sort(kept.begin(), kept.end(), by_cell);
  points_.reserve(kept.size());
  for (const auto& [cell, p] : kept) {
    Column& column = columns_[index_of(column_of(p.x()), column_of(p.y()))];
    const auto number = static_cast<std::uint32_t>(points_.size());
    if (column.begin == column.end) column.begin = number;
    column.end = number + 1;
    points_.push_back(p);
  }
}

double Landmarks::distance_to(const Eigen::Vector3d& p) const {
  // Columns that may hold the nearest point; the own one is the most likely.
  constexpr std::array<std::array<int, 2>, 9> kOffsets = {
      {{0, 0}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {-1, 1}, {1, -1}, {1, 1}}};
  if (!(p.cwiseAbs().maxCoeff() < (half_ - 1) * kCell)) return kFarthestGap;
  const int x = column_of(p.x());
  const int y = column_of(p.y());
  const double in_x = p.x() - kCell * (x - half_);
  const double in_y = p.y() - kCell * (y - half_);
  double squared = kFarthestGap * kFarthestGap;
  for (const auto& [dx, dy] : kOffsets) {
    const double to_x = distance_to_cell(in_x, dx);
    const double to_y = distance_to_cell(in_y, dy);
    if (to_x * to_x + to_y * to_y >= squared) continue;
    const Column& column = columns_[index_of(x + dx, y + dy)];
    const auto end = points_.begin() + column.end;
    // The cells of a column ascend along z.
    const double lowest = std::floor(p.z() / kCell) - 1.0;
    auto q = std::partition_point(
        points_.begin() + column.begin, end,
        [&](const Eigen::Vector3d& at) { return std::floor(at.z() / kCell) < lowest; });
    for (; q != end && std::floor(q->z() / kCell) <= lowest + 2.0; ++q) {
      squared = std::min(squared, (p - *q).squaredNorm());
    }
  }
  return std::sqrt(squared);
}

Agreement Landmarks::compare(const Landmarks& other, const Pose& T_this_other) const {
  constexpr std::size_t kQueries = 1200;  // compared points
  constexpr double kAgreeing = 0.3;       // m
  if (points_.empty() || other.points_.empty()) return {};
  const std::size_t step = std::max<std::size_t>(1, other.points_.size() / kQueries);
  std::size_t close = 0;
  std::size_t count = 0;
  double sum = 0.0;
  for (std::size_t i = 0; i < other.points_.size(); i += step) {
    const double gap = distance_to(T_this_other * other.points_[i]);
    sum += gap;
    if (gap < kAgreeing) ++close;
    ++count;
  }
  return {static_cast<double>(close) / static_cast<double>(count), sum / static_cast<double>(count),
          count};
}

int Landmarks::column_of(double coordinate) const {
  return static_cast<int>(std::floor(coordinate / kCell)) + half_;
}

std::size_t Landmarks::index_of(int column_x, int column_y) const {
  return static_cast<std::size_t>(column_y) +
         2 * static_cast<std::size_t>(half_) * static_cast<std::size_t>(column_x);
}

Landmarks landmarks_of(const Recording& recording, std::size_t i, RecordedScan& scan) {
  recording.read_scan(i, scan);
  const PointBuffer points = finite_points(scan);
  return Landmarks(points, estimate_mounting(points));
}

}  // namespace dynains
