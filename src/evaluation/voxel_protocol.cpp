#include "dynains/evaluation/voxel_protocol.hpp"

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
    Points points(*this, scan);
    voxelise(points, [](VoxelKey) { return true; });
    scan_voxels_.for_each(
        all_layers_, points, [this](VoxelKey key) { prefetch_index(key); },
        [this](VoxelKey key) { prefetch(key); },
        [this](VoxelKey key, LayerMask layers, const Eigen::Vector3d& centroid, Truth truth) {
          accumulate(key, layers, centroid, truth);
        });
    finished_first_pass_ = false;
  }

  void resolve(const LabelledScan& scan) {
    finish_first_pass();
    if (pending_.size() == 0) return;
    Points points(*this, scan);
    // Consecutive points often have one voxel.
    VoxelKey last = detail::kNoKey;
    bool is_last_pending = false;
    voxelise(points, [&](VoxelKey key) {
      if (key != last) is_last_pending = pending_.find(key) != detail::VoxelIndex::kNone;
      last = key;
      return is_last_pending;
    });
    scan_voxels_.for_each(
        all_layers_, points, [](VoxelKey) {}, [](VoxelKey) {},
        [this](VoxelKey key, LayerMask layers, const Eigen::Vector3d& centroid, Truth truth) {
          const Voxel& voxel = voxels_[index_.find(key)];
          double* nearest = &nearest_[pending_.find(key) * layers_];
          for (std::size_t layer = 0; layer < layers_; ++layer) {
            if ((layers >> layer & 1U) == 0) continue;
            Cell& cell = forks_[voxel.fork + layer];
            const double distance = (centroid - cell.centroid()).squaredNorm();
            if (detail::is_nearer(distance, nearest[layer])) {
              nearest[layer] = distance;
              cell.truths = truth_bit(truth);
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

  // The points of a scan with their voxels.
  class Points {
   public:
    Points(const Impl& protocol, const LabelledScan& scan)
        : protocol_(protocol), scan_(scan), located_(scan, *protocol.grid_) {}

    // False for a point that is not judged.
    bool is_judged(std::size_t i) const {
      return protocol_.settings_.truth(scan_.truth[i]) != Truth::kIgnored &&
             protocol_.gate_.passes(scan_.xyz + i * scan_.stride);
    }
    detail::LocatedPoints& located() { return located_; }
    detail::ScanPoint operator()(std::size_t i) const {
      const Eigen::Vector3d p_world = located_.p_world(i);
      return at(i, p_world, protocol_.grid_->key(p_world));
    }
    detail::ScanPoint at(std::size_t i, const Eigen::Vector3d& p_world, VoxelKey key) const {
      detail::ScanPoint point;
      point.p_world = p_world;
      point.key = key;
      point.truth = protocol_.settings_.truth(scan_.truth[i]);
      unsigned layers = 1U << kIdentity;
      if (point.truth == Truth::kStatic) layers |= 1U << kOracle;
      if (!scan_.in_map.empty()) layers |= static_cast<unsigned>(scan_.in_map[i]) << kFirstEstimate;
      point.layers = static_cast<LayerMask>(layers & protocol_.all_layers_);
      return point;
    }

   private:
    const Impl& protocol_;
    const LabelledScan& scan_;
    detail::LocatedPoints located_;
  };

  template <class Wanted>
  void voxelise(Points& points, Wanted&& wanted) {
    scan_voxels_.clear();
    points.located().for_each([&](VoxelKey key) { scan_voxels_.prefetch(key); },
                              [&](std::size_t i, const Eigen::Vector3d& p_world, VoxelKey key) {
                                if (key == detail::kNoKey || !wanted(key) || !points.is_judged(i))
                                  return;
                                scan_voxels_.add(points.at(i, p_world, key), i);
                              });
  }

  void prefetch_index(VoxelKey key) const {
    __builtin_prefetch(&index_.first_slot(voxel_hash(key)));
  }
  void prefetch(VoxelKey key) const {
    const detail::VoxelIndex::Slot& slot = index_.first_slot(voxel_hash(key));
    if (slot.number >= voxels_.size()) return;
    __builtin_prefetch(&voxels_[slot.number]);
    __builtin_prefetch(&voxels_[slot.number].fork);
  }

  void accumulate(VoxelKey key, LayerMask layers, const Eigen::Vector3d& centroid, Truth truth) {
    const std::uint32_t number = index_.insert(key);
    if (number == voxels_.size()) voxels_.push_back({key, {}, kNotForked});
    Voxel& voxel = voxels_[number];
    if (voxel.fork == kNotForked && layers == all_layers_) {
      voxel.shared.add(centroid, truth);
      return;
    }
    if (voxel.fork == kNotForked) {
      voxel.fork = static_cast<std::uint32_t>(forks_.size());
      forks_.resize(forks_.size() + layers_, voxel.shared);
    }
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      if ((layers >> layer & 1U) != 0) forks_[voxel.fork + layer].add(centroid, truth);
    }
  }

  /// Collects the voxels with points of both classes in some layer. All of them are forked: a voxel
  /// with equal layers has no dynamic point, because the oracle layer has none.
  void finish_first_pass() {
    if (finished_first_pass_) return;
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

  detail::VoxelIndex index_;
  std::vector<Voxel> voxels_;
  std::vector<Cell> forks_;

  bool finished_first_pass_ = false;
  detail::VoxelIndex pending_;
  std::vector<double> nearest_;  // squared distance, m^2, by pending voxel and layer
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
