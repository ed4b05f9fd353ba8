// Instances carried through time: what was shown to move stays dynamic when it stops, and what
// moves later was dynamic before. Goes beyond the paper.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/sample_places.hpp"
#include "dynains/points.hpp"
#include "dynains/voxel/voxel_key.hpp"

namespace dynains {

/// The instances of one scan as tracks see them.
struct TrackedInstances {
  /// An instance as a part of its track.
  struct Instance {
    std::uint32_t previous = kNoCluster;  ///< the same object in the scan before
    std::uint32_t next = kNoCluster;      ///< the same object in the scan after
    float own = 0.0F;                     ///< what this scan's own evidence says, log-odds
    float forward = 0.0F;                 ///< belief from this scan and those before it
    float backward = 0.0F;                ///< belief from this scan and those after it
    int since_forward = 0;                ///< scans since its own evidence last said that it moved
    int since_backward = 0;               ///< scans until its own evidence next says that it moves
    std::int16_t hit_back = 0;   ///< scans to the oldest reference that hit most of it; 0: none
    std::int16_t hit_ahead = 0;  ///< scans to the latest reference that hit most of it; 0: none
  };
  std::vector<Instance> instances;

  /// What it looks like: apart, because beliefs run along all open scans again and again.
  struct Shape {
    float length = 0.0F;      ///< m, horizontal diagonal
    float height = 0.0F;      ///< m
    std::uint32_t cells = 0;  ///< world cells that it occupies
    float previous_overlap = 0.0F;
    float next_overlap = 0.0F;
    bool carried = false;  ///< small enough to be one object
  };
  std::vector<Shape> shapes;  ///< by instance

  /// Occupied cells of carried instances.
  struct Cell {
    VoxelKey place;
    std::uint32_t instance;
  };
  std::vector<Cell> cells;
};

/// Links instances of consecutive scans that overlap in the world.
class InstanceLinker {
 public:
  /// `cell`: m; `max_length`, `max_height`: m, larger instances are not carried; `overlap`: share
  /// of cells (intersection over union) from which two instances are the same object.
  InstanceLinker(double cell, double max_length, double max_height, double overlap)
      : cell_(cell),
        max_length_(static_cast<float>(max_length)),
        max_height_(static_cast<float>(max_height)),
        overlap_(static_cast<float>(overlap)) {}

  /// Sizes and cells of the instances of one scan. Cells lie in the frame `origin` (m), which must
  /// be the same for scans that are to be linked and should be near them.
  void measure(const InstanceSamples& samples, const Eigen::Isometry3d& T_origin_sensor,
               TrackedInstances& out) {
    out.instances.assign(samples.instance_count(), TrackedInstances::Instance());
    out.shapes.assign(samples.instance_count(), TrackedInstances::Shape());
    out.cells.clear();
    detail::find_places(samples, cell_, T_origin_sensor, place_);
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
        // Two cells that share a place in the table are counted twice: rare, and harmless.
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

  /// Links the instances of two consecutive scans: each to the one of the other scan with which it
  /// shares most.
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
  static constexpr std::uint32_t kLeastSamples = 2;  // what is smaller overlaps by chance

  // Without the instance: cells of two scans meet in the same place.
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
      now.instances[to].previous = from;
    }
    if (overlap > from_shape.next_overlap) {
      from_shape.next_overlap = overlap;
      before.instances[from].next = to;
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

/// Beliefs that run along linked instances: a log-odds sum that fades from scan to scan.
class TrackBelief {
 public:
  /// `unit`: log-odds of one clear observation.
  explicit TrackBelief(float unit) : floor_(-1.0F * unit), ceiling_(4.0F * unit) {}

  /// Forward beliefs of `now` from those of the scan before; null starts afresh.
  void run_forward(const TrackedInstances* before, TrackedInstances& now) const {
    for (TrackedInstances::Instance& instance : now.instances) {
      float inherited = 0.0F;
      instance.since_forward = 0;
      if (before != nullptr && instance.previous != kNoCluster) {
        const TrackedInstances::Instance& parent = before->instances[instance.previous];
        inherited = inherit(parent.forward, parent.since_forward + 1, instance.own,
                            instance.hit_back, instance.since_forward);
      }
      instance.forward = std::clamp(inherited + instance.own, floor_, ceiling_);
    }
  }

  /// Backward beliefs of `now` from those of the scan after; null starts afresh.
  void run_backward(const TrackedInstances* after, TrackedInstances& now) const {
    for (TrackedInstances::Instance& instance : now.instances) {
      float inherited = 0.0F;
      instance.since_backward = 0;
      if (after != nullptr && instance.next != kNoCluster) {
        const TrackedInstances::Instance& child = after->instances[instance.next];
        inherited = inherit(child.backward, child.since_backward + 1, instance.own,
                            instance.hit_ahead, instance.since_backward);
      }
      instance.backward = std::clamp(inherited + instance.own, floor_, ceiling_);
    }
  }

 private:
  // What goes over from a neighbour in time. An instance that does not move itself is contradicted
  // by references from well before (after) it can have come (gone) that hit its place.
  static float inherit(float belief, int since, float own, int hit, int& own_since) {
    constexpr float kFade = 0.95F;  // share of a belief that is left one scan later
    constexpr int kSlack = 8;       // scans
    own_since = own > 0.0F ? 0 : since;
    const bool contradicted = own <= 0.0F && hit > since + kSlack;
    return contradicted ? 0.0F : kFade * belief;
  }

  float floor_;
  float ceiling_;
};

}  // namespace dynains
