// Tracks of instances. An object that moves in some scans is dynamic in all scans of its track,
// also before it starts and after it stops. Goes beyond the paper.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/instance_beliefs.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::detail {

/// The instances of one scan, with links to the instances of the adjacent scans.
struct TrackedInstances {
  /// Weighted sums of samples; samples of other scans of the track count less.
  struct Seen {
    float moved = 0.0F;  ///< in free supervoxels
    float stood = 0.0F;  ///< in supervoxels that are occupied and not free
  };
  /// The part of a track in the past, or in the future, of a scan.
  struct Side {
    std::uint32_t instance = kNoCluster;  ///< linked instance of the adjacent scan, or kNoCluster
    Seen seen;                            ///< in this scan and the scans on this side
  };
  struct Instance {
    Side past;
    Side future;

    /// Ratio of moved to decided samples of the whole track, 0 if none is decided. `own`: samples
    /// in this scan, which both sides include.
    float moved_ratio(const InstanceBeliefs::Counts& own) const {
      const float moved = past.seen.moved + future.seen.moved - static_cast<float>(own.moved);
      const float stood = past.seen.stood + future.seen.stood - static_cast<float>(own.stood());
      return moved + stood > 0.0F ? moved / (moved + stood) : 0.0F;
    }
  };
  std::vector<Instance> instances;

  /// Size and overlap of an instance. Separate from Instance, which sums along tracks read.
  struct Shape {
    std::uint32_t cells = 0;        ///< number of its cells
    std::uint32_t age = 0;          ///< number of scans of its track before this one
    float previous_overlap = 0.0F;  ///< ratio of common to all cells, with Instance::past
    float next_overlap = 0.0F;      ///< ratio of common to all cells, with Instance::future
    bool carried = false;           ///< whether it is tracked: small enough to be one object
  };
  std::vector<Shape> shapes;  ///< by instance
};

/// Links instances of consecutive scans that overlap in the origin frame.
class InstanceLinker {
 public:
  /// `cell`: edge of the cells, m. `max_length`, `max_height`: m, larger instances are not carried.
  /// `overlap`: ratio of common to all cells from which two instances are one object.
  InstanceLinker(double cell, double max_length, double max_height, double overlap)
      : cell_(cell),
        max_length_(static_cast<float>(max_length)),
        max_height_(static_cast<float>(max_height)),
        overlap_(static_cast<float>(overlap)) {}

  /// Computes the shapes and the cells of the instances of the next scan, and resets their links.
  /// All linked scans must have one origin frame, which should be near them.
  void measure(const InstanceSamples& samples, const Pose& T_origin_sensor, TrackedInstances& out) {
    out.instances.assign(samples.instance_count(), TrackedInstances::Instance());
    out.shapes.assign(samples.instance_count(), TrackedInstances::Shape());
    cells_.swap(cells_before_);
    table_.swap(table_before_);
    for (const Cell& cell : cells_) table_[slot_of(cell)] = kNoIndex;
    cells_.clear();
    find_cells(samples, cell_, T_origin_sensor, place_);
    for (std::uint32_t i = 0; i < samples.instance_count(); ++i) {
      TrackedInstances::Shape& shape = out.shapes[i];
      const std::uint32_t begin = samples.sample_begin[samples.supervoxel_begin[i]];
      const std::uint32_t end = samples.sample_begin[samples.supervoxel_begin[i + 1]];
      shape.carried = is_carried(samples.points, begin, end);
      if (!shape.carried) continue;
      for (std::uint32_t p = begin; p < end; ++p) {
        if (p > begin && place_[p] == place_[p - 1]) continue;
        const Cell cell = {place_[p], i};
        std::uint32_t& slot = table_[slot_of(cell)];
        // A collision in the table may count a cell twice. Collisions are rare, and the count needs
        // no more accuracy.
        if (slot != kNoIndex && cells_[slot].place == cell.place && cells_[slot].instance == i) {
          continue;
        }
        slot = static_cast<std::uint32_t>(cells_.size());
        cells_.push_back(cell);
        ++shape.cells;
      }
    }
  }

  /// Links each instance of the last two scans to the instance of the other scan with the largest
  /// overlap.
  void link(TrackedInstances& before, TrackedInstances& now) {
    shared_.assign(before.instances.size(), 0);
    std::size_t at = 0;
    for (std::uint32_t i = 0; i < now.instances.size(); ++i) {
      touched_.clear();
      for (; at < cells_.size() && cells_[at].instance == i; ++at) {
        const std::uint32_t slot = table_before_[slot_of(cells_[at])];
        if (slot == kNoIndex || cells_before_[slot].place != cells_[at].place) continue;
        const std::uint32_t other = cells_before_[slot].instance;
        if (shared_[other]++ == 0) touched_.push_back(other);
      }
      for (const std::uint32_t other : touched_) {
        connect(before, other, now, i, static_cast<float>(shared_[other]));
        shared_[other] = 0;
      }
    }
  }

 private:
  struct Cell {
    VoxelKey place;  // origin frame
    std::uint32_t instance;
  };

  static constexpr std::size_t kTable = 1U << 14;
  static constexpr std::uint32_t kMinSamples = 2;  // a single sample may overlap by chance

  // The hash does not include the instance, so that equal cells of two scans share a slot.
  static std::size_t slot_of(const Cell& cell) {
    return voxel_hash(cell.place) >> 8 & (kTable - 1);
  }

  // Whether samples [begin, end) are small enough to be one object.
  bool is_carried(const PointBuffer& points, std::uint32_t begin, std::uint32_t end) const {
    if (end - begin < kMinSamples) return false;
    Eigen::AlignedBox3f box;
    for (std::uint32_t p = begin; p < end; ++p) {
      box.extend(Eigen::Vector3f(points.x[p], points.y[p], points.z[p]));
    }
    const Eigen::Vector3f size = box.sizes();
    return std::hypot(size.x(), size.y()) <= max_length_ && size.z() <= max_height_;
  }

  void connect(TrackedInstances& before, std::uint32_t from, TrackedInstances& now,
               std::uint32_t to, float shared) const {
    TrackedInstances::Shape& from_shape = before.shapes[from];
    TrackedInstances::Shape& to_shape = now.shapes[to];
    const float overlap = shared / (static_cast<float>(from_shape.cells) +
                                    static_cast<float>(to_shape.cells) - shared);
    if (overlap < overlap_) return;
    if (overlap > to_shape.previous_overlap) {
      to_shape.previous_overlap = overlap;
      to_shape.age = from_shape.age + 1;
      now.instances[to].past.instance = from;
    }
    if (overlap > from_shape.next_overlap) {
      from_shape.next_overlap = overlap;
      before.instances[from].future.instance = to;
    }
  }

  double cell_;
  float max_length_;
  float max_height_;
  float overlap_;
  // Cells of the last two scans, ordered by instance.
  std::vector<Cell> cells_, cells_before_;
  // Index of a cell by slot_of(), one table for each of the two scans.
  std::vector<std::uint32_t> table_ = std::vector<std::uint32_t>(kTable, kNoIndex);
  std::vector<std::uint32_t> table_before_ = table_;
  std::vector<VoxelKey> place_;         // by sample
  std::vector<std::uint32_t> shared_;   // by instance of the scan before: number of common cells
  std::vector<std::uint32_t> touched_;  // instances of the scan before with common cells
};

/// Sum of the samples of an instance and, on one side of time, of its track. `beside`: the sum of
/// the linked instance of the adjacent scan on that side; zero without one.
inline TrackedInstances::Seen sum_along_track(const InstanceBeliefs::Counts& own,
                                              const TrackedInstances::Seen& beside) {
  // Factors per scan, chosen on random worlds. An object that moved remains dynamic for some time
  // after it stopped.
  constexpr float kMovedFade = 0.95F, kStoodFade = 0.8F;
  return {static_cast<float>(own.moved) + kMovedFade * beside.moved,
          static_cast<float>(own.stood()) + kStoodFade * beside.stood};
}

}  // namespace dynains::detail
