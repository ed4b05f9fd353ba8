#include "landmarks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "dynains/voxels/voxel_hash_table.hpp"
#include "io/finite_points.hpp"

namespace dynains {
namespace {

constexpr double kCell = 1.0;         // m, edge of a column
constexpr double kFarthestGap = 1.0;  // m, at most kCell

/// Rounded down, without a call of libm.
std::int64_t floored(double value) {
  const auto number = static_cast<std::int64_t>(value);
  return number - (static_cast<double>(number) > value ? 1 : 0);
}

/// Number of a cell with this edge, m, of a grid around the sensor, in the order of x, y and z.
std::uint64_t cell_of(const Eigen::Vector3d& p, double edge) {
  std::uint64_t key = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    key = key << 16U | static_cast<std::uint64_t>(floored(p[axis] / edge) + 4096);
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
  constexpr double kVoxel = 0.25;      // m
  struct Kept {                        // the first point of each voxel
    std::uint64_t cell, voxel;
    Eigen::Vector3d point;
  };
  VoxelHashTable<> occupied;
  std::vector<Kept> kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p(points.x[i], points.y[i], points.z[i]);
    const double range = p.norm();
    if (!(range > kNearest && range < farthest)) continue;
    if (mounting.known && mounting.up_sensor.dot(p) + mounting.height < kOverGround) continue;
    const std::uint64_t voxel = cell_of(p, kVoxel);
    const bool is_first = occupied.insert(voxel) + 1 > kept.size();
    if (is_first) kept.push_back({cell_of(p, kCell), voxel, p});
  }
  std::sort(kept.begin(), kept.end(), [](const Kept& a, const Kept& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.voxel < b.voxel;
  });
  points_.reserve(kept.size());
  for (const Kept& one : kept) {
    const Eigen::Vector3d& p = one.point;
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
    const double lowest = kCell * (static_cast<double>(floored(p.z() / kCell)) - 1.0);
    auto q = std::partition_point(points_.begin() + column.begin, end,
                                  [&](const Eigen::Vector3d& at) { return at.z() < lowest; });
    for (; q != end && q->z() < lowest + 3.0 * kCell; ++q) {
      squared = std::min(squared, (p - *q).squaredNorm());
    }
  }
  return std::sqrt(squared);
}

Agreement Landmarks::compare(const Landmarks& other, const Pose& T_this_other,
                             std::size_t most) const {
  constexpr double kAgreeing = 0.3;  // m
  if (points_.empty() || other.points_.empty()) return {};
  const std::size_t step = std::max<std::size_t>(1, other.points_.size() / most);
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
  return static_cast<int>(floored(coordinate / kCell)) + half_;
}

std::size_t Landmarks::index_of(int column_x, int column_y) const {
  return static_cast<std::size_t>(column_y) +
         2 * static_cast<std::size_t>(half_) * static_cast<std::size_t>(column_x);
}

Mounting mounting_of(PointsView points) {
  constexpr std::size_t kMost = 40000;
  const std::size_t stride = 1 + points.size() / kMost;
  if (stride == 1) return estimate_mounting(points);
  PointBuffer sample;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    sample.push_back(points.x[i], points.y[i], points.z[i]);
  }
  return estimate_mounting(sample);
}

Landmarks landmarks_of(const Recording& recording, std::size_t i, RecordedScan& scan) {
  recording.read_scan(i, scan);
  const PointBuffer points = finite_points(scan);
  return Landmarks(points, mounting_of(points));
}

}  // namespace dynains
