// PR, RR and F1 according to ERASOR (Lim et al., RA-L 2021), scan by scan.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "dynains/evaluation/config.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"
#include "evaluation/voxels.hpp"

namespace dynains::evaluation {

/// Compares the maps of several estimates with the raw map of a sequence, scan by scan.
///
/// The raw map contains the points at planar range [min_range, max_range] that are not ignored.
/// Each scan is voxelised on a world grid with edge `voxel` (VoxelPoint); all scans are
/// concatenated and voxelised again. The map of an estimate is computed equally from its kept
/// points. A raw voxel point is preserved if the nearest point of the estimate's map is nearer than
/// voxel * sqrt(3) / 2 and has an equal class.
///
/// The source point nearest to a centroid is known only when the centroid is final, so the protocol
/// needs each scan twice: call add() for each scan, then resolve() for each scan in the order of
/// add(), then score(). Memory is proportional to the number of occupied voxels and independent of
/// the number of scans.
class VoxelProtocol {
 public:
  /// `estimates`: number of estimates.
  VoxelProtocol(const EvaluationConfig& config, std::size_t estimates)
      : config_(config),
        gate_(config.min_range, config.max_range),
        layers_(kFirstEstimate + estimates),
        all_layers_(static_cast<LayerMask>((1U << layers_) - 1)) {}

  /// First pass. Points that are zero (no return), not finite, or outside of the grid around the
  /// first pose (210 km for voxel = 0.2 m) are excluded from all maps. Throws PoseError if the
  /// first pose is not finite or beyond 10^14 m.
  void add(const LabelledScan& scan) {
    if (!grid_) grid_.emplace(config_.voxel, scan.T_world_sensor.translation());
    const auto is_needed = [](VoxelKey) { return true; };
    voxelise(scan, is_needed, [&](const ScanVoxel& found) {
      const std::uint32_t number = index_.insert(found.key);
      const auto end = static_cast<std::uint32_t>(cells_.size());
      if (number == voxels_.size()) {
        voxels_.push_back({found.key, end});
        cells_.emplace_back();
      }
      Voxel& voxel = voxels_[number];
      if (!voxel.has_layers && found.layers != all_layers_) {
        cells_.resize(end + layers_, Cell(cells_[voxel.first]));
        voxel = {found.key, end, true};
      }
      for (std::size_t layer = 0; layer < (voxel.has_layers ? layers_ : 1); ++layer) {
        if ((found.layers >> layer & 1U) == 0) continue;
        Cell& cell = cells_[voxel.place(layer)];
        cell.sum += found.point.p_world;
        ++cell.count;
        cell.truths |= detail::truth_bit(found.point.truth);
      }
    });
  }

  /// Second pass. If the scans differ from those of add(), the scores are unspecified.
  void resolve(const LabelledScan& scan) {
    const auto is_mixed = [&](VoxelKey key) {
      const std::uint32_t number = index_.find(key);
      if (number == kNoIndex || !voxels_[number].has_layers) return false;
      const Cell* const cells = &cells_[voxels_[number].first];
      return std::any_of(cells, cells + layers_,
                         [](const Cell& cell) { return detail::is_mixed(cell.truths); });
    };
    voxelise(scan, is_mixed, [&](const ScanVoxel& found) {
      for (std::size_t layer = 0; layer < layers_; ++layer) {
        const std::size_t place = voxels_[index_.find(found.key)].place(layer);
        Cell& cell = cells_[place];
        if ((found.layers >> layer & 1U) == 0 || !detail::is_mixed(cell.truths)) continue;
        const double squared = (found.point.p_world - cell.centroid()).squaredNorm();
        const auto [nearest, is_first] = nearest_.try_emplace(place, squared);
        if (!is_first && !detail::is_nearer(squared, nearest->second)) continue;
        nearest->second = squared;
        cell.nearest_truth = found.point.truth;
      }
    });
  }

  /// Score of a Row: kIdentity, kOracle, or kFirstEstimate + e.
  Score score(std::size_t row) const {
    Score score;
    const auto point_at = [&](std::uint32_t number) {
      return cells_[voxels_[number].place(row)].point();
    };
    for (const Voxel& voxel : voxels_) {
      const VoxelPoint raw = *cells_[voxel.place(kIdentity)].point();
      const bool is_kept = detail::is_preserved(raw, voxel.key, *grid_, index_, point_at);
      score.add(raw.truth, 1, is_kept ? 1 : 0);
    }
    return score;
  }

  /// Calls `visit(VoxelPoint)` for each voxel point of the raw map (row kIdentity) or of the map of
  /// an estimate.
  template <class Visit>
  void for_each(std::size_t row, Visit&& visit) const {
    for (const Voxel& voxel : voxels_) {
      if (const auto held = cells_[voxel.place(row)].point()) visit(*held);
    }
  }

 private:
  /// Set of layers (subsets of the points), one bit each.
  using LayerMask = std::uint8_t;

  /// A point of a scan.
  struct LayeredPoint {
    Eigen::Vector3d p_world;
    VoxelKey key;
    Truth truth;
    LayerMask layers;
  };

  /// The points of some layers of a scan in one voxel.
  struct ScanVoxel {
    VoxelKey key;
    VoxelPoint point;
    LayerMask layers;
  };

  /// Where cells_ has those of a voxel: one of all layers or, from the first scan in which layers
  /// differ, one of each.
  struct Voxel {
    VoxelKey key;
    std::uint32_t first;
    bool has_layers = false;

    std::size_t place(std::size_t layer) const { return first + (has_layers ? layer : 0); }
  };

  /// The points of one layer in one voxel: at most one per scan.
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::uint32_t count = 0;
    detail::TruthMask truths = 0;
    Truth nearest_truth = Truth::kStatic;  ///< of points of both classes, by resolve()

    Eigen::Vector3d centroid() const { return sum / static_cast<double>(count); }
    std::optional<VoxelPoint> point() const {
      if (count == 0) return std::nullopt;
      const bool is_dynamic = truths == detail::truth_bit(Truth::kDynamic);
      return VoxelPoint{centroid(), detail::is_mixed(truths) ? nearest_truth
                                    : is_dynamic             ? Truth::kDynamic
                                                             : Truth::kStatic};
    }
  };

  // Calls `visit(ScanVoxel)` for every voxel of a scan of which `is_needed(key)`, once or, if its
  // points differ, once per layer, in the order of their first points.
  template <class IsNeeded, class Visit>
  void voxelise(const LabelledScan& scan, IsNeeded&& is_needed, Visit&& visit) {
    points_.clear();
    detail::for_each_point(scan, *grid_, gate_,
                           [&](std::size_t i, const Eigen::Vector3d& p_world, VoxelKey key) {
                             const Truth truth = config_.truth(scan.truth[i]);
                             if (truth == Truth::kIgnored || !is_needed(key)) return;
                             points_.push_back({p_world, key, truth, layers_of(scan, i, truth)});
                           });
    const detail::CellGroups groups(points_.size(),
                                    [&](std::size_t i, auto&& add) { add(points_[i].key); });
    for (std::size_t cell = 0; cell < groups.size(); ++cell) {
      const Span<const std::uint32_t> members = groups.points(cell);
      const auto visit_layers = [&](LayerMask layers) {
        const auto point = detail::voxel_point([&](auto&& add) {
          for (const std::uint32_t i : members) {
            if ((points_[i].layers & layers) != 0) add(points_[i].p_world, points_[i].truth);
          }
        });
        if (point) visit(ScanVoxel{groups.key(cell), *point, layers});
      };
      const LayeredPoint& first = points_[members[0]];
      const bool are_equal = std::all_of(members.begin(), members.end(), [&](std::uint32_t i) {
        return points_[i].truth == first.truth && points_[i].layers == first.layers;
      });
      if (are_equal) {
        visit_layers(first.layers);
        continue;
      }
      for (std::size_t layer = 0; layer < layers_; ++layer) {
        visit_layers(static_cast<LayerMask>(1U << layer));
      }
    }
  }
  LayerMask layers_of(const LabelledScan& scan, std::size_t i, Truth truth) const {
    unsigned layers = 1U << kIdentity;
    if (truth == Truth::kStatic) layers |= 1U << kOracle;
    if (!scan.in_map.empty()) layers |= static_cast<unsigned>(scan.in_map[i]) << kFirstEstimate;
    return static_cast<LayerMask>(layers & all_layers_);
  }

  EvaluationConfig config_;
  detail::RangeGate gate_;
  std::size_t layers_;
  LayerMask all_layers_;
  std::optional<detail::VoxelGrid> grid_;
  std::vector<LayeredPoint> points_;  // of one scan

  VoxelHashTable<> index_;
  std::vector<Voxel> voxels_;  // by number
  std::vector<Cell> cells_;
  // By place in cells_, of points of both classes: squared distance of nearest_truth, m^2.
  std::unordered_map<std::size_t, double> nearest_;
};

}  // namespace dynains::evaluation
