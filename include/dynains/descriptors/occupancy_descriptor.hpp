// Occupancy descriptors of the observations of one cluster (Eq. 5-10) and their similarity
// (Eq. 11-12).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains {

/// Describes each observation S_k of a cluster by the heights of its points in the cells of a polar
/// grid that spans the whole cluster.
///
/// The paper does not define two cases. The azimuth extent is the smallest arc that contains the
/// cluster, so that the seam at +-pi does not split a cluster. A point on the outer border belongs
/// to the last cell. According to Eq. 9 and 10, a cell whose highest point is the lowest point of
/// the cluster has height 0 and is empty.
class OccupancyDescriptor {
 public:
  struct Config {
    double cell_range = 0.25;   ///< m, s_r of Eq. 6
    double cell_azimuth = 1.5;  ///< deg, s_theta of Eq. 7
    double tau_s = 0.6;         ///< similarity below which a cluster is proposed as dynamic
    double belief_cells = 1.0;  ///< size of the cells of the belief relative to the others
    double ignored_low = 0.0;   ///< share of the height of objects over 1 m
    bool bounds_of_ends = false;

    /// The public implementation of the paper.
    static Config published() {
      Config config;
      config.belief_cells = 2.0;
      config.ignored_low = 0.2;
      config.bounds_of_ends = true;
      return config;
    }

    /// The descriptor whose heights the belief compares, or nothing if it is this one.
    std::optional<Config> of_belief() const {
      if (belief_cells == 1.0 && !bounds_of_ends) return std::nullopt;
      Config config = *this;
      config.cell_range = belief_cells * cell_range;
      config.cell_azimuth = belief_cells * cell_azimuth;
      config.belief_cells = 1.0;
      config.bounds_of_ends = false;
      return config;
    }

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"cell_range", self.cell_range, closed(0.01, 10), "m",
                        "radial size s_r of a descriptor cell (Eq. 6)"});
      visitor(Parameter{"cell_azimuth", self.cell_azimuth, closed(0.05, 45), "deg",
                        "angular size s_theta of a descriptor cell (Eq. 7)"});
      visitor(Parameter{"tau_s", self.tau_s, closed(0, 1), "",
                        "similarity below which a cluster is proposed as dynamic (Eq. 12)"});
      visitor(Parameter{"belief_cells", self.belief_cells, closed(1, 10), "",
                        "cells of the belief relative to those of the descriptor"});
      visitor(
          Parameter{"ignored_low", self.ignored_low, closed(0, 0.9), "",
                    "lowest ratio of the height of an object over 1 m that no descriptor counts"});
      visitor(Parameter{"bounds_of_ends", self.bounds_of_ends, Bounds(), "",
                        "the descriptor spans only the oldest and the newest observation"});
    }

    /// Throws ConfigError.
    void validate() const {
      validate_parameters("OccupancyDescriptor", *this);
      // Largest possible grid: a cluster around the sensor with the largest cluster_range.
      constexpr double kMaxRange = 1000.0;  // m
      constexpr double kMaxCells = 1 << 26;
      const double cells = 360.0 / cell_azimuth * (kMaxRange / cell_range);
      if (!(cells <= kMaxCells)) {
        throw ConfigError("OccupancyDescriptor: cell_range = " + std::to_string(cell_range) +
                          " and cell_azimuth = " + std::to_string(cell_azimuth) + " make " +
                          std::to_string(cells) + " cells up to " + std::to_string(kMaxRange) +
                          " m; at most " + std::to_string(kMaxCells) + " are possible");
      }
    }
  };

  OccupancyDescriptor() : OccupancyDescriptor(Config()) {}

  /// Throws ConfigError.
  explicit OccupancyDescriptor(const Config& config) : config_(config) { config_.validate(); }

  const Config& config() const { return config_; }

  /// Computes the grid of Eq. 5-8 for a cluster and the heights of its oldest and newest
  /// observation. The cluster must be comparable (ClusterSet::comparable): it has points in the
  /// newest scan and in an earlier one. The memory that the view refers to must stay valid until
  /// the next call.
  void describe(const ClusterView& cluster) {
    cluster_ = cluster;
    oldest_ = cluster.oldest();
    compute_grid();
    const std::size_t scans = cluster_.scan_count();
    heights_.resize(std::max(heights_.size(), 2 * scans * cell_count()));
    fill(oldest_);
    fill(scans - 1);
  }

  /// Computes the heights of the other observations, and cluster_heights(). The belief requires
  /// them, the similarity does not. Not with `bounds_of_ends`.
  void describe_rest() {
    const std::size_t scans = cluster_.scan_count();
    for (std::size_t k = 0; k + 1 < scans; ++k) {
      if (k != oldest_) fill(k);
    }
    const std::size_t cells = cell_count();
    float* cluster = heights_.data() + scans * cells;
    std::copy_n(heights_.data(), cells, cluster);
    for (std::size_t k = 1; k < scans; ++k, cluster += cells) {
      const float* const observation = heights_.data() + k * cells;
      for (std::size_t i = 0; i < cells; ++i) {
        cluster[cells + i] = std::max(cluster[i], observation[i]);
      }
    }
  }

  std::size_t radial_cells() const { return radial_cells_; }    ///< N_r (Eq. 6)
  std::size_t azimuth_cells() const { return azimuth_cells_; }  ///< N_theta (Eq. 7)
  std::size_t cell_count() const { return radial_cells_ * azimuth_cells_; }
  std::size_t scan_count() const { return cluster_.scan_count(); }  ///< K of Eq. 3, or less
  /// The first scan with an observation.
  std::size_t oldest() const { return oldest_; }

  /// H_k by cell, radial index slowest: height of the highest point over the lowest point of the
  /// cluster, m (Eq. 9-10). 0 <= k < scan_count().
  Span<const float> heights(std::size_t k) const {
    return {heights_.data() + k * cell_count(), cell_count()};
  }

  /// Maximum of the heights of observations 0 to k by cell, m: h_{t1:tk} of Eq. 16. Requires
  /// describe_rest().
  Span<const float> cluster_heights(std::size_t k) const { return heights(scan_count() + k); }

  /// Cosine similarity d of newest and oldest observation (Eq. 11), in [0, 1]. If all heights of
  /// one observation are 0, the similarity is 0; if all heights of both are 0, it is 1.
  double similarity() const {
    const Span<const float> a = heights(oldest_);
    const Span<const float> b = heights(scan_count() - 1);
    detail::Float8 dot(0.0F), aa(0.0F), bb(0.0F);
    std::size_t i = 0;
    for (; i + detail::kPackWidth <= a.size(); i += detail::kPackWidth) {
      const detail::Float8 ai = detail::Float8::load(&a[i]);
      const detail::Float8 bi = detail::Float8::load(&b[i]);
      dot = dot + ai * bi;
      aa = aa + ai * ai;
      bb = bb + bi * bi;
    }
    double dot_sum = sum(dot);
    double aa_sum = sum(aa);
    double bb_sum = sum(bb);
    for (; i < a.size(); ++i) {
      dot_sum += a[i] * b[i];
      aa_sum += a[i] * a[i];
      bb_sum += b[i] * b[i];
    }
    if (aa_sum == 0.0 && bb_sum == 0.0) return 1.0;
    if (aa_sum == 0.0 || bb_sum == 0.0) return 0.0;
    return std::min(1.0, dot_sum / std::sqrt(aa_sum * bb_sum));
  }

  /// Whether the cluster is an initial dynamic proposal: similarity() < tau_s (Eq. 12).
  bool proposes_dynamic() const { return similarity() < config_.tau_s; }

 private:
  void compute_grid() {
    using detail::PackConstant;
    const PolarView& points = cluster_.window;
    // The first point pads incomplete packs, because it does not change the extents.
    const std::size_t first = cluster_.ranges[0].begin;
    const PackConstant first_range(points.range[first]), first_azimuth(points.azimuth[first]);
    const PackConstant first_z(points.z[first]), first_wrapped(wrapped(points.azimuth[first]));
    const PackConstant zero(0.0F), turn(2.0F * detail::kPi);
    // Azimuth extents for a seam at +-pi and for a seam at 0. The smaller extent is the smallest
    // arc if it is at most pi.
    float range_max = 0.0F, low = 0.0F, high = 0.0F, low_wrapped = 0.0F, high_wrapped = 0.0F;
    detail::with_packs([&](auto packs) {
      using Packs = decltype(packs);
      using Float = typename Packs::Float;
      Float range_low = first_range, range_high = first_range, z_low = first_z;
      Float azimuth_low = first_azimuth, azimuth_high = first_azimuth;
      Float wrapped_low = first_wrapped, wrapped_high = first_wrapped;
      const auto extend = [&](const auto& at) {
        const Float range = at.padded(at.load_all(points.range.data()), first_range);
        const Float azimuth = at.padded(at.load_all(points.azimuth.data()), first_azimuth);
        const Float z = at.padded(at.load_all(points.z.data()), first_z);
        range_low = min(range_low, range);
        range_high = max(range_high, range);
        z_low = min(z_low, z);
        azimuth_low = min(azimuth_low, azimuth);
        azimuth_high = max(azimuth_high, azimuth);
        const Float on = azimuth + keep(azimuth < zero, Float(turn));
        wrapped_low = min(wrapped_low, on);
        wrapped_high = max(wrapped_high, on);
      };
      for_bounding_ranges(
          [&](const PointRange& part) { detail::for_slices<Packs>(part.begin, part.end, extend); });
      range_min_ = smallest(range_low);
      range_max = largest(range_high);
      z_min_ = smallest(z_low);
      low = smallest(azimuth_low);
      high = largest(azimuth_high);
      low_wrapped = smallest(wrapped_low);
      high_wrapped = largest(wrapped_high);
    });
    float extent = high - low;
    azimuth_min_ = low;
    if (high_wrapped - low_wrapped < extent) {
      extent = high_wrapped - low_wrapped;
      azimuth_min_ = low_wrapped;
    }
    if (extent > detail::kPi) extent = find_smallest_arc(extent);

    lowest_counted_ = config_.ignored_low > 0.0 ? find_lowest_counted() : 0.0F;
    cells_per_metre_ = static_cast<float>(1.0 / config_.cell_range);
    cells_per_radian_ = static_cast<float>(180.0 / (M_PI * config_.cell_azimuth));
    radial_cells_ = cells((range_max - range_min_) * cells_per_metre_);
    azimuth_cells_ = cells(extent * cells_per_radian_);
  }

  // Height over z_min_ (m) above which points of the cluster have a height.
  float find_lowest_counted() const {
    float highest = z_min_;
    for_bounding_ranges([&](const PointRange& part) {
      for (std::size_t i = part.begin; i < part.end; ++i) {
        highest = std::max(highest, cluster_.window.z[i]);
      }
    });
    const float height = highest - z_min_;
    return height > 1.0F ? static_cast<float>(config_.ignored_low) * height : 0.0F;  // m
  }

  // Calls `work` with the ranges of points that the grid spans.
  template <class Work>
  void for_bounding_ranges(Work&& work) const {
    if (!config_.bounds_of_ends) {
      for (const PointRange& part : cluster_.ranges) work(part);
      return;
    }
    for (const std::size_t k : {oldest_, cluster_.scan_count() - 1}) {
      for (const PointRange& part : cluster_.scan(k)) work(part);
    }
  }

  static std::size_t cells(float extent) {
    return static_cast<std::size_t>(std::max(1.0F, std::ceil(extent)));
  }

  // Azimuth in [0, 2 pi).
  static float wrapped(float azimuth) {
    return azimuth < 0.0F ? azimuth + 2.0F * detail::kPi : azimuth;
  }

  // Smallest arc of a cluster with an extent above pi. The seam is put into the widest gap of an
  // azimuth histogram.
  float find_smallest_arc(float whole_extent) {
    constexpr std::size_t kBins = 1024;
    constexpr float kBinsPerRadian = static_cast<float>(kBins) / (2.0F * detail::kPi);
    bin_is_occupied_.assign(kBins, 0);
    const float* const azimuth = cluster_.window.azimuth.data();
    for_bounding_ranges([&](const PointRange& part) {
      for (std::size_t i = part.begin; i < part.end; ++i) {
        const auto bin = static_cast<std::size_t>(wrapped(azimuth[i]) * kBinsPerRadian);
        bin_is_occupied_[std::min(bin, kBins - 1)] = 1;
      }
    });
    std::size_t widest = 0;
    std::size_t seam = kBins;  // first occupied bin behind the widest gap
    std::size_t gap = 0;
    for (std::size_t i = 0; i < 2 * kBins; ++i) {
      if (bin_is_occupied_[i % kBins] == 0) {
        ++gap;
        continue;
      }
      if (gap > widest && i >= kBins) {
        widest = gap;
        seam = i % kBins;
      }
      gap = 0;
    }
    if (seam == kBins) return whole_extent;
    const float origin = static_cast<float>(seam) / kBinsPerRadian;
    float low = 2.0F * detail::kPi;
    float high = 0.0F;
    for_bounding_ranges([&](const PointRange& part) {
      for (std::size_t i = part.begin; i < part.end; ++i) {
        float offset = wrapped(azimuth[i]) - origin;
        if (offset < -0.5F / kBinsPerRadian) offset += 2.0F * detail::kPi;
        low = std::min(low, offset);
        high = std::max(high, offset);
      }
    });
    azimuth_min_ = origin + low;
    // In (-pi, pi], as azimuths are, so that an offset is at most one turn.
    if (azimuth_min_ > detail::kPi) azimuth_min_ -= 2.0F * detail::kPi;
    return high - low;
  }

  // Eq. 9-10 for observation k.
  void fill(std::size_t k) {
    const std::size_t cells = cell_count();
    float* const heights = heights_.data() + k * cells;
    std::fill(heights, heights + cells, 0.0F);
    using detail::PackConstant;
    const PolarView points = cluster_.window;
    // Local copies of members avoid reloads after stores that could alias them.
    const PackConstant range_min(range_min_), azimuth_min(azimuth_min_), z_min(z_min_);
    const PackConstant cells_per_metre(cells_per_metre_), cells_per_radian(cells_per_radian_);
    const PackConstant zero(0.0F), just_below(-detail::kPi * 1e-4F), turn(2.0F * detail::kPi);
    const auto row = static_cast<std::int32_t>(azimuth_cells_);
    const PackConstant lowest(lowest_counted_);
    const PackConstant last_radial(static_cast<float>(radial_cells_ - 1));
    const PackConstant last_azimuth(static_cast<float>(azimuth_cells_ - 1));
    const auto raise = [&](auto at) {
      using Float = typename decltype(at)::Float;
      const Float radial = (at.load_all(points.range.data()) - range_min) * cells_per_metre;
      Float offset = at.load_all(points.azimuth.data()) - azimuth_min;
      offset = offset + keep(offset < just_below, Float(turn));
      const Float angular = max(offset * cells_per_radian, zero);
      std::int32_t cell[detail::kPackWidth];
      float height[detail::kPackWidth];
      (multiply(truncate(min(radial, last_radial)), row) + truncate(min(angular, last_azimuth)))
          .store(cell);
      const Float above = at.load_all(points.z.data()) - z_min;
      keep(Float(lowest) < above, above).store(height);
      const std::size_t size = at.size();
      for (std::size_t i = 0; i < size; ++i) {
        float& highest = heights[cell[i]];
        highest = std::max(highest, height[i]);
      }
    };
    detail::with_packs([&](auto packs) {
      for (const PointRange& part : cluster_.scan(k)) {
        detail::for_slices<decltype(packs)>(part.begin, part.end, raise);
      }
    });
  }

  Config config_;
  ClusterView cluster_;
  float range_min_ = 0.0F;
  float azimuth_min_ = 0.0F;
  std::size_t oldest_ = 0;
  float z_min_ = 0.0F;
  float lowest_counted_ = 0.0F;  ///< m over z_min_; points above it have a height
  float cells_per_metre_ = 1.0F;
  float cells_per_radian_ = 1.0F;
  std::size_t radial_cells_ = 0;
  std::size_t azimuth_cells_ = 0;
  std::vector<float> heights_;
  std::vector<std::uint8_t> bin_is_occupied_;
};

}  // namespace dynains
