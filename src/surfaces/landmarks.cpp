#include "dynains/surfaces/landmarks.hpp"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <optional>
#include <utility>

#include "dynains/surfaces/surface_grid.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {
namespace {

constexpr double kMaxGap = 1.0;  // m

std::vector<Eigen::Vector3d> select(PointsView points, const Mounting& mounting, double farthest) {
  constexpr double kOverGround = 0.5;  // m; ground agrees under every motion along it
  constexpr double kVoxel = 0.25;      // m
  VoxelHashTable<> occupied;
  std::vector<std::pair<VoxelKey, Eigen::Vector3d>> kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p(points.x[i], points.y[i], points.z[i]);
    const double range = p.norm();
    if (!(range > kMinPoint && range < farthest)) continue;
    if (mounting.known && mounting.up_sensor.dot(p) + mounting.height < kOverGround) continue;
    const VoxelKey key = voxel_at(p, kVoxel);
    if (adds(occupied, key)) kept.emplace_back(key, p);
  }
  // Every n-th of them is spread over the scan.
  std::sort(kept.begin(), kept.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Eigen::Vector3d> sorted;
  sorted.reserve(kept.size());
  for (const auto& [key, p] : kept) sorted.push_back(p);
  return sorted;
}

}  // namespace

// The points, as nanoflann reads them, and the tree over them, which the first search builds.
struct Landmarks::Tree {
  explicit Tree(std::vector<Eigen::Vector3d> of) : points(std::move(of)) {}

  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }

  std::vector<Eigen::Vector3d> points;
  SurfaceGrid surfaces;
  using Distance = nanoflann::L2_Simple_Adaptor<double, Tree>;
  std::optional<nanoflann::KDTreeSingleIndexAdaptor<Distance, Tree, 3>> index;
};

Landmarks::Landmarks(PointsView points, const Mounting& mounting, double farthest)
    : tree_(std::make_unique<Tree>(select(points, mounting, farthest))) {}
Landmarks::~Landmarks() = default;
Landmarks::Landmarks(Landmarks&&) noexcept = default;
Landmarks& Landmarks::operator=(Landmarks&&) noexcept = default;

const std::vector<Eigen::Vector3d>& Landmarks::points() const { return tree_->points; }

const SurfaceGrid& Landmarks::surfaces() const {
  if (tree_->surfaces.empty()) {
    for (const Eigen::Vector3d& p : tree_->points) tree_->surfaces.insert(p);
  }
  return tree_->surfaces;
}

double Landmarks::distance_to(const Eigen::Vector3d& p) const {
  if (size() == 0) return kMaxGap;
  nanoflann::KNNResultSet<double> nearest(1);
  std::size_t index = 0;
  double squared = 0.0;
  nearest.init(&index, &squared);
  squared = kMaxGap * kMaxGap;  // farther points do not count
  if (!tree_->index) tree_->index.emplace(3, *tree_);
  tree_->index->findNeighbors(nearest, p.data(), {});
  return std::sqrt(squared);
}

Agreement Landmarks::compare(const Landmarks& other, const Pose& T_this_other) const {
  constexpr std::size_t kCompared = 1200;
  if (size() == 0 || other.size() == 0) return {};
  const std::size_t step = std::max<std::size_t>(1, other.size() / kCompared);
  std::size_t close = 0;
  std::size_t count = 0;
  double sum = 0.0;
  for (std::size_t i = 0; i < other.size(); i += step) {
    const double gap = distance_to(T_this_other * other.points()[i]);
    sum += gap;
    if (gap < kAgreeing) ++close;
    ++count;
  }
  return {static_cast<double>(close) / static_cast<double>(count), sum / static_cast<double>(count),
          count};
}

}  // namespace dynains
