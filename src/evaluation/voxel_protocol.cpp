#include "dynains/evaluation/voxel_protocol.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "detail/located_points.hpp"
#include "detail/nearest.hpp"
#include "detail/preservation.hpp"
#include "detail/range_gate.hpp"
#include "detail/scan_voxels.hpp"
#include "detail/voxel_grid.hpp"
#include "dynains/errors.hpp"
#include "threads/background.hpp"

namespace dynains::evaluation {

using detail::LayerMask;
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
    next_.clear();
    voxelise(
        scan, [this](VoxelKey key) { scan_voxels_.prefetch(key); }, [](VoxelKey) { return true; },
        [this](const detail::ScanVoxel& voxel) { next_.push_back(voxel); });
    // The voxels of this scan are accumulated while the caller prepares the next one.
    accumulating_.wait();
    next_.swap(accumulated_);
    accumulating_.begin([this] { accumulate(accumulated_); });
    finished_first_pass_ = false;
  }

  void resolve(const LabelledScan& scan) {
    finish_first_pass();
    if (pending_.size() == 0) return;
    const auto is_pending = [this](VoxelKey key) {
      return pending_.find(key) != detail::VoxelIndex::kNone;
    };
    const auto prefetch = [this](VoxelKey key) {
      __builtin_prefetch(&pending_.first_slot(voxel_hash(key)));
    };
    voxelise(scan, prefetch, is_pending, [this](const detail::ScanVoxel& found) {
      const Voxel& voxel = voxels_[index_.find(found.key)];
      double* nearest = &nearest_[pending_.find(found.key) * layers_];
      for (std::size_t layer = 0; layer < layers_; ++layer) {
        if ((found.layers >> layer & 1U) == 0) continue;
        Cell& cell = forks_[voxel.fork + layer];
        const double distance = (found.centroid - cell.centroid()).squaredNorm();
        if (detail::is_nearer(distance, nearest[layer])) {
          nearest[layer] = distance;
          cell.truths = truth_bit(found.truth);
        }
      }
    });
  }

  VoxelScore score(std::size_t row) {
    finish_first_pass();
    VoxelScore score;
    const auto point_at = [&](std::uint32_t number) { return point(voxels_[number], row); };
    for (const Voxel& voxel : voxels_) {
      const VoxelPoint raw = *point(voxel, kIdentity);
      if (voxel.fork == kNotForked) {  // the estimate has the same point
        detail::count(score, raw.truth, true);
        continue;
      }
      detail::count(score, raw.truth,
                    detail::is_preserved(raw, voxel.key, *grid_, index_, point_at));
    }
    return score;
  }

  void for_each(std::size_t row, const std::function<void(const VoxelPoint&)>& visit) {
    finish_first_pass();
    for (const Voxel& voxel : voxels_) {
      if (const auto held = point(voxel, row)) visit(*held);
    }
  }

  std::size_t rows() const { return layers_; }

 private:
  static constexpr std::uint32_t kNotForked = 0xffffffffU;

  /// The points of one layer in one voxel: at most one per scan.
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::uint32_t count = 0;
    TruthMask truths = 0;

    void add(const Eigen::Vector3d& point, Truth truth) {
      sum += point;
      ++count;
      truths |= truth_bit(truth);
    }
    Eigen::Vector3d centroid() const { return sum / static_cast<double>(count); }
    Truth truth() const {
      return truths == truth_bit(Truth::kDynamic) ? Truth::kDynamic : Truth::kStatic;
    }
  };

  /// Most voxels have the same points in every layer, stored once in `shared`. The first scan in
  /// which layers differ gives each layer a cell of its own, `forks_[fork + layer]`.
  struct Voxel {
    VoxelKey key;
    Cell shared;
    std::uint32_t fork = kNotForked;
  };

  const Cell& cell(const Voxel& voxel, std::size_t layer) const {
    return voxel.fork == kNotForked ? voxel.shared : forks_[voxel.fork + layer];
  }

  std::optional<VoxelPoint> point(const Voxel& voxel, std::size_t layer) const {
    const Cell& held = cell(voxel, layer);
    if (held.count == 0) return std::nullopt;
    return VoxelPoint{held.centroid(), held.truth()};
  }

  /// Calls `visit(ScanVoxel)` for the voxels of a scan that are wanted. `prefetch(key)` is called
  /// some points before `wanted(key)`.
  template <class Prefetch, class Wanted, class Visit>
  void voxelise(const LabelledScan& scan, Prefetch&& prefetch, Wanted&& wanted, Visit&& visit) {
    // Consecutive points mostly have one label.
    std::uint32_t last_label = scan.size() > 0 ? scan.truth[0] : 0;
    Truth last_truth = settings_.truth(last_label);
    const auto label_of = [&](std::size_t i) {
      if (scan.truth[i] != last_label) {
        last_label = scan.truth[i];
        last_truth = settings_.truth(last_label);
      }
      unsigned layers = 1U << kIdentity;
      if (last_truth == Truth::kStatic) layers |= 1U << kOracle;
      if (!scan.in_map.empty()) layers |= static_cast<unsigned>(scan.in_map[i]) << kFirstEstimate;
      return detail::LayeredTruth{last_truth, static_cast<LayerMask>(layers & all_layers_)};
    };
    detail::LocatedPoints points(scan, *grid_, gate_);
    scan_voxels_.clear();
    points.for_each_run(prefetch, [&](const detail::PointRun& run) {
      if (wanted(run.key)) scan_voxels_.add(run, label_of);
    });
    scan_voxels_.for_each(
        all_layers_, label_of, [&](std::size_t i) { return points.p_world(i); }, visit);
  }

  void accumulate(const std::vector<detail::ScanVoxel>& voxels) {
    constexpr std::size_t kAhead = 8;
    for (std::size_t v = 0; v < voxels.size(); ++v) {
      prefetch_index(voxels[std::min(v + 2 * kAhead, voxels.size() - 1)].key);
      prefetch_voxel(voxels[std::min(v + kAhead, voxels.size() - 1)].key);
      accumulate(voxels[v]);
    }
  }
  void prefetch_index(VoxelKey key) const {
    __builtin_prefetch(&index_.first_slot(voxel_hash(key)));
  }
  void prefetch_voxel(VoxelKey key) const {
    const detail::VoxelIndex::Slot& slot = index_.first_slot(voxel_hash(key));
    if (slot.number >= voxels_.size()) return;
    __builtin_prefetch(&voxels_[slot.number]);
    __builtin_prefetch(&voxels_[slot.number].fork);
  }

  void accumulate(const detail::ScanVoxel& found) {
    const std::uint32_t number = index_.insert(found.key);
    if (number == voxels_.size()) voxels_.push_back({found.key, {}, kNotForked});
    Voxel& voxel = voxels_[number];
    if (voxel.fork == kNotForked && found.layers == all_layers_) {
      voxel.shared.add(found.centroid, found.truth);
      return;
    }
    if (voxel.fork == kNotForked) {
      voxel.fork = static_cast<std::uint32_t>(forks_.size());
      forks_.resize(forks_.size() + layers_, voxel.shared);
    }
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      if ((found.layers >> layer & 1U) == 0) continue;
      forks_[voxel.fork + layer].add(found.centroid, found.truth);
    }
  }

  /// Collects the voxels with points of both classes in some layer. All of them are forked: a voxel
  /// with equal layers has no dynamic point, because the oracle layer has none.
  void finish_first_pass() {
    if (finished_first_pass_) return;
    accumulating_.wait();
    finished_first_pass_ = true;
    pending_.clear();
    for (const Voxel& voxel : voxels_) {
      if (voxel.fork == kNotForked) continue;
      for (std::size_t layer = 0; layer < layers_; ++layer) {
        if (forks_[voxel.fork + layer].truths == detail::kBothTruths) pending_.insert(voxel.key);
      }
    }
    nearest_.assign(pending_.size() * layers_, std::numeric_limits<double>::infinity());
  }

  Settings settings_;
  detail::RangeGate gate_;
  std::size_t layers_;
  LayerMask all_layers_;
  std::optional<detail::VoxelGrid> grid_;
  detail::ScanVoxels scan_voxels_;

  std::vector<detail::ScanVoxel> next_;

  // The accumulating thread's until accumulating_.wait().
  std::vector<detail::ScanVoxel> accumulated_;
  detail::VoxelIndex index_;
  std::vector<Voxel> voxels_;
  std::vector<Cell> forks_;

  bool finished_first_pass_ = false;
  detail::VoxelIndex pending_;
  std::vector<double> nearest_;  // squared distance, m^2, by pending voxel and layer
  Background accumulating_;      // last member: its destructor waits
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
