#include "local_map.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "symmetric_eigen.hpp"

namespace dynains::odometry {
namespace {

std::int64_t index_of(double coordinate, double edge) {
  return static_cast<std::int64_t>(std::floor(coordinate / edge));
}

}  // namespace

VoxelKey voxel_of(const Eigen::Vector3d& p, double edge) {
  return voxel_key(index_of(p.x(), edge), index_of(p.y(), edge), index_of(p.z(), edge));
}

void PointGrid::insert(const Eigen::Vector3d& point) {
  const VoxelKey key = voxel_of(point, edge_);
  const std::uint32_t number = numbers_.insert(key);
  if (number == voxels_.size()) {
    voxels_.emplace_back();
    voxels_.back().key = key;
  }
  Voxel& voxel = voxels_[number];
  if (voxel.count == kMost) return;
  for (std::uint32_t i = 0; i < voxel.count; ++i) {
    if ((voxel.points[i] - point).squaredNorm() < squared_spacing_) return;
  }
  voxel.points[voxel.count++] = point;
}

void PointGrid::forget_beyond(const Eigen::Vector3d& centre, double reach) {
  const auto is_far = [&](const Voxel& voxel) {
    return (voxel.points[0] - centre).squaredNorm() > reach * reach;
  };
  voxels_.erase(std::remove_if(voxels_.begin(), voxels_.end(), is_far), voxels_.end());
  numbers_.clear();
  for (const Voxel& voxel : voxels_) numbers_.insert(voxel.key);
}

void PointGrid::Neighbours::add(const Eigen::Vector3d& point, double squared_distance) {
  if (count == kNeighbours && squared_distance >= squared[count - 1]) return;
  std::size_t at = count < kNeighbours ? count++ : count - 1;
  for (; at > 0 && squared[at - 1] > squared_distance; --at) {
    squared[at] = squared[at - 1];
    points[at] = points[at - 1];
  }
  squared[at] = squared_distance;
  points[at] = &point;
}

PointGrid::Neighbours PointGrid::neighbours_of(const Eigen::Vector3d& point) const {
  Neighbours nearest;
  const std::int64_t x = index_of(point.x(), edge_);
  const std::int64_t y = index_of(point.y(), edge_);
  const std::int64_t z = index_of(point.z(), edge_);
  // Squared distances to the voxels before, at and behind the point along each axis.
  std::array<std::array<double, 3>, 3> gaps;
  const std::array<std::int64_t, 3> at = {x, y, z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double inside =
        point[static_cast<Eigen::Index>(axis)] - static_cast<double>(at[axis]) * edge_;
    gaps[axis] = {inside * inside, 0.0, (edge_ - inside) * (edge_ - inside)};
  }
  constexpr std::array<std::size_t, 3> kCentreFirst = {1, 0, 2};
  for (const std::size_t i : kCentreFirst) {
    for (const std::size_t j : kCentreFirst) {
      for (const std::size_t k : kCentreFirst) {
        const double gap = gaps[0][i] + gaps[1][j] + gaps[2][k];
        if (gap >= nearest.reach(edge_ * edge_)) continue;
        const auto step = [](std::size_t index) { return static_cast<std::int64_t>(index) - 1; };
        const std::uint32_t number =
            numbers_.find(voxel_key(x + step(i), y + step(j), z + step(k)));
        if (number == VoxelHashTable<>::kNone) continue;
        const Voxel& voxel = voxels_[number];
        for (std::uint32_t n = 0; n < voxel.count; ++n) {
          const double squared = (voxel.points[n] - point).squaredNorm();
          if (squared < edge_ * edge_) nearest.add(voxel.points[n], squared);
        }
      }
    }
  }
  return nearest;
}

Surface PointGrid::surface_at(const Eigen::Vector3d& point, const Eigen::Vector3d& up) const {
  constexpr std::size_t kFewest = 5;
  constexpr double kThickness = 0.1;  // m, standard deviation across a surface
  constexpr double kLine = 0.06;      // ratio of variances across and along a line
  constexpr double kFlat = 0.25;      // ratio of variances across and along a plane
  constexpr double kUpright = 0.85;   // cosine
  Surface surface;
  const Neighbours near = neighbours_of(point);
  if (near.count < kFewest) return surface;
  for (std::size_t i = 0; i < near.count; ++i) surface.mean += *near.points[i];
  surface.mean /= static_cast<double>(near.count);
  detail::SymmetricEigen<3>::Matrix scatter = {};
  for (std::size_t i = 0; i < near.count; ++i) {
    const Eigen::Vector3d d = *near.points[i] - surface.mean;
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) {
        scatter[a][b] += d[static_cast<Eigen::Index>(a)] * d[static_cast<Eigen::Index>(b)];
      }
    }
  }
  const detail::SymmetricEigen<3> eigen = detail::symmetric_eigen<3>(scatter);
  std::array<std::size_t, 3> order = {0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return eigen.values[a] < eigen.values[b]; });
  const auto value = [&](std::size_t k) {
    return eigen.values[order[k]] / static_cast<double>(near.count);
  };
  const auto direction = [&](std::size_t k) {
    return Eigen::Vector3d(eigen.vectors[order[k]].data());
  };
  surface.directions = {direction(0), direction(1)};
  const bool is_line = value(1) < kLine * value(2);
  const bool is_thin = value(0) < kThickness * kThickness && value(0) < kFlat * value(1);
  if (is_line) {
    surface.direction_count = std::abs(direction(2).dot(up)) > kUpright ? 2 : 0;
  } else if (is_thin) {
    surface.direction_count = 1;
  } else {
    surface.direction_count = 2;
    surface.variance = value(1);
  }
  return surface;
}

}  // namespace dynains::odometry
