// PR, RR and F1 according to ERASOR (Lim et al., RA-L 2021), scan by scan.
#pragma once

#include <Eigen/Core>
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
  void add(const LabelledScan& scan);

  /// Second pass. If the scans differ from those of add(), the scores are unspecified.
  void resolve(const LabelledScan& scan);

  /// Score of a Row: kIdentity, kOracle, or kFirstEstimate + e.
  Score score(std::size_t row) const;

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

  template <class IsNeeded, class Visit>
  void voxelise(const LabelledScan& scan, IsNeeded&& is_needed, Visit&& visit);
  LayerMask layers_of(const LabelledScan& scan, std::size_t i, Truth truth) const;

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
