// Curved-voxel clustering (Park et al., "Curved-voxel clustering", IROS 2019), the instance
// segmentation of the paper. A curved voxel is a cell of range, azimuth and elevation. Occupied
// voxels that touch, diagonals included, form one cluster.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains {

/// Clusters points whose curved voxels are connected in the 26-neighbourhood. Azimuth is periodic.
///
/// The grid stores one bit per cell, with azimuth as the fastest index, in blocks of 64 cells. A
/// row contains the cells of one elevation and one range. A run is a maximal sequence of occupied
/// cells in a row. Union-find joins the runs of neighbouring rows that touch.
class CurvedVoxelClusterer {
 public:
  struct Config {
    double voxel_range = 0.6;      ///< m
    double voxel_azimuth = 0.0;    ///< deg, rounded to a divisor of 360; 0: by the sensor
    double voxel_elevation = 0.0;  ///< deg; 0: by the sensor
    double cluster_range = 90.0;   ///< m; points farther away have no cluster

    /// Voxels of the paper's public implementation.
    static Config paper() {
      Config config;
      config.voxel_range = 0.5;
      config.voxel_azimuth = 0.5;
      config.voxel_elevation = 3.0;
      return config;
    }

    /// The public implementation of the paper.
    static Config published() {
      Config config = paper();
      config.cluster_range = 80.0;
      return config;
    }

    /// Copy with the voxel sizes that are 0 derived from the sensor, so that neighbouring beams hit
    /// the same or neighbouring voxels.
    Config resolved(const SensorModel& sensor) const {
      Config config = *this;
      const double spacing = 0.75 * (sensor.azimuth_step + sensor.elevation_gap);
      if (voxel_azimuth == 0.0) config.voxel_azimuth = std::clamp(spacing, 0.5, 30.0);
      if (voxel_elevation == 0.0) {
        config.voxel_elevation =
            std::clamp(std::max(spacing, sensor.elevation_gap_wide), 1.0, 45.0);
      }
      return config;
    }

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"voxel_range", self.voxel_range, closed(0.05, 20), "m",
                        "depth of a curved voxel"});
      visitor(Parameter{"voxel_azimuth", self.voxel_azimuth, closed(0, 30), "deg",
                        "width of a curved voxel; 0: by the sensor"});
      visitor(Parameter{"voxel_elevation", self.voxel_elevation, closed(0, 45), "deg",
                        "height of a curved voxel; 0: by the sensor"});
      visitor(Parameter{"cluster_range", self.cluster_range, half_open_below(0, 1000), "m",
                        "farther points belong to no cluster and are static"});
    }

    /// Number of cells of the grid. The length of a row is padded to a power of two.
    double cell_count() const {
      return std::exp2(std::ceil(std::log2(std::max(64.0, std::round(360.0 / voxel_azimuth))))) *
             std::ceil(180.0 / voxel_elevation) * (std::floor(cluster_range / voxel_range) + 2.0);
    }

    /// Throws ConfigError for a field out of bounds or a grid with too many cells.
    void validate() const {
      validate_parameters("CurvedVoxelClusterer", *this);
      constexpr double kMaxCells = 1 << 29;
      const double cells = resolved(SensorModel::typical()).cell_count();
      if (!(cells <= kMaxCells)) {
        throw ConfigError(
            "CurvedVoxelClusterer: voxel_range, voxel_azimuth, voxel_elevation and "
            "cluster_range make " +
            std::to_string(cells) + " cells; at most " + std::to_string(kMaxCells) +
            " are possible");
      }
    }
  };

  CurvedVoxelClusterer() : CurvedVoxelClusterer(Config()) {}

  /// Throws ConfigError.
  explicit CurvedVoxelClusterer(const Config& config) : config_((config.validate(), config)) {
    adapt(SensorModel::typical());
  }

  /// Whether a voxel size depends on the sensor.
  bool needs_sensor() const {
    return config_.voxel_azimuth == 0.0 || config_.voxel_elevation == 0.0;
  }

  /// Sets the voxel sizes that depend on the sensor. Before this call, SensorModel::typical() gives
  /// them.
  void adapt(const SensorModel& sensor) {
    resolved_ = config_.resolved(sensor);
    azimuths_ = static_cast<std::int32_t>(std::round(360.0 / resolved_.voxel_azimuth));
    ranges_ =
        static_cast<std::int32_t>(std::floor(config_.cluster_range / config_.voxel_range)) + 1;
    elevations_ = static_cast<std::int32_t>(std::ceil(180.0 / resolved_.voxel_elevation));
    row_shift_ = 6;  // at least one block
    while ((1 << row_shift_) < azimuths_) ++row_shift_;
  }

  const Config& config() const { return config_; }

  /// Clusters points of one or more scans (m and rad, level frame). Returns the cluster number of
  /// each point in [0, cluster_count()), or kNoCluster. The numbers follow the order of cells and
  /// do not depend on the order of points. The view is valid until the next call.
  Span<const std::uint32_t> cluster(PolarView points) {
    find_cells(points);
    mark_cells(points.size());
    // Run as kernels for the popcnt instruction of processors with AVX2.
    detail::with_packs([&](auto) { find_runs(); });
    detail::with_packs([&](auto) { join_runs(); });
    number_runs();
    number_points(points.size());
    clear_cells();
    return {cell_or_cluster_.data(), points.size()};
  }

  /// Number of clusters of the last cluster().
  std::size_t cluster_count() const { return cluster_count_; }

 private:
  static constexpr int kBlockShift = 6;  // a block of cells is a word of bits

  // Computes the cell of each point: ((elevation * columns() + range) << row_shift_) + azimuth.
  // Points beyond cluster_range are in an additional column behind the last range. The length of a
  // row is a power of two, because a shift is cheaper than a product.
  void find_cells(PolarView points) {
    using detail::PackConstant;
    const std::size_t count = points.size();
    detail::grow(cell_or_cluster_, count + detail::kPackWidth);
    const PackConstant azimuth_scale(static_cast<float>(azimuths_ / (2.0 * M_PI)));
    const PackConstant elevation_scale(
        static_cast<float>(1.0 / (resolved_.voxel_elevation * detail::kRadians)));
    const PackConstant range_scale(static_cast<float>(1.0 / config_.voxel_range));
    const PackConstant far(static_cast<float>(config_.cluster_range));
    const PackConstant pi(detail::kPi);
    const PackConstant half_pi(0.5F * detail::kPi);
    const PackConstant last_azimuth(static_cast<float>(azimuths_ - 1));
    const PackConstant last_elevation(static_cast<float>(elevations_ - 1));
    const PackConstant last_range(static_cast<float>(ranges_ - 1));
    const PackConstant beyond(static_cast<float>(ranges_));
    const PackConstant columns(static_cast<float>(ranges_ + 1));
    const int row_shift = row_shift_;
    auto* const cells = reinterpret_cast<std::int32_t*>(cell_or_cluster_.data());
    const PackConstant above_all(static_cast<float>(elevations_));
    const PackConstant below_all(-1.0F);
    detail::with_packs([&](auto packs) {
      using Packs = decltype(packs);
      using Float = typename Packs::Float;
      using Int = typename Packs::Int;
      Float lowest = above_all;
      Float highest = below_all;
      detail::for_slices<Packs>(0, count, [&](const auto& at) {
        const Float range = at.load(points.range.data());
        const Float azimuth = at.load(points.azimuth.data());
        const Float z = at.load(points.z.data());
        const Float distance = sqrt(range * range + z * z);
        const Float i_range =
            select(distance <= far, min(distance * range_scale, last_range), Float(beyond));
        const Float i_azimuth = min((azimuth + pi) * azimuth_scale, last_azimuth);
        const Float i_elevation = min(
            (detail::elevation_of(z, range, distance) + half_pi) * elevation_scale, last_elevation);
        // Row numbers stay below 2^23 and are exact in floats.
        const Int i_row = truncate(to_float(truncate(i_elevation)) * columns) + truncate(i_range);
        ((i_row << row_shift) + truncate(i_azimuth)).store(cells + at.begin);
        lowest = min(lowest, at.padded(i_elevation, lowest));
        highest = max(highest, at.padded(i_elevation, highest));
      });
      lowest_elevation_ = static_cast<std::int32_t>(smallest(lowest));
      // Rounding can make the index of -90 deg slightly negative. Truncation gives 0.
      highest_elevation_ = static_cast<std::int32_t>(largest(highest));
    });
  }

  // Sets the bits of occupied cells. The grid covers only the occurring elevations, and is zero
  // between calls.
  void mark_cells(std::size_t count) {
    if (highest_elevation_ < 0) return;
    first_cell_ = (static_cast<std::size_t>(lowest_elevation_) * columns()) << row_shift_;
    const std::size_t blocks = row_count() * row_blocks() + detail::kPackWidth;
    if (occupied_.size() < blocks) {
      occupied_.resize(blocks);
      starts_.resize(blocks);
      run_before_.resize(blocks);
    }
    // Local copies: the compiler must assume that a store changes members.
    const std::uint32_t* const cells = cell_or_cluster_.data();
    std::uint64_t* const occupied = occupied_.data();
    const auto first_cell = static_cast<std::uint32_t>(first_cell_);
    detail::for_packs(count, [=](const auto& at) {
      for (std::size_t k = 0; k < at.size(); ++k) {
        const std::uint32_t cell = cells[at.begin + k] - first_cell;
        occupied[cell / detail::kWordBits] |= std::uint64_t{1} << cell % detail::kWordBits;
      }
    });
  }

  // Rows per elevation: one per range, and one for points beyond cluster_range.
  std::size_t columns() const { return static_cast<std::size_t>(ranges_) + 1; }
  std::size_t row_blocks() const { return std::size_t{1} << (row_shift_ - kBlockShift); }
  std::size_t row_count() const {
    if (highest_elevation_ < 0) return 0;
    const std::int32_t elevations = highest_elevation_ - lowest_elevation_ + 1;
    return static_cast<std::size_t>(elevations) * columns();
  }

  // Finds the runs of all rows, numbered in the order of their cells.
  void find_runs() {
    occupied_blocks_.clear();
    const std::size_t blocks = row_count() * row_blocks();
    std::uint32_t runs = 0;
    const auto add = [&](std::size_t block) {
      if (occupied_[block] == 0) return;
      occupied_blocks_.push_back(static_cast<std::uint32_t>(block));
      starts_[block] = occupied_[block] & ~occupied_before(block);
      run_before_[block] = runs - 1;
      runs += detail::count_ones(starts_[block]);
    };
    for (std::size_t block = 0; block < blocks; block += detail::kPackWidth) {
      std::uint64_t any = 0;  // mostly none
      for (std::size_t i = 0; i < detail::kPackWidth; ++i) any |= occupied_[block + i];
      for (std::size_t i = 0; any != 0 && i < detail::kPackWidth; ++i) add(block + i);
    }
    parent_.resize(runs);
    std::iota(parent_.begin(), parent_.end(), 0U);
  }

  // Joins runs that touch in the same or in neighbouring rows, also across the azimuth seam.
  void join_runs() {
    std::size_t first_row = 0;  // of the current elevation
    for (const std::uint32_t block : occupied_blocks_) {
      const std::size_t row = block >> (row_shift_ - kBlockShift);
      while (row >= first_row + columns()) first_row += columns();
      if (is_out_of_range(row - first_row)) {
        exclude_runs(block);
        continue;
      }
      join_seam(block, row);
      const bool has_nearer = row > first_row;
      if (has_nearer) join_block(block, row - 1);
      if (first_row == 0) continue;
      const std::size_t below = row - columns();
      if (has_nearer) join_block(block, below - 1);
      join_block(block, below);
      if (!is_out_of_range(row + 1 - first_row)) join_block(block, below + 1);
    }
  }

  bool is_out_of_range(std::size_t column) const { return column + 1 == columns(); }
  // Marks the runs that start in the block as kNoCluster.
  void exclude_runs(std::size_t block) {
    detail::for_each_bit(starts_[block], [&](std::size_t at) {
      parent_[run_of(block * detail::kWordBits + at)] = kNoCluster;
    });
  }

  // Joins the runs of a block with the runs of another row that overlap them or touch them at a
  // corner. In such a pair, one run begins within the other run or one cell behind it.
  void join_block(std::size_t block, std::size_t row) {
    join_seam(block, row);
    const std::size_t other = row * row_blocks() + place_in_row(block);
    const std::uint64_t here = occupied_[block];
    const std::uint64_t there = occupied_[other];
    if (there != 0) {
      const std::uint64_t starts_here = starts_[block];
      const std::uint64_t starts_there = starts_[other];
      const std::uint32_t before_here = run_before_[block];
      const std::uint32_t before_there = run_before_[other];
      const std::uint64_t begins =
          (starts_here & (there | there << 1U)) | (starts_there & (here | here << 1U));
      // If the cell is empty, the last run up to it is the run of the cell before.
      detail::for_each_bit(begins, [&](std::size_t at) {
        const std::uint64_t up_to_cell = ~std::uint64_t{0} >> (detail::kWordBits - 1 - at);
        join(before_here + detail::count_ones(starts_here & up_to_cell),
             before_there + detail::count_ones(starts_there & up_to_cell));
      });
    }
    // Runs that touch at a corner across the border of a block.
    const std::size_t first = block * detail::kWordBits;
    const std::size_t first_there = other * detail::kWordBits;
    if ((here & 1U) != 0 && place_in_row(other) != 0 && is_occupied(first_there - 1)) {
      join(run_of(first), run_of(first_there - 1));
    }
    if (here >> (detail::kWordBits - 1) != 0 && place_in_row(other + 1) != 0 &&
        is_occupied(first_there + detail::kWordBits)) {
      join(run_of(first + detail::kWordBits - 1), run_of(first_there + detail::kWordBits));
    }
  }

  // Joins the runs of a block with the runs of `row` that touch them across the azimuth seam.
  void join_seam(std::size_t block, std::size_t row) {
    const std::size_t first = row * row_blocks() * detail::kWordBits;
    const std::size_t last = first + static_cast<std::size_t>(azimuths_) - 1;
    const std::size_t in_row = place_in_row(block);
    const std::size_t last_here =
        static_cast<std::size_t>(azimuths_) - 1 - in_row * detail::kWordBits;
    if (in_row == 0 && is_occupied(block * detail::kWordBits) && is_occupied(last)) {
      join(run_of(block * detail::kWordBits), run_of(last));
    }
    if (last_here < detail::kWordBits && is_occupied(block * detail::kWordBits + last_here) &&
        is_occupied(first)) {
      join(run_of(block * detail::kWordBits + last_here), run_of(first));
    }
  }

  // Index of the block within its row. The number of blocks per row is a power of two.
  std::size_t place_in_row(std::size_t block) const { return block & (row_blocks() - 1); }
  bool is_occupied(std::size_t cell) const {
    return (occupied_[cell / detail::kWordBits] >> cell % detail::kWordBits & 1U) != 0;
  }
  // Bits of the cells whose preceding cell in the row is occupied.
  std::uint64_t occupied_before(std::size_t block) const {
    const std::uint64_t carried =
        place_in_row(block) == 0 ? 0 : occupied_[block - 1] >> (detail::kWordBits - 1);
    return occupied_[block] << 1U | carried;
  }

  // Run of an occupied cell: the last run that starts at or before the cell.
  std::uint32_t run_of(std::size_t cell) const {
    const std::uint64_t up_to_cell = starts_[cell / detail::kWordBits]
                                     << (~cell % detail::kWordBits);
    return run_before_[cell / detail::kWordBits] + detail::count_ones(up_to_cell);
  }

  std::uint32_t root(std::uint32_t run) {
    while (parent_[run] != run) {
      parent_[run] = parent_[parent_[run]];
      run = parent_[run];
    }
    return run;
  }

  // The root of a set is its run with the lowest number.
  void join(std::uint32_t a, std::uint32_t b) {
    if (parent_[a] == parent_[b]) return;
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

  // Assigns cluster numbers to runs. A parent has a lower number than its children.
  void number_runs() {
    number_of_run_.resize(parent_.size());
    cluster_count_ = 0;
    for (std::size_t run = 0; run < parent_.size(); ++run) {
      const std::uint32_t parent = parent_[run];
      if (parent == run) {
        number_of_run_[run] = static_cast<std::uint32_t>(cluster_count_++);
      } else {
        number_of_run_[run] = parent == kNoCluster ? kNoCluster : number_of_run_[parent];
      }
    }
  }

  // Replaces the cell of each point by its cluster number.
  void number_points(std::size_t count) {
    std::uint32_t* const cells = cell_or_cluster_.data();
    const std::uint64_t* const starts = starts_.data();
    const std::uint32_t* const run_before = run_before_.data();
    const std::uint32_t* const number_of_run = number_of_run_.data();
    const auto first_cell = static_cast<std::uint32_t>(first_cell_);
    detail::for_packs(count, [=](const auto& at) {
      for (std::size_t k = 0; k < at.size(); ++k) {
        const std::uint32_t cell = cells[at.begin + k] - first_cell;
        const std::size_t block = cell / detail::kWordBits;
        const std::uint64_t up_to_cell = starts[block] << (~cell % detail::kWordBits);
        cells[at.begin + k] = number_of_run[run_before[block] + detail::count_ones(up_to_cell)];
      }
    });
  }

  void clear_cells() {
    for (const std::uint32_t block : occupied_blocks_) {
      occupied_[block] = 0;
      starts_[block] = 0;
    }
  }

  Config config_;
  Config resolved_;  // with voxel sizes for the sensor
  std::int32_t azimuths_ = 0;
  std::int32_t ranges_ = 0;
  std::int32_t elevations_ = 0;
  int row_shift_ = 0;  // log2 of the number of cells per row

  std::int32_t lowest_elevation_ = 0;
  std::int32_t highest_elevation_ = -1;
  std::size_t first_cell_ = 0;
  std::size_t cluster_count_ = 0;
  std::vector<std::uint32_t> cell_or_cluster_;  // cell of each point, then its cluster
  std::vector<std::uint64_t> occupied_;         // by block, a bit per cell: occupied
  std::vector<std::uint64_t> starts_;           // by block, a bit per cell: first cell of a run
  std::vector<std::uint32_t> run_before_;       // by block, the last run that starts before it
  std::vector<std::uint32_t> occupied_blocks_;  // blocks with occupied cells, ascending
  std::vector<std::uint32_t> parent_;           // by run; kNoCluster beyond cluster_range
  std::vector<std::uint32_t> number_of_run_;    // by run, its cluster
};

}  // namespace dynains
