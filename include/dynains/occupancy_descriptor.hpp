// Occupancy descriptors of the observations of one cluster (Eq. 5-10) and their similarity
// (Eq. 11-12).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/stage/cluster_set.hpp"
#include "dynains/stage/polar_points.hpp"

namespace dynains {

/// Describes each observation S_k of a cluster by the heights of its points over a polar grid that
/// spans the whole cluster.
///
/// Choices where the paper is silent: the azimuth extent is the smallest arc that holds the
/// cluster, so that a cluster behind the sensor is not torn at +-pi; a point on the outer border
/// belongs to the last cell; a cell whose highest point is the lowest of the cluster has height 0
/// and counts as empty, as Eq. 9 and 10 say to the letter.
class OccupancyDescriptor {
 public:
  struct Config {
    double cell_range = 0.25;   ///< m, s_r of Eq. 6
    double cell_azimuth = 1.5;  ///< deg, s_theta of Eq. 7
    double tau_s = 0.6;         ///< similarity below which a cluster is proposed as dynamic

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"cell_range", self.cell_range, closed(0.01, 10), "m",
                        "radial size s_r of a descriptor cell (Eq. 6)"});
      visitor(Parameter{"cell_azimuth", self.cell_azimuth, closed(0.05, 45), "deg",
                        "angular size s_theta of a descriptor cell (Eq. 7)"});
      visitor(Parameter{"tau_s", self.tau_s, closed(0, 1), "",
                        "similarity below which a cluster is proposed as dynamic (Eq. 12)"});
    }

    /// Throws ConfigError.
    void validate() const {
      validate_parameters("OccupancyDescriptor", *this);
      // A cluster may reach round the sensor, and as far as any cluster_range.
      constexpr double kFarthest = 1000.0;  // m
      constexpr double kMaxCells = 1 << 26;
      const double cells = 360.0 / cell_azimuth * (kFarthest / cell_range);
      if (!(cells <= kMaxCells)) {
        throw ConfigError("OccupancyDescriptor: cell_range = " + std::to_string(cell_range) +
                          " and cell_azimuth = " + std::to_string(cell_azimuth) + " make " +
                          std::to_string(cells) + " cells up to " + std::to_string(kFarthest) +
                          " m; at most " + std::to_string(kMaxCells) + " are possible");
      }
    }
  };

  OccupancyDescriptor() : OccupancyDescriptor(Config()) {}

  /// Throws ConfigError.
  explicit OccupancyDescriptor(const Config& config) : config_(config) { config_.validate(); }

  const Config& config() const { return config_; }

  /// Lays the grid of Eq. 5-8 over a cluster and describes its oldest and newest observation.
  /// The cluster must be comparable (ClusterSet), and outlive the calls that follow with its
  /// window.
  void describe(const ClusterView& cluster) {
    cluster_ = cluster;
    lay_grid();
    const std::size_t scans = cluster_.scan_count();
    heights_.resize(std::max(heights_.size(), 2 * scans * cell_count()));
    fill(0);
    fill(scans - 1);
  }

  /// Describes the observations between oldest and newest, and the growing cluster. The belief
  /// needs them, the similarity does not.
  void describe_rest() {
    const std::size_t scans = cluster_.scan_count();
    for (std::size_t k = 1; k + 1 < scans; ++k) fill(k);
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
  std::size_t scan_count() const { return cluster_.scan_count(); }

  /// H_k flattened, radial index slowest: metres over the lowest point of the cluster (Eq. 9-10).
  Span<const float> heights(std::size_t k) const {
    return {heights_.data() + k * cell_count(), cell_count()};
  }

  /// Heights of observations 0 to k together, h_{t1:tk} of Eq. 16; after describe_rest.
  Span<const float> cluster_heights(std::size_t k) const { return heights(scan_count() + k); }

  /// Cosine similarity d of newest and oldest observation (Eq. 11), in [0, 1]. Two observations
  /// without any height are equal (1); one without and one with are not (0).
  double similarity() const {
    const Span<const float> a = heights(0);
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

  /// Whether the cluster is an initial dynamic proposal (Eq. 12).
  bool proposes_dynamic() const { return similarity() < config_.tau_s; }

 private:
  void lay_grid() {
    using detail::PackConstant;
    const PolarView& points = cluster_.window;
    // In the place of those that are missing from the last eight, the first point changes no
    // extent.
    const std::size_t first = cluster_.ranges[0].begin;
    const PackConstant first_range(points.range[first]), first_azimuth(points.azimuth[first]);
    const PackConstant first_z(points.z[first]), first_turned(turned(points.azimuth[first]));
    const PackConstant zero(0.0F), turn(2.0F * detail::kPi);
    // Extents for the seam at +-pi and for the seam at 0: the smaller of the two is the smallest
    // arc if it is at most half a turn.
    float range_max = 0.0F, low = 0.0F, high = 0.0F, low_turned = 0.0F, high_turned = 0.0F;
    detail::run_packs([&](auto packs) {
      using Packs = decltype(packs);
      using Float = typename Packs::Float;
      Float range_low = first_range, range_high = first_range, z_low = first_z;
      Float azimuth_low = first_azimuth, azimuth_high = first_azimuth;
      Float turned_low = first_turned, turned_high = first_turned;
      const auto extend = [&](const auto& at) {
        const Float range = at.padded(at.load(points.range.data()), first_range);
        const Float azimuth = at.padded(at.load(points.azimuth.data()), first_azimuth);
        const Float z = at.padded(at.load(points.z.data()), first_z);
        range_low = min(range_low, range);
        range_high = max(range_high, range);
        z_low = min(z_low, z);
        azimuth_low = min(azimuth_low, azimuth);
        azimuth_high = max(azimuth_high, azimuth);
        const Float on = azimuth + keep(azimuth < zero, Float(turn));
        turned_low = min(turned_low, on);
        turned_high = max(turned_high, on);
      };
      for (const PointRange& part : cluster_.ranges) {
        detail::for_overlapping_slices<Packs>(part.begin, part.end, extend);
      }
      range_min_ = smallest(range_low);
      range_max = largest(range_high);
      z_min_ = smallest(z_low);
      low = smallest(azimuth_low);
      high = largest(azimuth_high);
      low_turned = smallest(turned_low);
      high_turned = largest(turned_high);
    });
    float extent = high - low;
    azimuth_min_ = low;
    if (high_turned - low_turned < extent) {
      extent = high_turned - low_turned;
      azimuth_min_ = low_turned;
    }
    if (extent > detail::kPi) extent = find_smallest_arc(extent);

    cells_per_metre_ = static_cast<float>(1.0 / config_.cell_range);
    cells_per_radian_ = static_cast<float>(180.0 / (M_PI * config_.cell_azimuth));
    radial_cells_ = cells((range_max - range_min_) * cells_per_metre_);
    azimuth_cells_ = cells(extent * cells_per_radian_);
  }

  static std::size_t cells(float extent) {
    return static_cast<std::size_t>(std::max(1.0F, std::ceil(extent)));
  }

  static float turned(float azimuth) {
    return azimuth < 0.0F ? azimuth + 2.0F * detail::kPi : azimuth;
  }

  // For clusters that reach around more than half of the sensor: the seam goes into the widest gap
  // of an azimuth histogram finer than the cells.
  float find_smallest_arc(float whole_extent) {
    constexpr std::size_t kBins = 1024;
    constexpr float kBinsPerRadian = static_cast<float>(kBins) / (2.0F * detail::kPi);
    taken_.assign(kBins, 0);
    const float* const azimuth = cluster_.window.azimuth.data();
    for (const PointRange& part : cluster_.ranges) {
      for (std::size_t i = part.begin; i < part.end; ++i) {
        const auto bin = static_cast<std::size_t>(turned(azimuth[i]) * kBinsPerRadian);
        taken_[std::min(bin, kBins - 1)] = 1;
      }
    }
    std::size_t widest = 0;
    std::size_t seam = kBins;  // first taken bin behind the widest gap
    std::size_t gap = 0;
    for (std::size_t i = 0; i < 2 * kBins; ++i) {
      if (taken_[i % kBins] == 0) {
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
    for (const PointRange& part : cluster_.ranges) {
      for (std::size_t i = part.begin; i < part.end; ++i) {
        float offset = turned(azimuth[i]) - origin;
        if (offset < -0.5F / kBinsPerRadian) offset += 2.0F * detail::kPi;
        low = std::min(low, offset);
        high = std::max(high, offset);
      }
    }
    azimuth_min_ = origin + low;
    // Back into the interval of azimuths, so that no point is more than one turn away.
    if (azimuth_min_ > detail::kPi) azimuth_min_ -= 2.0F * detail::kPi;
    return high - low;
  }

  // Eq. 9-10 for one observation.
  void fill(std::size_t k) {
    const std::size_t cells = cell_count();
    float* const heights = heights_.data() + k * cells;
    std::fill(heights, heights + cells, 0.0F);
    using detail::PackConstant;
    const PolarView points = cluster_.window;
    // Read once: the compiler cannot know that stores leave members alone.
    const PackConstant range_min(range_min_), azimuth_min(azimuth_min_), z_min(z_min_);
    const PackConstant cells_per_metre(cells_per_metre_), cells_per_radian(cells_per_radian_);
    const PackConstant zero(0.0F), just_below(-detail::kPi * 1e-4F), turn(2.0F * detail::kPi);
    const auto row = static_cast<std::int32_t>(azimuth_cells_);
    const PackConstant last_radial(static_cast<float>(radial_cells_ - 1));
    const PackConstant last_azimuth(static_cast<float>(azimuth_cells_ - 1));
    const auto raise = [&](auto at) {
      using Float = typename decltype(at)::Float;
      const Float radial = (at.load(points.range.data()) - range_min) * cells_per_metre;
      Float offset = at.load(points.azimuth.data()) - azimuth_min;
      offset = offset + keep(offset < just_below, Float(turn));
      const Float angular = max(offset * cells_per_radian, zero);
      std::int32_t cell[detail::kPackWidth];
      float height[detail::kPackWidth];
      (multiply(truncate(min(radial, last_radial)), row) + truncate(min(angular, last_azimuth)))
          .store(cell);
      (at.load(points.z.data()) - z_min).store(height);
      const std::size_t size = at.size();
      for (std::size_t i = 0; i < size; ++i) {
        float& highest = heights[cell[i]];
        highest = std::max(highest, height[i]);
      }
    };
    detail::run_packs([&](auto packs) {
      for (const PointRange& part : cluster_.scan(k)) {
        detail::for_overlapping_slices<decltype(packs)>(part.begin, part.end, raise);
      }
    });
  }

  Config config_;
  ClusterView cluster_;
  float range_min_ = 0.0F;
  float azimuth_min_ = 0.0F;
  float z_min_ = 0.0F;
  float cells_per_metre_ = 1.0F;
  float cells_per_radian_ = 1.0F;
  std::size_t radial_cells_ = 0;
  std::size_t azimuth_cells_ = 0;
  std::vector<float> heights_;
  std::vector<std::uint8_t> taken_;
};

}  // namespace dynains
