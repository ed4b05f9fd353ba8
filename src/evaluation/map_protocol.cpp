#include "dynains/evaluation/map_protocol.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "detail/cell_groups.hpp"
#include "detail/located_points.hpp"
#include "detail/preservation.hpp"
#include "detail/range_gate.hpp"
#include "detail/scan_voxels.hpp"
#include "detail/voxel_grid.hpp"
#include "detail/voxel_index.hpp"
#include "dynains/errors.hpp"
#include "dynains/points.hpp"

namespace dynains::evaluation::detail {

/// A finite point of the map, as the origin of voxel keys.
inline Eigen::Vector3d anchor_of(Span<const Eigen::Vector3d> points) {
  for (const Eigen::Vector3d& p : points) {
    if (p.allFinite() && p.cwiseAbs().maxCoeff() < 1e9) return p;
  }
  return Eigen::Vector3d::Zero();
}

/// Whether some map point lies within a radius.
class RadiusLookup {
 public:
  RadiusLookup(double radius, Span<const Eigen::Vector3d> points)
      : squared_radius_(radius * radius),
        points_(points),
        grid_(4 * radius, anchor_of(points)),
        cells_(points.size(), [&](std::size_t i, auto&& add) {
          const VoxelKey key = grid_.key(points[i]);
          for (const VoxelKey offset : kNeighbours) {
            const double squared =
                key == kNoKey ? 1e300 : grid_.squared_distance(points[i], key + offset);
            if (squared <= 1.001 * squared_radius_) add(key + offset);  // more than rounding
          }
        }) {}

  const VoxelGrid& grid() const { return grid_; }
  /// Numbers of the cells of grid() with a position near a map point.
  const VoxelIndex& cells() const { return cells_.index(); }
  /// `cell`: number of the cell that contains `p`.
  bool contains(const Eigen::Vector3d& p, std::uint32_t cell) const {
    for (const std::uint32_t i : cells_.points(cell)) {
      if ((points_[i] - p).squaredNorm() <= squared_radius_) return true;
    }
    return false;
  }

 private:
  double squared_radius_;
  Span<const Eigen::Vector3d> points_;
  VoxelGrid grid_;
  CellGroups cells_;  // the map points by all cells in their reach
};

}  // namespace dynains::evaluation::detail

namespace dynains::evaluation {

using detail::truth_bit;
using detail::TruthMask;
using detail::VoxelIndex;

namespace {

double positive(double value, const char* name) {
  if (value > 0 && std::isfinite(value)) return value;
  throw ConfigError("MapProtocol." + std::string(name) + " = " + std::to_string(value) +
                    " must be positive and finite");
}

}  // namespace

class MapProtocol::Impl {
 public:
  Impl(const Settings& settings, Span<const Eigen::Vector3d> map)
      : settings_(settings),
        gate_(settings.min_range, settings.max_range),
        point_gate_(settings.min_range, settings.point_max_range),
        map_(map),
        grid_(positive(settings.voxel, "voxel"), detail::anchor_of(map)),
        groups_(grid_, map),
        lookup_(positive(settings.point_radius, "point_radius"), map) {}

  void add(const LabelledScan& scan) {
    for_each_block_with_runs(scan, grid_, gate_, [&](const detail::PointBlock&) {
      measured_.insert(runs_.keys.data(), runs_.count, numbers_.data());
      for (std::size_t r = 0; r < runs_.count; ++r) note_truth(r);
    });
    for_each_block_with_runs(
        scan, lookup_.grid(), point_gate_, [&](const detail::PointBlock& block) {
          lookup_.cells().find(runs_.keys.data(), runs_.count, numbers_.data());
          for (std::size_t r = 0; r < runs_.count; ++r) count_points(block, r);
        });
    finished_first_pass_ = false;
  }

  void resolve(const LabelledScan& scan) {
    finish_first_pass();
    if (near_mixed_.size() == 0) return;
    for_each_block_with_runs(scan, grid_, gate_, [&](const detail::PointBlock& block) {
      near_mixed_.find(runs_.keys.data(), runs_.count, numbers_.data());
      for (std::size_t r = 0; r < runs_.count; ++r) {
        if (numbers_[r] != VoxelIndex::kNone) approach(block, r);
      }
    });
  }

  VoxelScore voxel_score(const VoxelProtocol& raw) {
    finish_first_pass();
    std::vector<std::optional<VoxelPoint>> estimate(groups_.size());
    for (std::size_t cell = 0; cell < groups_.size(); ++cell) estimate[cell] = voxel_point(cell);
    const auto point_at = [&](std::uint32_t cell) { return estimate[cell]; };
    VoxelScore score;
    raw.for_each(VoxelProtocol::kIdentity, [&](const VoxelPoint& point) {
      const VoxelKey key = grid_.key(point.p_world);
      detail::count(score, point.truth,
                    key != detail::kNoKey &&
                        detail::is_preserved(point, key, grid_, groups_.index(), point_at));
    });
    return score;
  }

  const PointScore& point_score() const { return point_score_; }

  std::uint64_t foreign_points() {
    finish_first_pass();
    std::uint64_t foreign = map_.size() - groups_.grouped_points();
    for (std::size_t cell = 0; cell < groups_.size(); ++cell) {
      if (truths_[cell] == 0) foreign += groups_.points(cell).size();
    }
    return foreign;
  }

 private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();

  /// A map point in a mixed map voxel: measured points around it have more than one class.
  struct Mixed {
    double nearest = kFar;  // squared distance to the nearest measured point, m^2
    Truth truth = Truth::kIgnored;
  };

  /// Numbers of the voxels around one, or kNone.
  using Around = std::array<std::uint32_t, detail::kNeighbours.size()>;

  /// Calls `visit(PointBlock)` for the blocks of the scan. `runs_`: of the block.
  template <class Visit>
  void for_each_block_with_runs(const LabelledScan& scan, const detail::VoxelGrid& grid,
                                const detail::RangeGate& gate, Visit&& visit) {
    std::uint32_t last_label = 0;
    Truth truth = settings_.truth(last_label);
    detail::LocatedPoints(scan, grid, gate).for_each_block([&](const detail::PointBlock& block) {
      for (std::size_t k = 0; k < block.count; ++k) {
        const std::uint32_t label = scan.truth[block.first + k];
        if (label != last_label) truth = settings_.truth(label);
        last_label = label;
        labels_[k] = {truth, 0};
      }
      runs_.find(block, labels_.data());
      visit(block);
    });
  }

  Truth truth_of_run(std::size_t run) const { return labels_[runs_.begins[run]].truth; }

  void note_truth(std::size_t run) {
    const std::uint32_t number = numbers_[run];
    if (number == measured_truths_.size()) measured_truths_.push_back(0);
    measured_truths_[number] |= truth_bit(truth_of_run(run));
  }

  void count_points(const detail::PointBlock& block, std::size_t run) {
    const Truth truth = truth_of_run(run);
    if (truth == Truth::kIgnored) return;
    const std::size_t begin = runs_.begins[run], end = runs_.ends[run];
    std::size_t kept = 0;
    for (std::size_t i = begin; i < end && numbers_[run] != VoxelIndex::kNone; ++i) {
      kept += lookup_.contains(block.p_world(i), numbers_[run]);
    }
    if (truth == Truth::kStatic) {
      point_score_.static_total += end - begin;
      point_score_.static_kept += kept;
    } else {
      point_score_.dynamic_total += end - begin;
      point_score_.dynamic_removed += end - begin - kept;
    }
  }

  /// Collects the classes of measured points around each map voxel. One class decides the points of
  /// the voxel; mixed voxels are decided by resolve().
  void finish_first_pass() {
    if (finished_first_pass_) return;
    finished_first_pass_ = true;
    truths_.assign(groups_.size(), 0);
    farthest_.assign(groups_.size(), kFar);
    mixed_.assign(groups_.grouped_points(), {});
    near_mixed_ = {};
    for (std::size_t cell = 0; cell < groups_.size(); ++cell) {
      for (const std::uint32_t number : around(groups_.key(cell), measured_)) {
        if (number != VoxelIndex::kNone) truths_[cell] |= measured_truths_[number];
      }
      if (!is_mixed(cell)) continue;
      for (const VoxelKey offset : detail::kNeighbours) {
        near_mixed_.insert(groups_.key(cell) + offset);
      }
    }
  }

  static Around around(VoxelKey key, const VoxelIndex& index) {
    std::array<VoxelKey, detail::kNeighbours.size()> keys = detail::kNeighbours;
    for (VoxelKey& near : keys) near += key;
    Around numbers;
    index.find(keys.data(), keys.size(), numbers.data());
    return numbers;
  }

  bool is_mixed(std::size_t cell) const {
    return (truths_[cell] & (truths_[cell] - 1)) != 0;  // more than one bit
  }

  /// Updates the nearest measured point of the map points in mixed voxels around a run.
  void approach(const detail::PointBlock& block, std::size_t run) {
    Eigen::AlignedBox3d box;
    for (std::size_t i = runs_.begins[run]; i < runs_.ends[run]; ++i) box.extend(block.p_world(i));
    for (const std::uint32_t cell : around(runs_.keys[run], groups_.index())) {
      if (cell == VoxelIndex::kNone || !is_mixed(cell)) continue;
      const Eigen::Vector3d corner = grid_.corner(groups_.key(cell));
      // Skips voxels and map points that have nearer measured points already: most, in dense maps.
      if (squared_gap(box, corner, corner.array() + grid_.edge()) >= farthest_[cell]) continue;
      double farthest = 0;
      for (std::size_t rank = 0; rank < groups_.points(cell).size(); ++rank) {
        const Eigen::Vector3d& p = map_[groups_.points(cell)[rank]];
        Mixed& mixed = mixed_[groups_.first(cell) + rank];
        if (squared_gap(box, p, p) < mixed.nearest) approach(block, run, p, mixed);
        farthest = std::max(farthest, mixed.nearest);
      }
      farthest_[cell] = farthest;
    }
  }

  static double squared_gap(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& lower,
                            const Eigen::Vector3d& upper) {
    return (box.min() - upper).cwiseMax(lower - box.max()).cwiseMax(0.0).squaredNorm();
  }

  void approach(const detail::PointBlock& block, std::size_t run, const Eigen::Vector3d& p,
                Mixed& mixed) {
    double nearest = mixed.nearest;
    for (std::size_t i = runs_.begins[run]; i < runs_.ends[run]; ++i) {
      const double squared = (p - block.p_world(i)).squaredNorm();
      nearest = squared < nearest ? squared : nearest;
    }
    if (nearest < mixed.nearest) mixed = {nearest, truth_of_run(run)};
  }

  Truth truth_of(std::size_t cell, std::size_t rank) const {
    if (is_mixed(cell)) return mixed_[groups_.first(cell) + rank].truth;
    if (truths_[cell] == truth_bit(Truth::kStatic)) return Truth::kStatic;
    return truths_[cell] == truth_bit(Truth::kDynamic) ? Truth::kDynamic : Truth::kIgnored;
  }

  std::optional<VoxelPoint> voxel_point(std::size_t cell) const {
    const Span<const std::uint32_t> points = groups_.points(cell);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t count = 0;
    for (std::size_t rank = 0; rank < points.size(); ++rank) {
      if (truth_of(cell, rank) == Truth::kIgnored) continue;
      sum += map_[points[rank]];
      ++count;
    }
    if (count == 0) return std::nullopt;
    VoxelPoint point{sum / static_cast<double>(count), Truth::kStatic};
    double nearest = kFar;
    for (std::size_t rank = 0; rank < points.size(); ++rank) {
      const Truth truth = truth_of(cell, rank);
      const double distance = (map_[points[rank]] - point.p_world).squaredNorm();
      if (truth == Truth::kIgnored || !detail::is_nearer(distance, nearest)) continue;
      nearest = distance;
      point.truth = truth;
    }
    return point;
  }

  Settings settings_;
  detail::RangeGate gate_;
  detail::RangeGate point_gate_;
  Span<const Eigen::Vector3d> map_;
  detail::VoxelGrid grid_;
  detail::CellGroups groups_;
  detail::RadiusLookup lookup_;
  PointScore point_score_;

  // The block of points that is added or resolved uses these arrays.
  std::array<detail::LayeredTruth, detail::PointBlock::kMost> labels_;  // by point
  detail::PointRuns runs_;
  std::array<std::uint32_t, detail::PointBlock::kMost> numbers_;  // by run

  VoxelIndex measured_;  // voxels that contain measured points
  std::vector<TruthMask> measured_truths_;

  bool finished_first_pass_ = false;
  std::vector<TruthMask> truths_;  // by map voxel: classes of the measured points around it
  VoxelIndex near_mixed_;          // mixed map voxels and their neighbours
  std::vector<Mixed> mixed_;       // by map point, in the order of groups_
  std::vector<double> farthest_;   // by map voxel: largest Mixed::nearest
};

MapProtocol::MapProtocol(const Settings& settings, Span<const Eigen::Vector3d> map_world)
    : impl_(std::make_unique<Impl>(settings, map_world)) {}
MapProtocol::~MapProtocol() = default;
MapProtocol::MapProtocol(MapProtocol&&) noexcept = default;
MapProtocol& MapProtocol::operator=(MapProtocol&&) noexcept = default;

void MapProtocol::add(const LabelledScan& scan) { impl_->add(scan); }
void MapProtocol::resolve(const LabelledScan& scan) { impl_->resolve(scan); }
VoxelScore MapProtocol::voxel_score(const VoxelProtocol& raw) const {
  return impl_->voxel_score(raw);
}
PointScore MapProtocol::point_score() const { return impl_->point_score(); }
std::uint64_t MapProtocol::foreign_points() const { return impl_->foreign_points(); }

}  // namespace dynains::evaluation
