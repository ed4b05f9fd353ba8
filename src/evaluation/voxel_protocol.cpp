#include "dynains/evaluation/voxel_protocol.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "detail/located_points.hpp"
#include "detail/preservation.hpp"
#include "detail/range_gate.hpp"
#include "detail/scan_voxels.hpp"
#include "detail/voxel_grid.hpp"
#include "detail/voxel_index.hpp"
#include "dynains/errors.hpp"
#include "dynains/threads/background.hpp"

namespace dynains::evaluation::detail {

/// Bits by the lower bits of the three indices of cubes of 4 x 4 x 4 voxels: small enough for the
/// fastest cache.
class VoxelFilter {
 public:
  void add(VoxelKey key) { words_[place(key) / 64] |= std::uint64_t{1} << place(key) % 64; }

  /// Takes the keys of points whose voxels were not added, except for a few. False if none is left.
  bool filter(PointBlock& block) const {
    VoxelKey all = kNoKey;
    for (std::size_t k = 0, count = block.count; k < count; ++k) {
      const VoxelKey key = block.key[k];
      const std::uint64_t is_added = words_[place(key) / 64] >> place(key) % 64 & 1U;
      block.key[k] = key | (is_added - 1);
      all &= block.key[k];
    }
    return all != kNoKey;
  }

 private:
  static std::size_t place(VoxelKey key) {
    return (key >> (2 * kVoxelKeyBits + 2) & 63U) << 10U |
           (key >> (kVoxelKeyBits + 2) & 63U) << 4U | (key >> 2U & 15U);
  }

  std::array<std::uint64_t, 1024> words_{};
};

}  // namespace dynains::evaluation::detail

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
    const auto number = [this](const VoxelKey* keys, std::size_t count, std::uint32_t* numbers) {
      index_.insert(keys, count, numbers);
      for (std::size_t k = 0; k < count; ++k) {
        if (numbers[k] == keys_.size()) keys_.push_back(keys[k]);
      }
    };
    voxelise(
        scan, [](detail::PointBlock&) { return true; }, number,
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
    const auto number = [this](const VoxelKey* keys, std::size_t count, std::uint32_t* numbers) {
      pending_.find(keys, count, numbers);
    };
    voxelise(
        scan, [this](detail::PointBlock& block) { return pending_filter_.filter(block); }, number,
        [this](const detail::ScanVoxel& found) { compare(found); });
  }

  VoxelScore score(std::size_t row) {
    finish_first_pass();
    VoxelScore score;
    const auto point_at = [&](std::uint32_t number) { return point(voxels_[number], row); };
    for (std::size_t number = 0; number < voxels_.size(); ++number) {
      const Voxel& voxel = voxels_[number];
      if (voxel.fork == kNotForked) {  // the estimate has the same point
        detail::count(score, voxel.shared.truth(), true);
        continue;
      }
      const VoxelPoint raw = *point(voxel, kIdentity);
      detail::count(score, raw.truth,
                    detail::is_preserved(raw, keys_[number], *grid_, index_, point_at));
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
  /// which layers differ gives each layer a separate cell, `forks_[fork + layer]`.
  struct Voxel {
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

  /// Calls `visit(ScanVoxel)` for the voxels of a scan. `filter(block)` may take the keys of points
  /// that are not needed, and is false if no point is. `number`: see ScanVoxels::add().
  template <class Filter, class Number, class Visit>
  void voxelise(const LabelledScan& scan, Filter&& filter, Number&& number, Visit&& visit) {
    detail::LocatedPoints points(scan, *grid_, gate_);
    scan_voxels_.clear();
    points.for_each_block([&](detail::PointBlock& block) {
      if (!filter(block)) return;
      label(scan, block);
      scan_voxels_.add(block, labels_.data(), number);
    });
    scan_voxels_.for_each(
        all_layers_, [&](std::size_t i) { return points.p_world(i); }, visit);
  }

  /// Labels the points of a block. Those that are ignored lose their key.
  void label(const LabelledScan& scan, detail::PointBlock& block) {
    // Consecutive points mostly have one label. Local copies avoid reloads after stores that could
    // alias the originals.
    const std::uint32_t* const labels = scan.truth.data() + block.first;
    const std::uint8_t* const in_map =
        scan.in_map.empty() ? nullptr : scan.in_map.data() + block.first;
    const LayerMask all_layers = all_layers_;
    std::uint32_t last_label = labels[0];
    Truth truth = settings_.truth(last_label);
    for (std::size_t k = 0, count = block.count; k < count; ++k) {
      if (labels[k] != last_label) {
        last_label = labels[k];
        truth = settings_.truth(last_label);
      }
      unsigned layers = 1U << kIdentity;
      if (truth == Truth::kStatic) layers |= 1U << kOracle;
      if (in_map != nullptr) layers |= static_cast<unsigned>(in_map[k]) << kFirstEstimate;
      labels_[k] = {truth, static_cast<LayerMask>(layers & all_layers)};
      if (truth == Truth::kIgnored) block.key[k] = detail::kNoKey;
    }
  }

  void accumulate(const std::vector<detail::ScanVoxel>& voxels) {
    constexpr std::size_t kAhead = 8;
    for (std::size_t v = 0; v < voxels.size(); ++v) {
      const std::uint32_t ahead = voxels[std::min(v + kAhead, voxels.size() - 1)].number;
      if (ahead < voxels_.size()) __builtin_prefetch(&voxels_[ahead]);
      accumulate(voxels[v]);
    }
  }

  void accumulate(const detail::ScanVoxel& found) {
    if (found.number == voxels_.size()) voxels_.emplace_back();
    Voxel& voxel = voxels_[found.number];
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

  void compare(const detail::ScanVoxel& found) {
    const Voxel& voxel = voxels_[pending_voxels_[found.number]];
    double* nearest = &nearest_[found.number * layers_];
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      if ((found.layers >> layer & 1U) == 0) continue;
      Cell& cell = forks_[voxel.fork + layer];
      const double distance = (found.centroid - cell.centroid()).squaredNorm();
      if (detail::is_nearer(distance, nearest[layer])) {
        nearest[layer] = distance;
        cell.truths = truth_bit(found.truth);
      }
    }
  }

  /// Collects the voxels with points of both classes in some layer. All of them are forked: a voxel
  /// with equal layers has no dynamic point, because the oracle layer has none.
  void finish_first_pass() {
    if (finished_first_pass_) return;
    accumulating_.wait();
    finished_first_pass_ = true;
    pending_ = {};
    pending_filter_ = {};
    pending_voxels_.clear();
    for (std::size_t number = 0; number < voxels_.size(); ++number) {
      if (!is_undecided(voxels_[number])) continue;
      pending_.insert(keys_[number]);
      pending_filter_.add(keys_[number]);
      pending_voxels_.push_back(static_cast<std::uint32_t>(number));
    }
    nearest_.assign(pending_.size() * layers_, std::numeric_limits<double>::infinity());
  }

  bool is_undecided(const Voxel& voxel) const {
    if (voxel.fork == kNotForked) return false;
    const Cell* cells = &forks_[voxel.fork];
    return std::any_of(cells, cells + layers_,
                       [](const Cell& cell) { return cell.truths == detail::kBothTruths; });
  }

  Settings settings_;
  detail::RangeGate gate_;
  std::size_t layers_;
  LayerMask all_layers_;
  std::optional<detail::VoxelGrid> grid_;
  std::array<detail::LayeredTruth, detail::PointBlock::kMost> labels_;
  detail::ScanVoxels scan_voxels_;

  detail::VoxelIndex index_;
  std::vector<VoxelKey> keys_;  // by number of voxel
  std::vector<detail::ScanVoxel> next_;

  // Belongs to the accumulating thread until accumulating_.wait().
  std::vector<detail::ScanVoxel> accumulated_;
  std::vector<Voxel> voxels_;  // by number
  std::vector<Cell> forks_;

  bool finished_first_pass_ = false;
  detail::VoxelIndex pending_;
  detail::VoxelFilter pending_filter_;
  std::vector<std::uint32_t> pending_voxels_;  // numbers of voxels, by pending voxel
  std::vector<double> nearest_;                // squared distance, m^2, by pending voxel and layer
  Background accumulating_;                    // last member: its destructor waits
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
