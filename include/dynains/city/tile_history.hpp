// One tile of a map of many sessions: which points of which session stand after which session.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "dynains/belief/log_odds.hpp"
#include "dynains/city/common_blocks.hpp"
#include "dynains/city/session_ground.hpp"
#include "dynains/city/session_points.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Function from the contributions of all sessions to the points of one tile of the map.
///
/// First the points of all sessions are added, in the order of their time; then, in the same order,
/// the reference scans of each session test the points of all sessions. The points of a session
/// form blocks of 2 x 2 x 2 voxels. References test the blocks of their own session by its points,
/// and those of other sessions by common samples: of each voxel, the point of the first session
/// that has one (detail::CommonBlocks). A block sums its log-odds of being free session by session,
/// by Eq. 18:
/// - Sessions before its own tell whether its place was free. Its own session tells whether it
///   stands there. A block whose place was free, and that its own session hit too seldom, does not
///   enter the map.
/// - A later session that passes through it removes it.
/// Touching blocks above the ground form components. A component that has mostly left leaves as a
/// whole; if it is larger than a vehicle, each of its cubes of 8 blocks decides for itself. Later
/// sessions influence the blocks of a session by their references only, except that the ground of
/// all sessions tells what is ground: ground points above it, where no other session has any and
/// nothing stands, leave point by point.
class TileHistory {
 public:
  static constexpr std::uint32_t kNever = std::numeric_limits<std::uint32_t>::max();

  /// The session that removed a point, and its latest reference scan that passed through.
  struct Removal {
    std::uint32_t session = kNever;  ///< number in the order of the sessions
    std::uint32_t scan = 0;          ///< 0 if none passed: ground of another height removed it
  };

  /// References do not test blocks at a larger horizontal range, m.
  static constexpr double kRange = 60.0;

  /// Throws ConfigError.
  explicit TileHistory(const SessionGrid& grid) : grid_((grid.validate(), grid)), ground_(grid) {}

  std::size_t session_count() const { return sessions_.size(); }
  const std::vector<SessionPoint>& points(std::size_t session) const {
    return sessions_[session].points;
  }
  Removal removal(std::size_t session, std::size_t point) const {
    const Session& own = sessions_[session];
    const Removal& of_block = own.removal_of[own.block_of[point]];
    const std::uint32_t by = own.unconfirmed_by[point];
    return by < of_block.session ? Removal{by, 0} : of_block;
  }
  /// Number of references of its own session that hit the block of a point, up to 255.
  std::uint32_t own_hits(std::size_t session, std::size_t point) const {
    return sessions_[session].own_hits[sessions_[session].block_of[point]];
  }
  /// Whether a reference of its own session passed through the block of a point at some time.
  bool own_beams_passed(std::size_t session, std::size_t point) const {
    const Session& own = sessions_[session];
    return own.most_own_level[own.block_of[point]] >= level_;
  }
  /// Whether a point is no ground, or higher than the lowest ground around of the sessions that
  /// have tested.
  bool is_above_ground(const SessionPoint& point) const {
    return !point.is_ground || ground_.is_below(point);
  }
  /// Whether a point is neither removed by a session up to number `last`, nor newer than `last`.
  bool stands(std::size_t session, std::size_t point, std::uint32_t last) const {
    const std::uint32_t by = removal(session, point).session;
    return session <= last && (by == kNever || by > last);
  }

  /// Adds the points of the next session, in the order of their scans. All sessions are added
  /// before the first reference.
  void add_session(std::vector<SessionPoint> points) {
    Session session;
    session.number = static_cast<std::uint32_t>(sessions_.size());
    session.points = std::move(points);
    VoxelHashTable<>& blocks = session.blocks;
    session.block_of.reserve(session.points.size());
    std::vector<std::uint8_t> filled;  // by block: octants with points
    for (const SessionPoint& point : session.points) {
      const VoxelKey voxel = session_voxel(grid_, point);
      const VoxelKey key = voxel_key(voxel_index(voxel, 0) >> 1, voxel_index(voxel, 1) >> 1,
                                     voxel_index(voxel, 2) >> 1);
      const auto octant = static_cast<std::uint32_t>((voxel_index(voxel, 0) & 1) |
                                                     (voxel_index(voxel, 1) & 1) << 1 |
                                                     (voxel_index(voxel, 2) & 1) << 2);
      const std::uint32_t common = common_.add(key, octant, point);
      const std::uint32_t block = blocks.insert(key);
      session.block_of.push_back(block);
      if (block == session.keys.size()) {
        session.keys.push_back(key);
        session.common_of.push_back(common);
        filled.push_back(0);
      }
      filled[block] = static_cast<std::uint8_t>(filled[block] | 1U << octant);
    }
    for (std::size_t block = 0; block < filled.size(); ++block) {
      session.shape_of.push_back(common_.shape(session.common_of[block], filled[block]));
    }
    // Counting sort by block.
    session.begin.assign(blocks.size() + 1, 0);
    for (const std::uint32_t block : session.block_of) ++session.begin[block + 1];
    for (std::size_t i = 1; i < session.begin.size(); ++i) session.begin[i] += session.begin[i - 1];
    session.by_block.resize(session.points.size());
    std::vector<std::uint32_t> next = session.begin;
    for (std::uint32_t i = 0; i < session.points.size(); ++i) {
      session.by_block[next[session.block_of[i]]++] = i;
    }
    session.level.assign(blocks.size(), 0.0F);
    session.own_hits.assign(blocks.size(), 0);
    session.own_level.assign(blocks.size(), 0.0F);
    session.most_own_level.assign(blocks.size(), 0.0F);
    session.free_scan.assign(blocks.size(), 0);
    session.removal_of.assign(blocks.size(), Removal());
    session.unconfirmed_by.assign(session.points.size(), kNever);
    sessions_.push_back(std::move(session));
  }

  /// Tests all points by a reference scan of session number tested_count(). `sensor`: position of
  /// the sensor, m, in the frame of SessionPoint. `test_visibility(points, count)`: see
  /// detail::test_visibility(); points in the frame of SessionPoint, relative to `sensor`.
  template <class TestVisibility>
  void revise(std::uint32_t scan, const Eigen::Vector3d& sensor, TestVisibility&& test_visibility) {
    if (!has_begun_session_) begin_session();
    Session& own = sessions_[tested_count_];
    gather(own, sensor);
    if (!tested_.empty()) {
      const auto& visibility = test_visibility(samples_, std::size_t{begin_.back()});
      for (std::size_t i = 0; i < tested_.size(); ++i) {
        const auto count = visibility.count(begin_[i], begin_[i + 1]);
        const int verdict =
            detail::FreeSpaceSum::judge(count.free, count.hit, begin_[i + 1] - begin_[i]);
        if (verdict != 0) update(verdict > 0, scan, own, tested_[i]);
      }
    }
    common_.test(scan, sensor, kRange, test_visibility, detail::FreeSpaceSum::judge);
  }

  /// Number of sessions whose references have tested the points.
  std::size_t tested_count() const { return tested_count_; }

  /// Ends the references of session number tested_count().
  void end_session() {
    if (!has_begun_session_) begin_session();
    has_begun_session_ = false;
    const auto by = static_cast<std::uint32_t>(tested_count_++);
    for (Session& session : sessions_) {
      if (session.number != by) take_evidence(session);
    }
    sessions_[by].ground = ground_.add(by, sessions_[by].points);
    find_components(sessions_[by]);
    for (std::uint32_t i = 0; i <= by; ++i) {
      remove_blocks(by, sessions_[i]);
      remove_components(by, sessions_[i]);
      remove_unconfirmed_ground(by, sessions_[i]);
    }
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      // A few references of the session itself outweigh whatever earlier sessions have seen.
      const float most = i == tested_count_ ? level_ : kNoLimit;
      for (float& level : sessions_[i].level) level = std::clamp(level, 0.0F, most);
    }
  }

  /// Calls `visit(session, point)` for the points of the map after session number `last`: of each
  /// voxel the point of the newest session that stands there. Points come in the order of sessions.
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
  static constexpr std::uint32_t kNone = VoxelHashTable<>::kNone;
  static constexpr float kNoLimit = std::numeric_limits<float>::max();
  static constexpr double kCompactLength = 18.0, kCompactHeight = 4.5;  // m

  /// Least numbers of free blocks from which a component has left.
  struct Limits {
    float per_hit;  ///< ratio to the blocks that are hit
    float of_all;   ///< ratio to all its blocks
  };
  static constexpr Limits kNotStanding = {2.0F, 0.3F};   // in its own session
  static constexpr Limits kCompactLeft = {0.25F, 0.1F};  // the size of a vehicle
  static constexpr Limits kLeft = {1.0F, 0.2F};
  static constexpr int kCubeBits = 3;  // cubes of 8 blocks

  struct Session {
    std::uint32_t number = 0;
    std::vector<SessionPoint> points;
    VoxelHashTable<> blocks;                    // numbers of the keys
    std::vector<VoxelKey> keys;                 // by block
    std::vector<std::uint32_t> common_of;       // by block: number in CommonBlocks
    std::vector<std::uint32_t> shape_of;        // by block: number in CommonBlocks
    std::vector<std::uint32_t> block_of;        // by point
    std::vector<std::uint32_t> begin;           // by block: in by_block
    std::vector<std::uint32_t> by_block;        // points, sorted by block
    std::vector<float> level;                   // by block: log-odds of being free
    std::vector<float> own_level;               // by block: sum of this session, never below zero
    std::vector<float> most_own_level;          // by block: highest own_level
    std::vector<std::uint8_t> own_hits;         // by block: references of this session that hit
    std::vector<std::uint32_t> free_scan;       // by block: latest reference that passed
    std::vector<std::uint32_t> component_of;    // by block, or kNone for ground
    std::vector<std::uint8_t> is_compact;       // by component
    std::vector<Removal> removal_of;            // by block
    std::vector<std::uint32_t> unconfirmed_by;  // by point: session that removed it alone
    detail::LowestGround ground;
  };

  // Removes the points that are unconfirmed ground after session number `by`, unless an object
  // stands beside them.
  void remove_unconfirmed_ground(std::uint32_t by, Session& session) const {
    for (std::uint32_t i = 0; i < session.points.size(); ++i) {
      const std::uint32_t block = session.block_of[i];
      if (removal(session.number, i).session != kNever) continue;
      if (!ground_.is_unconfirmed(session.number, session.ground, session.points[i])) continue;
      if (!touches_standing_object(session, session.keys[block])) session.unconfirmed_by[i] = by;
    }
  }

  static bool touches_standing_object(const Session& session, const VoxelKey& key) {
    for (int i = 0; i < 27; ++i) {
      const std::uint32_t block =
          session.blocks.find(key + voxel_key_step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
      if (block == kNone || session.component_of[block] == kNone) continue;
      if (session.removal_of[block].session == kNever) return true;
    }
    return false;
  }

  // Numbers the components of touching blocks with points above the ground.
  void find_components(Session& session) const {
    const std::vector<VoxelKey>& keys = session.keys;
    std::vector<std::uint8_t> is_object(keys.size(), 0);
    for (std::size_t i = 0; i < session.points.size(); ++i) {
      if (is_above_ground(session.points[i])) is_object[session.block_of[i]] = 1;
    }
    session.component_of.assign(keys.size(), kNone);
    std::vector<std::uint32_t> members;
    for (std::uint32_t first = 0; first < keys.size(); ++first) {
      if (is_object[first] == 0 || session.component_of[first] != kNone) continue;
      const auto component = static_cast<std::uint32_t>(session.is_compact.size());
      session.component_of[first] = component;
      members.assign(1, first);
      for (std::size_t next = 0; next < members.size(); ++next) {
        for (int i = 0; i < 27; ++i) {
          const std::uint32_t block = session.blocks.find(
              keys[members[next]] + voxel_key_step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
          const bool is_new =
              block != kNone && is_object[block] != 0 && session.component_of[block] == kNone;
          if (!is_new) continue;
          session.component_of[block] = component;
          members.push_back(block);
        }
      }
      if (is_compact(keys, members)) {
        session.is_compact.push_back(1);
      } else {
        divide(members, session);
      }
    }
  }

  // Makes a component of each cube of a larger one: a tree that was felled beside others leaves
  // alone.
  static void divide(const std::vector<std::uint32_t>& members, Session& session) {
    const auto first = static_cast<std::uint32_t>(session.is_compact.size());
    VoxelHashTable<> cubes;
    for (const std::uint32_t block : members) {
      const VoxelKey& key = session.keys[block];
      const auto cube = [&](int axis) { return voxel_index(key, axis) >> kCubeBits; };
      session.component_of[block] = first + cubes.insert(voxel_key(cube(0), cube(1), cube(2)));
    }
    session.is_compact.resize(first + cubes.size(), 0);
  }

  bool is_compact(const std::vector<VoxelKey>& keys,
                  const std::vector<std::uint32_t>& blocks) const {
    const double edge = 2.0 * grid_.map_voxel;
    for (int axis = 0; axis < 3; ++axis) {
      std::int64_t lowest = voxel_index(keys[blocks[0]], axis), highest = lowest;
      for (const std::uint32_t block : blocks) {
        lowest = std::min(lowest, voxel_index(keys[block], axis));
        highest = std::max(highest, voxel_index(keys[block], axis));
      }
      const double extent = edge * static_cast<double>(highest - lowest + 1);
      if (extent > (axis < 2 ? kCompactLength : kCompactHeight)) return false;
    }
    return true;
  }

  // Removes the blocks that are free after session number `by`. In the session that measured them,
  // remove_components() decides about the blocks of a component.
  void remove_blocks(std::uint32_t by, Session& session) const {
    for (std::size_t block = 0; block < session.level.size(); ++block) {
      const bool is_undivided = by == session.number && session.component_of[block] != kNone;
      const bool is_free = session.level[block] >= level_ && !is_undivided;
      if (is_free && session.removal_of[block].session == kNever) {
        session.removal_of[block] = {by, session.free_scan[block]};
      }
    }
  }

  // Removes the rest of the components that have left by the references of session number `by`.
  static void remove_components(std::uint32_t by, Session& session) {
    struct Count {
      std::uint32_t free = 0, hit = 0, unknown = 0, scan = 0;
    };
    std::vector<Count> counts(session.is_compact.size());
    for (std::size_t block = 0; block < session.component_of.size(); ++block) {
      if (session.component_of[block] == kNone) continue;
      Count& count = counts[session.component_of[block]];
      const Removal& removal = session.removal_of[block];
      if (removal.session != by && removal.session != kNever) continue;
      if (session.level[block] > 0.0F) {
        ++count.free;
        count.scan = std::max(count.scan, session.free_scan[block]);
      } else {
        ++(session.level[block] < 0.0F ? count.hit : count.unknown);
      }
    }
    for (std::size_t block = 0; block < session.component_of.size(); ++block) {
      const std::uint32_t component = session.component_of[block];
      if (component == kNone || session.removal_of[block].session != kNever) continue;
      const Count& count = counts[component];
      const Limits& limits = by == session.number                 ? kNotStanding
                             : session.is_compact[component] != 0 ? kCompactLeft
                                                                  : kLeft;
      const auto free = static_cast<float>(count.free);
      const auto all = static_cast<float>(count.free + count.hit + count.unknown);
      const bool has_left = free > 0.0F && free >= limits.per_hit * static_cast<float>(count.hit) &&
                            free >= limits.of_all * all;
      if (has_left) session.removal_of[block] = {by, count.scan};
    }
  }

  // Collects the points of the blocks of a session that are near the sensor and not removed.
  void gather(const Session& session, const Eigen::Vector3d& sensor) {
    tested_.clear();
    begin_.assign(1, 0);
    for (std::uint32_t block = 0; block < session.level.size(); ++block) {
      if (session.removal_of[block].session != kNever) continue;
      const SessionPoint& first = session.points[session.by_block[session.begin[block]]];
      const double dx = static_cast<double>(first.x) - sensor.x();
      const double dy = static_cast<double>(first.y) - sensor.y();
      if (dx * dx + dy * dy > kRange * kRange) continue;
      std::uint32_t count = begin_.back();
      samples_.grow(count + (session.begin[block + 1] - session.begin[block]) + detail::kPackWidth);
      for (std::uint32_t i = session.begin[block]; i < session.begin[block + 1]; ++i) {
        const SessionPoint& point = session.points[session.by_block[i]];
        samples_.x[count] = static_cast<float>(static_cast<double>(point.x) - sensor.x());
        samples_.y[count] = static_cast<float>(static_cast<double>(point.y) - sensor.y());
        samples_.z[count] = static_cast<float>(static_cast<double>(point.z) - sensor.z());
        ++count;
      }
      tested_.push_back(block);
      begin_.push_back(count);
    }
  }

  // Adds what a reference of the own session tells.
  void update(bool is_free, std::uint32_t scan, Session& session, std::uint32_t block) const {
    const float step = is_free ? free_ : hit_;
    session.level[block] += step;
    if (is_free) session.free_scan[block] = scan;
    session.own_level[block] = std::max(0.0F, session.own_level[block] + step);
    session.most_own_level[block] =
        std::max(session.most_own_level[block], session.own_level[block]);
    std::uint8_t& hits = session.own_hits[block];
    if (!is_free && hits < 255) ++hits;
  }

  // Enables the common samples of what stands of the other sessions.
  void begin_session() {
    has_begun_session_ = true;
    common_.clear();
    for (const Session& session : sessions_) {
      if (session.number == tested_count_) continue;
      for (std::size_t block = 0; block < session.keys.size(); ++block) {
        if (session.removal_of[block].session != kNever) continue;
        common_.enable(session.common_of[block], session.shape_of[block]);
      }
    }
    common_.finish();
  }

  // Adds what the references of another session told.
  void take_evidence(Session& session) const {
    for (std::size_t block = 0; block < session.keys.size(); ++block) {
      if (session.removal_of[block].session != kNever) continue;
      const detail::CommonBlocks::Evidence& evidence = common_.evidence(session.shape_of[block]);
      session.level[block] +=
          static_cast<float>(evidence.free) * free_ + static_cast<float>(evidence.hit) * hit_;
      if (evidence.free > 0) session.free_scan[block] = evidence.free_scan;
    }
  }

  SessionGrid grid_;
  // Log-odds of the update probabilities of a free and of a hit block (Eq. 18).
  float free_ = static_cast<float>(log_odds(0.7));
  float hit_ = static_cast<float>(log_odds(0.155));
  float level_ = static_cast<float>(log_odds(0.95));  // from which a block is free (Eq. 19)
  std::vector<Session> sessions_;
  detail::CommonBlocks common_;
  std::size_t tested_count_ = 0;
  bool has_begun_session_ = false;
  detail::SessionGround ground_;       // of the sessions that have tested
  std::vector<std::uint32_t> tested_;  // blocks
  std::vector<std::uint32_t> begin_;   // by tested block: first sample, and the end
  PointBuffer samples_;
};

}  // namespace dynains
