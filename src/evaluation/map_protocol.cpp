#include "dynains/evaluation/map_protocol.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "detail/cell_groups.hpp"
#include "detail/nearest.hpp"
#include "detail/preservation.hpp"
#include "detail/radius_lookup.hpp"
#include "detail/range_gate.hpp"
#include "detail/scan_voxels.hpp"
#include "detail/voxel_grid.hpp"
#include "detail/voxel_index.hpp"
#include "dynains/errors.hpp"

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
    for_each_point(scan, [this](const float* xyz, const Eigen::Vector3d& p, Truth truth) {
      if (gate_.passes(xyz)) note_truth(p, truth);
      if (truth != Truth::kIgnored && point_gate_.passes(xyz)) count_point(p, truth);
    });
    finished_first_pass_ = false;
  }

  void resolve(const LabelledScan& scan) {
    finish_first_pass();
    if (near_mixed_.size() == 0) return;
    for_each_point(scan, [this](const float* xyz, const Eigen::Vector3d& p, Truth truth) {
      if (gate_.passes(xyz)) approach(p, truth);
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

  template <class Visit>
  void for_each_point(const LabelledScan& scan, Visit&& visit) const {
    const Eigen::Matrix3d R = scan.T_world_sensor.linear();
    const Eigen::Vector3d t = scan.T_world_sensor.translation();
    for (std::size_t i = 0; i < scan.size(); ++i) {
      visit(scan.xyz + i * scan.stride, Eigen::Vector3d(R * scan.point(i) + t),
            settings_.truth(scan.truth[i]));
    }
  }

  void note_truth(const Eigen::Vector3d& p, Truth truth) {
    const VoxelKey key = grid_.key(p);
    if (key == detail::kNoKey) return;
    const std::uint32_t number = measured_.insert(key);
    if (number == measured_truths_.size()) measured_truths_.push_back(0);
    measured_truths_[number] |= truth_bit(truth);
  }

  void count_point(const Eigen::Vector3d& p, Truth truth) {
    const bool kept = lookup_.contains(p);
    if (truth == Truth::kStatic) {
      ++point_score_.static_total;
      point_score_.static_kept += kept;
    } else {
      ++point_score_.dynamic_total;
      point_score_.dynamic_removed += !kept;
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
      for (const VoxelKey offset : detail::kNeighbours) {
        const std::uint32_t number = measured_.find(groups_.key(cell) + offset);
        if (number != VoxelIndex::kNone) truths_[cell] |= measured_truths_[number];
      }
      if (!is_mixed(cell)) continue;
      for (const VoxelKey offset : detail::kNeighbours) {
        near_mixed_.insert(groups_.key(cell) + offset);
      }
    }
  }

  bool is_mixed(std::size_t cell) const {
    return (truths_[cell] & (truths_[cell] - 1)) != 0;  // more than one bit
  }

  /// Updates the nearest measured point of the map points in mixed voxels around `p`.
  void approach(const Eigen::Vector3d& p, Truth truth) {
    const VoxelKey key = grid_.key(p);
    if (key == detail::kNoKey || near_mixed_.find(key) == VoxelIndex::kNone) return;
    for (const VoxelKey offset : detail::kNeighbours) {
      const std::uint32_t cell = groups_.index().find(key + offset);
      if (cell == VoxelIndex::kNone || !is_mixed(cell)) continue;
      // Skips voxels whose points all have a nearer measured point already: most, in dense maps.
      if (grid_.squared_distance(p, key + offset) >= farthest_[cell]) continue;
      Mixed* mixed = &mixed_[groups_.first(cell)];
      double farthest = 0;
      for (const std::uint32_t i : groups_.points(cell)) {
        const double distance = (map_[i] - p).squaredNorm();
        if (distance < mixed->nearest) *mixed = {distance, truth};
        farthest = std::max(farthest, mixed->nearest);
        ++mixed;
      }
      farthest_[cell] = farthest;
    }
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
