// Clustering on curved voxels (Park et al., "Curved-voxel clustering", IROS 2019), the paper's
// instance segmentation: points fall into cells of range, azimuth and elevation; cells that touch,
// diagonals included, belong to one cluster.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "dynains/detail/arc_tangent.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/polar_points.hpp"
#include "dynains/sensor_model.hpp"

namespace dynains {

/// Cluster number of points that belong to no cluster.
inline constexpr std::uint32_t kNoCluster = 0xFFFFFFFFU;

/// Groups points whose curved voxels are connected in the 26-neighbourhood; azimuth wraps around.
///
/// Occupied cells are bytes of a dense grid with azimuth running fastest. Each row is cut into
/// runs of occupied cells, and runs of neighbouring rows that touch are joined by union-find.
class CurvedVoxelClusterer {
 public:
  struct Config {
    double voxel_range = 0.6;      ///< m
    double voxel_azimuth = 0.0;    ///< deg, whole voxels fill the circle; 0: from the sensor
    double voxel_elevation = 0.0;  ///< deg; 0: from the sensor
    double cluster_range = 90.0;   ///< m, points farther away belong to no cluster

    /// The public implementation's voxels.
    static Config paper() {
      Config config;
      config.voxel_range = 0.5;
      config.voxel_azimuth = 0.5;
      config.voxel_elevation = 3.0;
      return config;
    }

    /// Copy with voxels that suit the sensor where they are not given: wide enough that
    /// neighbouring beams fall into neighbouring voxels.
    Config resolved(const SensorModel& sensor) const {
      Config config = *this;
      const double spacing = 0.75 * (sensor.azimuth_step + sensor.elevation_gap);
      if (voxel_azimuth == 0.0) config.voxel_azimuth = std::clamp(spacing, 0.5, 30.0);
      if (voxel_elevation == 0.0) {
        config.voxel_elevation = std::clamp(std::max(spacing, sensor.elevation_gap_wide), 1.0, 45.0);
      }
      return config;
    }

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"voxel_range", self.voxel_range, closed(0.05, 20), "m",
                        "depth of a curved voxel (public implementation of the paper)"});
      visitor(Parameter{"voxel_azimuth", self.voxel_azimuth, closed(0, 30), "deg",
                        "width of a curved voxel; 0: from the sensor"});
      visitor(Parameter{"voxel_elevation", self.voxel_elevation, closed(0, 45), "deg",
                        "height of a curved voxel; 0: from the sensor"});
      visitor(Parameter{"cluster_range", self.cluster_range, half_open_below(0, 1000), "m",
                        "points farther away belong to no cluster and stay static"});
    }

    /// Number of cells of azimuth, elevation and range together. Rows of azimuth are padded to
    /// whole words, at least 16 cells, so that a bound on cells is one on rows as well.
    double cell_count() const {
      return std::ceil(std::round(360.0 / voxel_azimuth) / 8.0) * 8.0 * std::ceil(180.0 / voxel_elevation) *
             (std::floor(cluster_range / voxel_range) + 1.0);
    }

    /// Throws ConfigError.
    void validate() const {
      validate_parameters("CurvedVoxelClusterer", *this);
      constexpr double kMaxCells = 1 << 28;
      const double cells = resolved(SensorModel::typical()).cell_count();
      if (!(cells <= kMaxCells)) {
        throw ConfigError("CurvedVoxelClusterer: voxel_range, voxel_azimuth, voxel_elevation and "
                          "cluster_range make " + std::to_string(cells) +
                          " cells; at most " + std::to_string(kMaxCells) + " are possible");
      }
    }
  };

  CurvedVoxelClusterer() : CurvedVoxelClusterer(Config()) {}

  /// Throws ConfigError.
  explicit CurvedVoxelClusterer(const Config& config) : config_((config.validate(), config)) {
    adapt(SensorModel::typical());
  }

  /// Sizes the voxels that were left to the sensor; a typical one until this is called.
  void adapt(const SensorModel& sensor) {
    resolved_ = config_.resolved(sensor);
    azimuths_ = static_cast<std::int32_t>(std::round(360.0 / resolved_.voxel_azimuth));
    ranges_ = static_cast<std::int32_t>(std::floor(config_.cluster_range / config_.voxel_range)) + 1;
    elevations_ = static_cast<std::int32_t>(std::ceil(180.0 / resolved_.voxel_elevation));
    row_bytes_ = (static_cast<std::size_t>(azimuths_) + 7) / 8 * 8;
  }

  const Config& config() const { return config_; }

  /// Cluster number per point, 0 to cluster_count() - 1 in the order in which clusters first
  /// appear among the points, or kNoCluster. The view holds until the next call.
  Span<const std::uint32_t> cluster(PolarView points) {
    find_cells(points);
    mark_cells(points.size());
    find_runs();
    join_runs();
    number_clusters(points.size());
    return {cluster_of_.data(), points.size()};
  }

  std::size_t cluster_count() const { return cluster_count_; }

 private:
  struct Run {
    std::int32_t begin, end;  // azimuth cells, end not included
    std::uint32_t parent;     // union-find; the root is the smallest run number of its set
  };

  // Cell of each point as (elevation * ranges + range) * row_bytes + azimuth; -1 if too far.
  void find_cells(PolarView points) {
    using detail::Float8;
    using detail::Int8;
    const std::size_t count = points.size();
    if (cell_of_.size() < count + detail::kLanes) {
      cell_of_.resize(count + detail::kLanes);
      cluster_of_.resize(count + detail::kLanes);
    }
    constexpr double kRadians = M_PI / 180.0;
    const Float8 azimuth_scale(static_cast<float>(azimuths_ / (2.0 * M_PI)));
    const Float8 elevation_scale(static_cast<float>(1.0 / (resolved_.voxel_elevation * kRadians)));
    const Float8 range_scale(static_cast<float>(1.0 / config_.voxel_range));
    const Float8 far(static_cast<float>(config_.cluster_range));
    const Float8 pi(detail::kPi);
    const Float8 half_pi(0.5F * detail::kPi);
    const Int8 last_azimuth(azimuths_ - 1);
    const Int8 last_elevation(elevations_ - 1);
    const Int8 last_range(ranges_ - 1);
    const Int8 row_bytes(static_cast<std::int32_t>(row_bytes_));
    const Int8 none(-1);
    Int8 lowest(elevations_);
    Int8 highest(-1);
    const auto convert = [&](const float* range, const float* azimuth, const float* height,
                             std::size_t to, detail::Mask8 valid) {
      const Float8 r = Float8::load(range);
      const Float8 z = Float8::load(height);
      const Float8 distance = sqrt(r * r + z * z);
      const detail::Mask8 near = (distance <= far) & valid;
      const Int8 i_range = min(truncate(keep(near, distance) * range_scale), last_range);
      const Int8 i_azimuth =
          min(truncate((Float8::load(azimuth) + pi) * azimuth_scale), last_azimuth);
      const Int8 i_elevation = min(
          truncate((detail::arc_tangent2(z, r) + half_pi) * elevation_scale), last_elevation);
      // Row numbers stay below 2^24 and are exact in floats; the product with the row length may
      // not be, so it is taken in integers from two exact parts.
      const Int8 i_row =
          truncate(to_float(i_elevation) * Float8(static_cast<float>(ranges_))) + i_range;
      select(near, multiply(i_row, row_bytes) + i_azimuth, none).store(&cell_of_[to]);
      lowest = min(lowest, select(near, i_elevation, lowest));
      highest = max(highest, select(near, i_elevation, highest));
    };
    const detail::Mask8 all = detail::first_lanes(detail::kLanes);
    std::size_t i = 0;
    for (; i + detail::kLanes <= count; i += detail::kLanes) {
      convert(&points.range[i], &points.azimuth[i], &points.z[i], i, all);
    }
    if (i < count) {
      float tail[3][detail::kLanes] = {};
      for (std::size_t k = i; k < count; ++k) {
        tail[0][k - i] = points.range[k];
        tail[1][k - i] = points.azimuth[k];
        tail[2][k - i] = points.z[k];
      }
      convert(tail[0], tail[1], tail[2], i, detail::first_lanes(count - i));
    }
    lowest_elevation_ = elevations_;
    highest_elevation_ = -1;
    std::int32_t low[detail::kLanes];
    std::int32_t high[detail::kLanes];
    lowest.store(low);
    highest.store(high);
    for (std::size_t k = 0; k < detail::kLanes; ++k) {
      lowest_elevation_ = std::min(lowest_elevation_, low[k]);
      highest_elevation_ = std::max(highest_elevation_, high[k]);
    }
  }

  // Product of non-negative integers below 2^24 and 2^12 whose result fits int32, by two float
  // products that are exact: SSE2 has no 32-bit integer product.
  static detail::Int8 multiply(detail::Int8 a, detail::Int8 b) {
    using detail::Int8;
    const Int8 low = a & Int8(0xFFF);
    const Int8 high = a - low;
    return detail::truncate(to_float(low) * to_float(b)) +
           detail::truncate(to_float(high) * to_float(b));
  }

  // The grid covers only the elevations that occur. It is all zero between calls.
  void mark_cells(std::size_t count) {
    if (highest_elevation_ < 0) return;
    first_cell_ = static_cast<std::size_t>(lowest_elevation_ * ranges_) * row_bytes_;
    const std::size_t cells =
        static_cast<std::size_t>((highest_elevation_ - lowest_elevation_ + 1) * ranges_) *
        row_bytes_;
    if (occupied_.size() < cells) {
      occupied_.resize(cells);
      run_of_.resize(cells);
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (cell_of_[i] >= 0) {
        occupied_[static_cast<std::size_t>(cell_of_[i]) - first_cell_] = 1;
      }
    }
  }

  std::size_t row_count() const {
    return highest_elevation_ < 0
               ? 0
               : static_cast<std::size_t>((highest_elevation_ - lowest_elevation_ + 1) * ranges_);
  }

  // Cuts rows into runs, notes the run of each occupied cell, and clears the grid behind itself.
  void find_runs() {
    const std::size_t rows = row_count();
    runs_.clear();
    first_run_.resize(rows + 1);
    for (std::size_t row = 0; row < rows; ++row) {
      first_run_[row] = static_cast<std::uint32_t>(runs_.size());
      std::uint8_t* const cells = occupied_.data() + row * row_bytes_;
      std::uint32_t* const run_of = run_of_.data() + row * row_bytes_;
      bool open = false;
      for (std::size_t block = 0; block < row_bytes_; block += 8) {
        std::uint64_t eight;
        std::memcpy(&eight, cells + block, 8);
        if (eight == 0) {
          open = false;
          continue;
        }
        for (std::size_t i = block; i < block + 8; ++i) {
          if (cells[i] == 0) {
            open = false;
            continue;
          }
          const auto azimuth = static_cast<std::int32_t>(i);
          if (!open) {
            const auto number = static_cast<std::uint32_t>(runs_.size());
            runs_.push_back({azimuth, azimuth + 1, number});
            open = true;
          } else {
            runs_.back().end = azimuth + 1;
          }
          run_of[i] = static_cast<std::uint32_t>(runs_.size() - 1);
        }
        std::memset(cells + block, 0, 8);
      }
    }
    first_run_[rows] = static_cast<std::uint32_t>(runs_.size());
  }

  void join_runs() {
    const auto ranges = static_cast<std::size_t>(ranges_);
    const std::size_t rows = row_count();
    for (std::size_t row = 0; row < rows; ++row) {
      if (first_run_[row] == first_run_[row + 1]) continue;
      join_rows(row, row);
      const std::size_t range = row % ranges;
      if (range > 0) join_rows(row, row - 1);
      if (row >= ranges) {
        const std::size_t below = row - ranges;
        if (range > 0) join_rows(row, below - 1);
        join_rows(row, below);
        if (range + 1 < ranges) join_rows(row, below + 1);
      }
    }
  }

  // Joins the runs of two rows that overlap or touch at a corner, also across the azimuth seam.
  void join_rows(std::size_t row_a, std::size_t row_b) {
    const std::uint32_t end_a = first_run_[row_a + 1];
    const std::uint32_t end_b = first_run_[row_b + 1];
    std::uint32_t a = first_run_[row_a];
    std::uint32_t b = first_run_[row_b];
    if (b == end_b) return;
    if (runs_[a].begin == 0 && runs_[end_b - 1].end == azimuths_) join(a, end_b - 1);
    if (runs_[b].begin == 0 && runs_[end_a - 1].end == azimuths_) join(b, end_a - 1);
    if (row_a == row_b) return;
    while (a < end_a && b < end_b) {
      if (runs_[a].begin <= runs_[b].end && runs_[b].begin <= runs_[a].end) join(a, b);
      if (runs_[a].end < runs_[b].end) {
        ++a;
      } else {
        ++b;
      }
    }
  }

  std::uint32_t root(std::uint32_t run) {
    while (runs_[run].parent != run) {
      runs_[run].parent = runs_[runs_[run].parent].parent;
      run = runs_[run].parent;
    }
    return run;
  }

  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    if (a < b) {
      runs_[b].parent = a;
    } else {
      runs_[a].parent = b;
    }
  }

  void number_clusters(std::size_t count) {
    number_of_run_.assign(runs_.size(), kNoCluster);
    for (std::uint32_t run = 0; run < runs_.size(); ++run) runs_[run].parent = root(run);
    cluster_count_ = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (cell_of_[i] < 0) {
        cluster_of_[i] = kNoCluster;
        continue;
      }
      const std::uint32_t run = run_of_[static_cast<std::size_t>(cell_of_[i]) - first_cell_];
      std::uint32_t& number = number_of_run_[runs_[run].parent];
      if (number == kNoCluster) number = static_cast<std::uint32_t>(cluster_count_++);
      cluster_of_[i] = number;
    }
  }

  Config config_;
  Config resolved_;  // without values left to the sensor
  std::int32_t azimuths_ = 0;
  std::int32_t ranges_ = 0;
  std::int32_t elevations_ = 0;
  std::size_t row_bytes_ = 0;

  std::int32_t lowest_elevation_ = 0;
  std::int32_t highest_elevation_ = -1;
  std::size_t first_cell_ = 0;
  std::size_t cluster_count_ = 0;
  std::vector<std::int32_t> cell_of_;
  std::vector<std::uint32_t> cluster_of_;
  std::vector<std::uint8_t> occupied_;
  std::vector<std::uint32_t> run_of_;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> first_run_;
  std::vector<std::uint32_t> number_of_run_;
};

}  // namespace dynains
