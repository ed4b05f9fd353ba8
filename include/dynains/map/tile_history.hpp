// One tile of a map of many sessions: which points of which session stand after which session.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "dynains/map/session_points.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/stage/free_space_config.hpp"
#include "dynains/stage/log_odds.hpp"
#include "dynains/stage/voxel_hash_table.hpp"

namespace dynains {

/// Function from the contributions of all sessions to the points of one tile of the map.
///
/// The sessions come in the order of their time: for each, first its reference scans revise the
/// points of earlier sessions, then its own points are added. The points of a session form blocks
/// of 2 x 2 x 2 voxels. A block sums its log-odds of being free over the references of all later
/// sessions, by the rules of MapRevision. If most of the decided blocks of a component of
/// touching blocks above the ground have left, the whole component leaves. Blocks of different
/// sessions do not influence each other, so without a session the others have the results of never
/// having had it.
class TileHistory {
 public:
  static constexpr std::uint32_t kNever = std::numeric_limits<std::uint32_t>::max();

  /// The reference scan whose beams removed a point.
  struct Removal {
    std::uint32_t session = kNever;  ///< number in the order of the sessions
    std::uint32_t scan = 0;
  };

  /// Throws ConfigError.
  TileHistory(const SessionGrid& grid, const MapRevisionConfig& config)
      : grid_((grid.validate(), grid)),
        config_((config.validate(), config)),
        sum_(config.revision_free, config.revision_hit),
        level_(static_cast<float>(log_odds(config.tau_revise))) {}

  std::size_t session_count() const { return sessions_.size(); }
  const std::vector<SessionPoint>& points(std::size_t session) const {
    return sessions_[session].points;
  }
  const Removal& removal(std::size_t session, std::size_t point) const {
    const Session& own = sessions_[session];
    return own.removal_of[own.block_of[point]];
  }
  /// Whether a point is neither removed by a session up to number `last`, nor newer than `last`.
  bool stands(std::size_t session, std::size_t point, std::uint32_t last) const {
    const std::uint32_t by = removal(session, point).session;
    return session <= last && (by == kNever || by > last);
  }

  /// Revises all points that were added so far by a reference scan of the next session, number
  /// session_count(). `sensor`: position of the sensor, m, in the frame of SessionPoint.
  /// `test_visibility(points, count)`: see detail::test_visibility(); points in the frame of
  /// SessionPoint, relative to `sensor`.
  template <class TestVisibility>
  void revise(std::uint32_t scan, const Eigen::Vector3d& sensor, TestVisibility&& test_visibility) {
    const auto by = static_cast<std::uint32_t>(sessions_.size());
    for (Session& session : sessions_) {
      gather(session, sensor);
      if (tested_.empty()) continue;
      const auto& visibility = test_visibility(samples_, std::size_t{begin_.back()});
      for (std::size_t i = 0; i < tested_.size(); ++i) {
        const auto count = visibility.count(begin_[i], begin_[i + 1]);
        float& level = session.level[tested_[i]];
        update(count.free, count.hit, begin_[i + 1] - begin_[i], level, session.is_hit[tested_[i]]);
        if (level < level_) continue;
        session.removal_of[tested_[i]] = {by, scan};
        session.newest_removal_scan = scan;
      }
    }
  }

  /// Adds the points of the next session, in the order of their scans.
  void add_session(std::vector<SessionPoint> points) {
    const auto number = static_cast<std::uint32_t>(sessions_.size());
    for (Session& earlier : sessions_) remove_components(number, earlier);
    Session session;
    session.points = std::move(points);
    VoxelHashTable<> blocks;
    std::vector<VoxelKey> keys;  // by block
    session.block_of.reserve(session.points.size());
    for (const SessionPoint& point : session.points) {
      const VoxelKey voxel = session_voxel(grid_, point);
      const VoxelKey block = voxel_key(voxel_index(voxel, 0) >> 1, voxel_index(voxel, 1) >> 1,
                                       voxel_index(voxel, 2) >> 1);
      session.block_of.push_back(blocks.insert(block));
      if (session.block_of.back() == keys.size()) keys.push_back(block);
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
    session.is_hit.assign(blocks.size(), 0);
    find_components(blocks, keys, session);
    session.removal_of.assign(blocks.size(), Removal());
    sessions_.push_back(std::move(session));
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
  static constexpr float kLeastVisible = 0.3F;  // ratio of visible to all samples of a block

  struct Session {
    std::vector<SessionPoint> points;
    std::vector<std::uint32_t> block_of;        // by point
    std::vector<std::uint32_t> begin;           // by block: in by_block
    std::vector<std::uint32_t> by_block;        // points, sorted by block
    std::vector<float> level;                   // by block: log-odds of being free
    std::vector<std::uint8_t> is_hit;           // by block: whether the latest evidence is a hit
    std::vector<std::uint32_t> component_of;    // by block, or kNone for ground
    std::vector<std::uint32_t> component_size;  // blocks, by component
    std::uint32_t newest_removal_scan = 0;
    std::vector<Removal> removal_of;  // by block
  };

  // Numbers the components of touching blocks with points above the ground.
  static void find_components(const VoxelHashTable<>& blocks, const std::vector<VoxelKey>& keys,
                              Session& session) {
    std::vector<std::uint8_t> is_object(keys.size(), 0);
    for (std::size_t i = 0; i < session.points.size(); ++i) {
      if (!session.points[i].is_ground) is_object[session.block_of[i]] = 1;
    }
    session.component_of.assign(keys.size(), kNone);
    std::vector<std::uint32_t> open;
    for (std::uint32_t first = 0; first < keys.size(); ++first) {
      if (is_object[first] == 0 || session.component_of[first] != kNone) continue;
      const auto component = static_cast<std::uint32_t>(session.component_size.size());
      session.component_size.push_back(0);
      session.component_of[first] = component;
      open.assign(1, first);
      while (!open.empty()) {
        const std::uint32_t block = open.back();
        open.pop_back();
        ++session.component_size[component];
        for (int i = 0; i < 27; ++i) {
          const std::uint32_t next =
              blocks.find(keys[block] + voxel_key_step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
          const bool is_new =
              next != kNone && is_object[next] != 0 && session.component_of[next] == kNone;
          if (!is_new) continue;
          session.component_of[next] = component;
          open.push_back(next);
        }
      }
    }
  }

  // Removes the rest of the components that have left mostly after session number `by`.
  static void remove_components(std::uint32_t by, Session& session) {
    struct Count {
      std::uint32_t removed = 0, hit = 0;
    };
    std::vector<Count> counts(session.component_size.size());
    for (std::size_t block = 0; block < session.component_of.size(); ++block) {
      if (session.component_of[block] == kNone) continue;
      Count& count = counts[session.component_of[block]];
      if (session.removal_of[block].session != kNever) {
        ++count.removed;
      } else if (session.is_hit[block] != 0) {
        ++count.hit;
      }
    }
    for (std::size_t block = 0; block < session.component_of.size(); ++block) {
      const std::uint32_t component = session.component_of[block];
      if (component == kNone || session.removal_of[block].session != kNever) continue;
      const Count& count = counts[component];
      const bool has_left = count.removed > 0 && count.removed >= count.hit &&
                            5 * count.removed >= session.component_size[component];
      if (has_left) session.removal_of[block] = {by, session.newest_removal_scan};
    }
  }

  // Collects the points of the blocks of a session that are near the sensor and not removed.
  void gather(const Session& session, const Eigen::Vector3d& sensor) {
    tested_.clear();
    begin_.assign(1, 0);
    const double range = config_.revision_range;
    for (std::uint32_t block = 0; block < session.level.size(); ++block) {
      if (session.removal_of[block].session != kNever) continue;
      const SessionPoint& first = session.points[session.by_block[session.begin[block]]];
      const double dx = static_cast<double>(first.x) - sensor.x();
      const double dy = static_cast<double>(first.y) - sensor.y();
      if (dx * dx + dy * dy > range * range) continue;
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

  void update(std::uint32_t free, std::uint32_t hit, std::uint32_t samples, float& level,
              std::uint8_t& is_hit) const {
    const auto visible = static_cast<float>(free + hit);
    const auto least = static_cast<float>(std::min(2U, samples));
    if (visible < std::max(least, kLeastVisible * static_cast<float>(samples))) return;
    const float free_ratio = static_cast<float>(free) / visible;
    if (free_ratio >= detail::FreeSpaceSum::kFreeRatio) {
      sum_.raise(level, free_ratio);
      is_hit = 0;
    }
    if (free_ratio <= detail::FreeSpaceSum::kHitRatio) {
      sum_.lower(level);
      is_hit = 1;
    }
  }

  SessionGrid grid_;
  MapRevisionConfig config_;
  detail::FreeSpaceSum sum_;
  float level_;
  std::vector<Session> sessions_;
  std::vector<std::uint32_t> tested_;  // blocks
  std::vector<std::uint32_t> begin_;   // by tested block: first sample, and the end
  PointBuffer samples_;
};

}  // namespace dynains
