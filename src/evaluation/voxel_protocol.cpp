#include "dynains/evaluation/voxel_protocol.hpp"

#include <algorithm>
#include <cassert>
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
#include "detail/voxel_grid.hpp"
#include "dynains/errors.hpp"

namespace dynains::evaluation {

using detail::truth_bit;
using detail::TruthMask;

class VoxelProtocol::Impl {
 public:
  Impl(const Settings& settings, std::size_t estimates)
      : settings_(settings),
        gate_(settings.min_range, settings.max_range),
        layers_(kFirstEstimate + estimates),
        all_layers_(static_cast<LayerMask>((1U << layers_) - 1)) {
    if (!(settings.voxel > 0) || !std::isfinite(settings.voxel)) {
      throw ConfigError("VoxelProtocol.voxel = " + std::to_string(settings.voxel) +
                        " must be positive and finite");
    }
    if (estimates > kMaxEstimates) {
      throw ConfigError("VoxelProtocol evaluates at most " + std::to_string(kMaxEstimates) +
                        " estimates at once");
    }
  }

  void add(const LabelledScan& scan) {
    if (!grid_) grid_.emplace(settings_.voxel, scan.T_world_sensor.translation());
    voxelise(
        scan, [](VoxelKey) { return true; }, [this](const ScanVoxel& voxel) { accumulate(voxel); });
  }

  void resolve(const LabelledScan& scan) {
    nearest_.resize(forks_.size(), std::numeric_limits<double>::infinity());
    const auto is_forked = [this](VoxelKey key) { return forked_.find(key) != kNoIndex; };
    voxelise(scan, is_forked, [this](const ScanVoxel& voxel) { compare(voxel); });
  }

  VoxelScore score(std::size_t row) const {
    VoxelScore score;
    const auto point_at = [&](std::uint32_t number) { return point(voxels_[number], row); };
    for (std::size_t number = 0; number < voxels_.size(); ++number) {
      const Voxel& voxel = voxels_[number];
      if (voxel.fork == kNoIndex) {  // the estimate has the same point
        detail::count(score, voxel.shared.truth(), true);
        continue;
      }
      const VoxelPoint raw = *point(voxel, kIdentity);
      detail::count(score, raw.truth,
                    detail::is_preserved(raw, keys_[number], *grid_, index_, point_at));
    }
    return score;
  }

  void for_each(std::size_t row, const std::function<void(const VoxelPoint&)>& visit) const {
    for (const Voxel& voxel : voxels_) {
      if (const auto held = point(voxel, row)) visit(*held);
    }
  }

  std::size_t rows() const { return layers_; }

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

  /// The points of one layer in one voxel: at most one per scan.
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::uint32_t count = 0;
    TruthMask truths = 0;

    void add(const VoxelPoint& point) {
      sum += point.p_world;
      ++count;
      truths |= truth_bit(point.truth);
    }
    Eigen::Vector3d centroid() const { return sum / static_cast<double>(count); }
    Truth truth() const {
      return truths == truth_bit(Truth::kDynamic) ? Truth::kDynamic : Truth::kStatic;
    }
  };

  /// Most voxels have the same points in every layer, stored once in `shared`. The first scan in
  /// which layers differ gives each layer a separate cell, `forks_[fork + layer]`.
  struct Voxel {
    Cell shared;
    std::uint32_t fork = kNoIndex;
  };

  const Cell& cell(const Voxel& voxel, std::size_t layer) const {
    return voxel.fork == kNoIndex ? voxel.shared : forks_[voxel.fork + layer];
  }

  std::optional<VoxelPoint> point(const Voxel& voxel, std::size_t layer) const {
    const Cell& held = cell(voxel, layer);
    if (held.count == 0) return std::nullopt;
    return VoxelPoint{held.centroid(), held.truth()};
  }

  /// Calls `visit(ScanVoxel)` for every voxel of a scan of which `is_needed(key)`, once or, if its
  /// points differ, once per layer, in the order of their first points.
  template <class IsNeeded, class Visit>
  void voxelise(const LabelledScan& scan, IsNeeded&& is_needed, Visit&& visit) {
    points_.clear();
    detail::for_each_point(scan, *grid_, gate_,
                           [&](std::size_t i, const Eigen::Vector3d& p_world, VoxelKey key) {
                             const Truth truth = settings_.truth(scan.truth[i]);
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

  void accumulate(const ScanVoxel& found) {
    const std::uint32_t number = index_.insert(found.key);
    if (number == voxels_.size()) {
      voxels_.emplace_back();
      keys_.push_back(found.key);
    }
    Voxel& voxel = voxels_[number];
    if (voxel.fork == kNoIndex && found.layers == all_layers_) {
      voxel.shared.add(found.point);
      return;
    }
    if (voxel.fork == kNoIndex) {
      voxel.fork = static_cast<std::uint32_t>(layers_) * forked_.insert(found.key);
      forks_.resize(forks_.size() + layers_, voxel.shared);
    }
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      if ((found.layers >> layer & 1U) != 0) forks_[voxel.fork + layer].add(found.point);
    }
  }

  /// The class of a cell with points of both is that of the nearest one. All such cells are forked:
  /// a voxel with equal layers has no dynamic point, because the oracle layer has none.
  void compare(const ScanVoxel& found) {
    const std::size_t fork = layers_ * forked_.find(found.key);
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      if ((found.layers >> layer & 1U) == 0) continue;
      Cell& cell = forks_[fork + layer];
      const double squared = (found.point.p_world - cell.centroid()).squaredNorm();
      if (!detail::is_nearer(squared, nearest_[fork + layer])) continue;
      nearest_[fork + layer] = squared;
      cell.truths = truth_bit(found.point.truth);
    }
  }

  Settings settings_;
  detail::RangeGate gate_;
  std::size_t layers_;
  LayerMask all_layers_;
  std::optional<detail::VoxelGrid> grid_;
  std::vector<LayeredPoint> points_;  // of one scan

  VoxelHashTable<> index_;
  std::vector<VoxelKey> keys_;  // by number of voxel
  std::vector<Voxel> voxels_;   // by number
  VoxelHashTable<> forked_;     // a part of them
  std::vector<Cell> forks_;     // by number in forked_ and by layer

  std::vector<double> nearest_;  // squared distance of the point that decides, m^2, by fork
};

VoxelProtocol::VoxelProtocol(const Settings& settings, std::size_t estimates)
    : impl_(std::make_unique<Impl>(settings, estimates)) {}
VoxelProtocol::~VoxelProtocol() = default;
VoxelProtocol::VoxelProtocol(VoxelProtocol&&) noexcept = default;
VoxelProtocol& VoxelProtocol::operator=(VoxelProtocol&&) noexcept = default;

void VoxelProtocol::add(const LabelledScan& scan) { impl_->add(scan); }
void VoxelProtocol::resolve(const LabelledScan& scan) { impl_->resolve(scan); }

VoxelScore VoxelProtocol::score(std::size_t row) const {
  assert(row < impl_->rows());
  return impl_->score(row);
}

void VoxelProtocol::for_each(std::size_t row,
                             const std::function<void(const VoxelPoint&)>& visit) const {
  assert(row < impl_->rows());
  impl_->for_each(row, visit);
}

}  // namespace dynains::evaluation
