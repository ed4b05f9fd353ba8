// Tracks of instances: an object that moves at one time is dynamic in its other scans, too, before
// it starts and after it stops. Goes beyond the paper.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/instance_samples.hpp"
#include "dynains/points.hpp"
#include "dynains/stage/voxel_hash_table.hpp"

namespace dynains {

/// The instances of one scan as parts of tracks.
struct TrackedInstances {
  /// The track of an instance on one side of its scan, in time.
  struct Side {
    std::uint32_t instance = kNoCluster;  ///< the same object in the adjacent scan
    float log_odds = 0.0F;                ///< that it moved, from this scan and those on this side
    int scans_since_motion = 0;           ///< to the nearest scan whose own log-odds are positive
    std::int16_t farthest_hit =
        0;  ///< scans to the farthest reference that hit most of it; 0: none
  };
  struct Instance {
    float own = 0.0F;  ///< log-odds that it moved, from the evidence on this scan alone
    Side past;
    Side future;

    /// Log-odds that it moved, from its whole track; its own evidence counts once.
    float track_log_odds() const {
      return own + std::max(0.0F, past.log_odds - own) + std::max(0.0F, future.log_odds - own);
    }
  };
  std::vector<Instance> instances;

  /// Kept apart from Instance, since every scan propagates beliefs through all open scans.
  struct Shape {
    float length = 0.0F;            ///< m, horizontal diagonal
    float height = 0.0F;            ///< m
    std::uint32_t cells = 0;        ///< number of its cells
    float previous_overlap = 0.0F;  ///< ratio of common to all cells, with the linked instance
    float next_overlap = 0.0F;      ///< likewise
    bool carried = false;           ///< small enough to be one object
  };
  std::vector<Shape> shapes;  ///< by instance

  struct Cell {
    VoxelKey place;  ///< in the frame `origin`
    std::uint32_t instance;
  };
  std::vector<Cell> cells;  ///< of the carried instances, by instance
};

/// Links instances of consecutive scans that overlap in the world.
class InstanceLinker {
 public:
  /// `cell`: m. `max_length`, `max_height`: m, larger instances are not carried. `overlap`: ratio
  /// of common to all cells from which two instances are the same object.
  InstanceLinker(double cell, double max_length, double max_height, double overlap)
      : cell_(cell),
        max_length_(static_cast<float>(max_length)),
        max_height_(static_cast<float>(max_height)),
        overlap_(static_cast<float>(overlap)) {}

  /// Sizes and cells of the instances of one scan. `origin` (m): one frame near all scans that are
  /// linked.
  void measure(const InstanceSamples& samples, const Eigen::Isometry3d& T_origin_sensor,
               TrackedInstances& out) {
    out.instances.assign(samples.instance_count(), TrackedInstances::Instance());
    out.shapes.assign(samples.instance_count(), TrackedInstances::Shape());
    out.cells.clear();
    detail::find_cells(samples, cell_, T_origin_sensor, place_);
    table_.assign(kTable, kEmpty);
    for (std::uint32_t i = 0; i < samples.instance_count(); ++i) {
      TrackedInstances::Shape& shape = out.shapes[i];
      const std::uint32_t begin = samples.sample_begin[samples.supervoxel_begin[i]];
      const std::uint32_t end = samples.sample_begin[samples.supervoxel_begin[i + 1]];
      measure_extent(samples.points, begin, end, shape);
      if (!shape.carried) continue;
      for (std::uint32_t p = begin; p < end; ++p) {
        if (p > begin && place_[p] == place_[p - 1]) continue;
        const TrackedInstances::Cell cell = {place_[p], i};
        std::uint32_t& slot = slot_of(cell);
        // A collision in the table counts a cell twice: rare and harmless.
        if (slot != kEmpty && out.cells[slot].place == cell.place &&
            out.cells[slot].instance == i) {
          continue;
        }
        slot = static_cast<std::uint32_t>(out.cells.size());
        out.cells.push_back(cell);
        ++shape.cells;
      }
    }
  }

  /// Links each instance of two consecutive scans to the one of the other scan with the largest
  /// overlap.
  void link(TrackedInstances& before, TrackedInstances& now) {
    table_.assign(kTable, kEmpty);
    for (std::uint32_t i = 0; i < before.cells.size(); ++i) slot_of(before.cells[i]) = i;
    shared_.assign(before.instances.size(), 0);
    std::size_t at = 0;
    for (std::uint32_t i = 0; i < now.instances.size(); ++i) {
      touched_.clear();
      for (; at < now.cells.size() && now.cells[at].instance == i; ++at) {
        const std::uint32_t slot = slot_of(now.cells[at]);
        if (slot == kEmpty || before.cells[slot].place != now.cells[at].place) continue;
        const std::uint32_t other = before.cells[slot].instance;
        if (shared_[other]++ == 0) touched_.push_back(other);
      }
      for (const std::uint32_t other : touched_) {
        connect(before, other, now, i, static_cast<float>(shared_[other]));
        shared_[other] = 0;
      }
    }
  }

 private:
  static constexpr std::size_t kTable = 1U << 14;
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFFU;
  static constexpr std::uint32_t kLeastSamples = 2;  // one sample overlaps by chance

  // The hash leaves the instance out, so that equal cells of two scans share a slot.
  std::uint32_t& slot_of(const TrackedInstances::Cell& cell) {
    return table_[voxel_hash(cell.place) >> 8 & (kTable - 1)];
  }

  void measure_extent(const PointBuffer& points, std::uint32_t begin, std::uint32_t end,
                      TrackedInstances::Shape& shape) const {
    if (begin == end) return;
    float low[3] = {points.x[begin], points.y[begin], points.z[begin]};
    float high[3] = {low[0], low[1], low[2]};
    for (std::uint32_t p = begin; p < end; ++p) {
      const float at[3] = {points.x[p], points.y[p], points.z[p]};
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], at[axis]);
        high[axis] = std::max(high[axis], at[axis]);
      }
    }
    shape.length = std::hypot(high[0] - low[0], high[1] - low[1]);
    shape.height = high[2] - low[2];
    shape.carried =
        end - begin >= kLeastSamples && shape.length <= max_length_ && shape.height <= max_height_;
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
  std::vector<std::uint32_t> table_;  // numbers of cells, direct-mapped
  std::vector<VoxelKey> place_;       // by sample
  std::vector<std::uint32_t> shared_;
  std::vector<std::uint32_t> touched_;
};

/// Propagates log-odds along linked instances; they fade from scan to scan.
class TrackBelief {
 public:
  using Instance = TrackedInstances::Instance;
  using Side = TrackedInstances::Side;

  /// `unit`: log-odds of one clear observation.
  explicit TrackBelief(float unit) : floor_(-1.0F * unit), ceiling_(4.0F * unit) {}

  /// Log-odds of one scan on one side of time (&Instance::past or &Instance::future), from those of
  /// the adjacent scan on that side; null if there is none.
  void propagate(Side Instance::*side, const TrackedInstances* adjacent,
                 TrackedInstances& now) const {
    for (Instance& instance : now.instances) {
      Side& own_side = instance.*side;
      float inherited = 0.0F;
      own_side.scans_since_motion = 0;
      if (adjacent != nullptr && own_side.instance != kNoCluster) {
        const Side& parent = adjacent->instances[own_side.instance].*side;
        inherited = inherit(parent, instance.own, own_side);
      }
      own_side.log_odds = std::clamp(inherited + instance.own, floor_, ceiling_);
    }
  }

 private:
  // Log-odds that an instance takes over. References from well before (after) the motion of its
  // track that hit its place contradict the motion, unless the instance itself moves.
  static float inherit(const Side& parent, float own, Side& side) {
    constexpr float kFade = 0.95F;  // from scan to scan
    constexpr int kSlack = 8;       // scans
    const int since = parent.scans_since_motion + 1;
    side.scans_since_motion = own > 0.0F ? 0 : since;
    const bool contradicted = own <= 0.0F && side.farthest_hit > since + kSlack;
    return contradicted ? 0.0F : kFade * parent.log_odds;
  }

  float floor_;
  float ceiling_;
};

}  // namespace dynains
