// One tile of a map of many sessions: which points of which session are on the map after which
// session.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "dynains/belief/log_odds.hpp"
#include "dynains/city/session.hpp"
#include "dynains/recording/cell_samples.hpp"
#include "dynains/recording/paged_tiles.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Function from the contributions of all sessions to the points of one tile of the map.
///
/// First the points of all sessions are added, in the order of their time; then, in the same order,
/// the reference scans of each session test the points of all sessions. Blocks of 2 x 2 x 2 voxels
/// have a sample in each voxel: the first point there. A part is the voxels of a block in which one
/// session has points. Each part sums its log-odds of being free session by session, by Eq. 18:
/// - Sessions before its own show whether its place was free, its own session whether it is
///   occupied. A part whose place was free, and that its own session hit too seldom, does not enter
///   the map.
/// - A later session that passes through it removes it.
/// Touching parts of a session above the ground form components. One that is larger than a vehicle
/// is cut into cubes of 8 blocks: a tree that was felled beside others leaves alone. A component
/// that has mostly left leaves as a whole.
class TileHistory {
 public:
  static constexpr std::uint32_t kNever = std::numeric_limits<std::uint32_t>::max();

  /// Throws ConfigError.
  explicit TileHistory(const SessionGrid& grid) : grid_((grid.validate(), grid)) {}

  /// Points of a session in this tile, in the order of their scans.
  const std::vector<SessionPoint>& points(std::size_t session) const {
    return sessions_[session].points;
  }
  /// Number of the session that removed a point, or kNever.
  std::uint32_t removed_by(std::size_t session, std::size_t point) const {
    return part_of(session, point).removed_by;
  }
  /// Number of references of its own session that hit the block of a point, up to 255.
  std::uint32_t own_hits(std::size_t session, std::size_t point) const {
    return part_of(session, point).own_hits;
  }
  /// Whether a reference of its own session passed through the block of a point at some time.
  bool own_beams_passed(std::size_t session, std::size_t point) const {
    return part_of(session, point).max_own_level >= level_;
  }
  /// Whether a session before its own saw the place of a point free.
  bool was_free(std::size_t session, std::size_t point) const {
    return part_of(session, point).was_free;
  }
  /// Whether a point is neither removed by a session up to number `last`, nor newer than `last`.
  bool stands(std::size_t session, std::size_t point, std::uint32_t last) const {
    const std::uint32_t by = removed_by(session, point);
    return session <= last && (by == kNever || by > last);
  }

  /// Adds the points of the next session, in the order of their scans. All sessions are added
  /// before the first reference.
  void add_session(std::vector<SessionPoint> points) {
    const auto number = static_cast<std::uint32_t>(sessions_.size());
    Session& session = sessions_.emplace_back();
    session.points = std::move(points);
    session.part_of.reserve(session.points.size());
    for (const SessionPoint& point : session.points) {
      const VoxelKey voxel = session_voxel(grid_, point);
      const unsigned octant = octant_of(voxel);
      const std::uint32_t block = blocks_.add(block_of(voxel));
      std::uint32_t& newest = blocks_.values[block].newest_part;
      if (newest == kNoIndex || parts_[newest].session != number) {
        parts_.push_back({number, block, newest});
        newest = static_cast<std::uint32_t>(parts_.size() - 1);
      }
      parts_[newest].octants |= 1U << octant;
      if (!blocks_.values[block].samples.has(octant)) {
        const Eigen::Vector3d at = Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
        const Eigen::Array3d within = (at - corner_of(blocks_.keys[block], edge())) / edge();
        blocks_.values[block].samples.add(octant, within);
      }
      session.part_of.push_back(newest);
    }
    session.parts_end = static_cast<std::uint32_t>(parts_.size());
  }

  /// Tests all points by a reference of the first session that end_session() has not ended.
  /// `sensor`: its position, m, in the frame of SessionPoint. `test_visibility`: see
  /// TestedCells::test().
  template <class TestVisibility>
  void revise(const Eigen::Vector3d& sensor, TestVisibility&& test_visibility) {
    tested_.take(blocks_.keys, edge(),
                 [&](std::size_t i) -> const CellSamples& { return blocks_.values[i].samples; });
    tested_.test(sensor, test_visibility, [&](std::size_t i, const detail::Visibility::Bits& seen) {
      const Block& block = blocks_.values[i];
      const std::uint32_t free = block.samples.octants_of(seen.free);
      const std::uint32_t hit = block.samples.octants_of(seen.hit);
      for (std::uint32_t p = block.newest_part; p != kNoIndex; p = parts_[p].next) {
        Part& part = parts_[p];
        if (part.removed_by != kNever) continue;
        const int verdict = detail::FreeSpaceSum::judge(detail::count_ones(free & part.octants),
                                                        detail::count_ones(hit & part.octants),
                                                        detail::count_ones(part.octants));
        if (verdict != 0) add(verdict > 0, part);
      }
    });
  }

  /// Ends the references of a session.
  void end_session() {
    const std::uint32_t by = tested_count_++;
    find_components(by);
    remove_parts(by);
    remove_components(by);
    for (Part& part : parts_) {
      part.level = std::max(part.level, 0.0F);
      if (part.session <= by) continue;
      part.was_free = part.was_free || part.level >= level_;
      // A few references of the session itself outweigh all of the earlier sessions.
      part.level = std::min(part.level, level_);
    }
  }

  /// Calls `visit(session, point)` for the points of the map after session number `last`: of each
  /// voxel that of the newest session that is still there. Points come in the order of sessions.
  template <class Visitor>
  void for_each_standing(std::uint32_t last, Visitor&& visit) const {
    const std::size_t count = std::min<std::size_t>(sessions_.size(), std::size_t{last} + 1);
    std::vector<std::vector<std::uint32_t>> newest(count);
    VoxelHashTable<> filled;
    for (std::size_t session = count; session-- > 0;) {
      const std::vector<SessionPoint>& points = sessions_[session].points;
      for (std::uint32_t i = 0; i < points.size(); ++i) {
        if (!stands(session, i, last)) continue;
        const std::size_t before = filled.size();
        if (filled.insert(session_voxel(grid_, points[i])) == before) newest[session].push_back(i);
      }
    }
    for (std::size_t session = 0; session < count; ++session) {
      for (const std::uint32_t i : newest[session]) visit(session, std::size_t{i});
    }
  }

 private:
  /// Least numbers of free parts from which a component has left.
  struct Limits {
    float per_hit;  ///< ratio to the parts that are hit
    float of_all;   ///< ratio to all its parts
  };
  static constexpr Limits kNotStanding = {2.0F, 0.3F};  // in its own session
  static constexpr Limits kLeft = {0.25F, 0.1F};

  struct Block {
    CellSamples samples;
    std::uint32_t newest_part = kNoIndex;
  };
  /// The voxels that one session fills in a block, and the evidence about them.
  struct Part {
    std::uint32_t session, block;
    std::uint32_t next;         // part of the session before that has one in the block
    std::uint32_t octants = 0;  // bits of those with points
    float level = 0.0F;         // log-odds of being free
    float own_level = 0.0F;     // sum of its own session, never below zero
    float max_own_level = 0.0F;
    std::uint32_t component = kNoIndex;  // kNoIndex: ground
    std::uint32_t removed_by = kNever;
    std::uint8_t own_hits = 0;  // references of its own session that hit
    bool was_free = false;      // after a session before its own
  };
  struct Session {
    std::vector<SessionPoint> points;
    std::vector<std::uint32_t> part_of;  // by point
    std::uint32_t parts_end = 0;
  };

  double edge() const { return 2.0 * grid_.map_voxel; }  // m, of a block
  const Part& part_of(std::size_t session, std::size_t point) const {
    return parts_[sessions_[session].part_of[point]];
  }

  // Updates a part by one reference.
  void add(bool is_free, Part& part) const {
    const float step = is_free ? free_ : hit_;
    part.level += step;
    if (part.session != tested_count_) return;
    part.own_level = std::max(0.0F, part.own_level + step);
    part.max_own_level = std::max(part.max_own_level, part.own_level);
    if (!is_free && part.own_hits < 255) ++part.own_hits;
  }

  // Numbers the components of touching parts of a session with points above the ground.
  void find_components(std::uint32_t session) {
    VoxelTile<std::uint32_t> parts;
    const Session& own = sessions_[session];
    for (std::size_t i = 0; i < own.points.size(); ++i) {
      if (own.points[i].is_ground != 0) continue;
      const std::uint32_t part = own.part_of[i];
      parts.values[parts.add(blocks_.keys[parts_[part].block])] = part;
    }
    ComponentSearch().for_each(
        parts.keys, parts.numbers, [&](const std::vector<std::uint32_t>& members) {
          const bool is_whole = is_compact(parts.keys, members);
          VoxelHashTable<> cubes;
          for (const std::uint32_t member : members) {
            const auto cube = [&](int axis) {
              return voxel_index(parts.keys[member], axis) >> 3;  // of 8 blocks
            };
            const VoxelKey key = is_whole ? 0 : voxel_key(cube(0), cube(1), cube(2));
            parts_[parts.values[member]].component = component_count_ + cubes.insert(key);
          }
          component_count_ += static_cast<std::uint32_t>(cubes.size());
        });
  }

  bool is_compact(const std::vector<VoxelKey>& keys,
                  const std::vector<std::uint32_t>& members) const {
    Eigen::AlignedBox3d box;
    for (const std::uint32_t member : members) box.extend(corner_of(keys[member], edge()));
    const Eigen::Vector3d sizes = box.sizes() + Eigen::Vector3d::Constant(edge());
    return sizes.head<2>().maxCoeff() <= 18.0 && sizes.z() <= 4.5;  // m
  }

  // Removes the parts of sessions up to `by` that are free after it. In the session that measured
  // them, remove_components() decides about those of a component.
  void remove_parts(std::uint32_t by) {
    for (std::uint32_t i = 0; i < sessions_[by].parts_end; ++i) {
      Part& part = parts_[i];
      const bool is_undivided = by == part.session && part.component != kNoIndex;
      if (part.level >= level_ && !is_undivided && part.removed_by == kNever) part.removed_by = by;
    }
  }

  // Removes the rest of the components that have left by the references of session number `by`.
  void remove_components(std::uint32_t by) {
    struct Count {
      float free = 0.0F, hit = 0.0F, all = 0.0F;
    };
    std::vector<Count> counts(component_count_);
    const std::uint32_t end = sessions_[by].parts_end;
    for (std::uint32_t i = 0; i < end; ++i) {
      const Part& part = parts_[i];
      if (part.component == kNoIndex || (part.removed_by != by && part.removed_by != kNever))
        continue;
      Count& count = counts[part.component];
      count.free += part.level > 0.0F ? 1.0F : 0.0F;
      count.hit += part.level < 0.0F ? 1.0F : 0.0F;
      count.all += 1.0F;
    }
    for (std::uint32_t i = 0; i < end; ++i) {
      Part& part = parts_[i];
      if (part.component == kNoIndex || part.removed_by != kNever) continue;
      const Count& count = counts[part.component];
      const Limits& limits = by == part.session ? kNotStanding : kLeft;
      const bool has_left = count.free > 0.0F && count.free >= limits.per_hit * count.hit &&
                            count.free >= limits.of_all * count.all;
      if (has_left) part.removed_by = by;
    }
  }

  SessionGrid grid_;
  // Log-odds of the update probabilities of a free and of a hit part (Eq. 18).
  float free_ = static_cast<float>(log_odds(0.7));
  float hit_ = static_cast<float>(log_odds(0.155));
  float level_ = static_cast<float>(log_odds(0.95));  // from which a part is free (Eq. 19)
  std::vector<Session> sessions_;
  VoxelTile<Block> blocks_;
  std::vector<Part> parts_;  // session by session
  std::uint32_t component_count_ = 0;
  std::uint32_t tested_count_ = 0;  // sessions whose references have tested the points
  TestedCells tested_;
};

}  // namespace dynains
