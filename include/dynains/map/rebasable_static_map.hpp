// Static map whose scans can be moved afterwards, for loop closures.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/floor.hpp"
#include "dynains/voxels/block_table.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// The corrected pose of an inserted scan.
struct ScanPose {
  std::uint64_t scan = 0;  ///< number of the insertion, from 0; in a remover, ScanVerdict::scan
  Pose T_world_sensor = Pose::Identity();  ///< m, rigid
};

/// Sparse voxel map of measured points, at most one per voxel, as StaticMapAccumulator. It keeps
/// the points of each scan in the frame of the sensor, so update_poses() can move scans.
///
/// Each scan is thinned in its own frame: the first point of each voxel of `scan_voxel` is kept.
/// The map has, for each voxel of the world, the point of the earliest scan, and of its points the
/// first. It follows from the inserted scans and their last poses alone: after any sequence of
/// insertions and updates it equals a map into which the scans were inserted with these poses,
/// point for point and in order.
///
/// All thinned points stay in memory, also those of voxels that another scan fills, because they
/// may be needed after an update: 21 bytes per point and some bytes per run of neighbouring points,
/// 22 bytes per point in the benchmark. The memory grows with the number of scans, not with the
/// mapped area.
///
/// Use as `Stages::Map`:
///
///     struct Stages : dynains::DefaultStages { using Map = dynains::RebasableStaticMap; };
///     dynains::BasicDynaInsRemover<Stages> remover;
///     ...
///     remover.mutable_map().update_poses(corrected);
///
/// A correction may be divided into several calls, with insertions between them.
class RebasableStaticMap {
 public:
  struct Config {
    double map_voxel = 0.2;   ///< m
    double scan_voxel = 0.4;  ///< m, resolution of a single scan; many scans fill the map

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"map_voxel", self.map_voxel, closed(0.01, 10), "m",
                        "resolution of the static map, one measured point per voxel"});
      visitor(Parameter{"scan_voxel", self.scan_voxel, closed(0.01, 10), "m",
                        "resolution at which the points of a single scan are kept"});
    }

    /// Throws ConfigError.
    void validate() const { validate_parameters("RebasableStaticMap", *this); }
  };

  RebasableStaticMap() : RebasableStaticMap(Config()) {}

  /// Throws ConfigError.
  explicit RebasableStaticMap(const Config& config)
      : config_((config.validate(), config)),
        voxel_(config.map_voxel),
        blocks_per_m_{1.0 / block_size(0), 1.0 / block_size(1), 1.0 / block_size(2)} {}

  const Config& config() const { return config_; }

  /// Adds a scan, also without any point: scans are numbered by insertions. `points`: m, sensor
  /// frame. `keep`: by point, 0 for points to ignore; an empty `keep` adds all points. Coordinates
  /// beyond 2^19 voxels of `scan_voxel` are ignored. `T_world_sensor`: rigid, translation within
  /// kMaxTranslation. Throws std::length_error beyond 2^32 - 2 points, and std::bad_alloc.
  void insert(PointsView points, Span<const std::uint8_t> keep, const Pose& T_world_sensor) {
    insert(points, keep, T_world_sensor, T_world_sensor);
  }

  /// As above, for points in another frame.
  void insert(PointsView points, Span<const std::uint8_t> keep, const Pose& T_world_points,
              const Pose& T_world_sensor) {
    const std::uint32_t first = points_.size();
    taken_.clear();
    const bool is_turned = T_world_points.matrix() != T_world_sensor.matrix();
    const Eigen::Matrix3d R_sensor_points =
        T_world_sensor.linear().transpose() * T_world_points.linear();
    const Eigen::Vector3d points_in_sensor =
        T_world_sensor.linear().transpose() *
        (T_world_points.translation() - T_world_sensor.translation());
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!keep.empty() && keep[i] == 0) continue;
      Eigen::Vector3f p(points.x[i], points.y[i], points.z[i]);
      if (is_turned) p = (R_sensor_points * p.cast<double>() + points_in_sensor).cast<float>();
      if (is_first_of_voxel(p)) points_.push_back({p.x(), p.y(), p.z()});
    }
    scans_.push_back({orthonormalized(T_world_sensor), first, points_.size() - first});
    link(static_cast<std::uint32_t>(scans_.size() - 1));
  }

  /// Moves scans to corrected poses; the last pose of a scan counts. Scans that are not listed
  /// stay. The time depends on the moved points and on the points in their blocks, not on the map.
  /// Throws UsageError for a scan that was not inserted and PoseError for an invalid pose; the map
  /// is unchanged then. After std::bad_alloc, the map is valid only after clear().
  void update_poses(Span<const ScanPose> poses) {
    for (const ScanPose& pose : poses) {
      if (pose.scan >= scans_.size()) {
        throw UsageError("scan " + std::to_string(pose.scan) + " is not in the map, which has " +
                         std::to_string(scans_.size()) + " scans");
      }
      validate_pose("T_world_sensor", pose.T_world_sensor);
    }
    std::vector<std::uint8_t> is_moved(scans_.size(), 0);
    std::vector<std::uint32_t> moved;
    for (const ScanPose& pose : poses) {
      if (is_moved[pose.scan] != 0) continue;
      is_moved[pose.scan] = 1;
      moved.push_back(static_cast<std::uint32_t>(pose.scan));
    }
    unlink(moved, is_moved);
    for (const ScanPose& pose : poses) {
      scans_[pose.scan].T_world_sensor = orthonormalized(pose.T_world_sensor);
    }
    for (const std::uint32_t scan : moved) link(scan);
  }

  /// Number of inserted scans.
  std::size_t scan_count() const { return scans_.size(); }
  /// Last pose of a scan below scan_count().
  const Pose& T_world_sensor(std::size_t scan) const { return scans_.at(scan).T_world_sensor; }
  /// Number of points in memory, in all scans.
  std::size_t stored_points() const { return points_.size(); }
  /// Number of points that for_each() visits. It passes over the whole map.
  std::size_t size() const {
    std::size_t count = 0;
    for_each([&](const Eigen::Vector3d&) { ++count; });
    return count;
  }
  bool empty() const { return points_.size() == 0; }

  /// Removes all scans and frees their memory.
  void clear() {
    scans_ = {};
    points_ = {};
    blocks_ = {};
    taken_ = VoxelHashTable<>();
  }

  /// Memory of the map, including its index, bytes.
  std::size_t memory_bytes() const {
    std::size_t bytes = points_.memory_bytes() + blocks_.memory_bytes() +
                        scans_.capacity() * sizeof(Scan) + taken_.memory_bytes();
    for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
      bytes += blocks_[b].data.capacity() * sizeof(Run);
    }
    return bytes;
  }

  /// Calls `visit(Eigen::Vector3d)` for every point (m, world frame), in the order of the voxels of
  /// each block and of the blocks by x, y, z.
  template <class Visitor>
  void for_each(Visitor&& visit) const {
    std::vector<std::uint32_t> blocks;
    for (std::uint32_t b = 0; b < blocks_.size(); ++b) blocks.push_back(b);
    visit_blocks(std::move(blocks), visit);
  }

  /// Calls `visit(Eigen::Vector3d)` for every point (m, world frame) inside `box` (m, world frame,
  /// borders included), in the order of for_each(). The cost is proportional to the points in the
  /// blocks of the box, and to the number of possible blocks in the box or of the blocks of the
  /// map, whichever is smaller.
  template <class Visitor>
  void for_each_in(const Eigen::AlignedBox3d& box, Visitor&& visit) const {
    if (box.isEmpty()) return;
    visit_blocks(blocks_of(box), [&](const Eigen::Vector3d& point) {
      if (box.contains(point)) visit(point);
    });
  }

 private:
  using BlockIndex = detail::BlockIndex;
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr std::array<int, 3> kBlockVoxels = {8, 8, 4};
  static constexpr std::size_t kVoxels = 256;  // of a block

  struct Point {
    float x, y, z;  // m, sensor frame
  };
  struct Scan {
    Pose T_world_sensor;
    std::uint32_t first;  // point
    std::uint32_t count;  // points
  };
  // Consecutive points of a scan that lie in one block.
  struct Run {
    std::uint32_t first;  // point
    std::uint32_t count;  // points
    std::uint32_t scan;
  };
  using Blocks = detail::BlockTable<std::vector<Run>>;

  double block_size(std::size_t axis) const { return voxel_ * kBlockVoxels[axis]; }

  bool is_first_of_voxel(const Eigen::Vector3f& p) {
    constexpr double kFarthest = 524288.0;  // voxels
    std::array<std::int64_t, 3> index{};
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double at = std::floor(static_cast<double>(p[axis]) / config_.scan_voxel);
      if (!(std::abs(at) < kFarthest)) return false;
      index[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(at);
    }
    const std::size_t before = taken_.size();
    taken_.insert(voxel_key(index[0], index[1], index[2]));
    return taken_.size() > before;
  }

  static Eigen::Vector3d to_world(const Pose& T, const Point& p) {
    const auto x = static_cast<double>(p.x), y = static_cast<double>(p.y),
               z = static_cast<double>(p.z);
    return {T(0, 0) * x + T(0, 1) * y + T(0, 2) * z + T(0, 3),
            T(1, 0) * x + T(1, 1) * y + T(1, 2) * z + T(1, 3),
            T(2, 0) * x + T(2, 1) * y + T(2, 2) * z + T(2, 3)};
  }

  BlockIndex block_of(const Eigen::Vector3d& point) const {
    return {detail::floor_to<std::int32_t>(point.x() * blocks_per_m_[0]),
            detail::floor_to<std::int32_t>(point.y() * blocks_per_m_[1]),
            detail::floor_to<std::int32_t>(point.z() * blocks_per_m_[2])};
  }

  /// Calls `visit(BlockIndex, first, count)` for the runs of a scan.
  template <class Visitor>
  void visit_runs(const Scan& scan, Visitor&& visit) const {
    const std::uint32_t end = scan.first + scan.count;
    for (std::uint32_t begin = scan.first; begin < end;) {
      const BlockIndex block = block_of(to_world(scan.T_world_sensor, points_[begin]));
      std::uint32_t next = begin + 1;
      while (next < end && block_of(to_world(scan.T_world_sensor, points_[next])) == block) ++next;
      visit(block, begin, next - begin);
      begin = next;
    }
  }

  void link(std::uint32_t scan) {
    visit_runs(scans_[scan],
               [&](const BlockIndex& index, std::uint32_t first, std::uint32_t count) {
                 blocks_[blocks_.find_or_add(index, {})].data.push_back({first, count, scan});
               });
  }

  void unlink(const std::vector<std::uint32_t>& scans, const std::vector<std::uint8_t>& is_moved) {
    std::vector<std::uint8_t> is_done(blocks_.size(), 0);
    for (const std::uint32_t scan : scans) {
      visit_runs(scans_[scan], [&](const BlockIndex& index, std::uint32_t, std::uint32_t) {
        const std::uint32_t block = blocks_.find(index);
        if (block == kNone || is_done[block] != 0) return;
        is_done[block] = 1;
        std::vector<Run>& runs = blocks_[block].data;
        runs.erase(std::remove_if(runs.begin(), runs.end(),
                                  [&](const Run& run) { return is_moved[run.scan] != 0; }),
                   runs.end());
        if (runs.empty()) std::vector<Run>().swap(runs);
      });
    }
  }

  /// Blocks that may contain points of the box.
  std::vector<std::uint32_t> blocks_of(const Eigen::AlignedBox3d& box) const {
    constexpr double kFarthest = std::numeric_limits<std::int32_t>::max() - 1;
    std::array<std::int32_t, 3> first{}, last{};
    double count = 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<Eigen::Index>(axis);
      const double low = std::floor(box.min()[at] * blocks_per_m_[axis]);
      const double high = std::floor(box.max()[at] * blocks_per_m_[axis]);
      first[axis] = static_cast<std::int32_t>(std::clamp(low, -kFarthest, kFarthest));
      last[axis] = static_cast<std::int32_t>(std::clamp(high, -kFarthest, kFarthest));
      count *= static_cast<double>(last[axis]) - first[axis] + 1.0;
    }
    std::vector<std::uint32_t> blocks;
    if (!(count < static_cast<double>(blocks_.size()))) {
      for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
        const BlockIndex& i = blocks_[b].index;
        if (i.x >= first[0] && i.x <= last[0] && i.y >= first[1] && i.y <= last[1] &&
            i.z >= first[2] && i.z <= last[2]) {
          blocks.push_back(b);
        }
      }
      return blocks;
    }
    for (std::int32_t x = first[0]; x <= last[0]; ++x) {
      for (std::int32_t y = first[1]; y <= last[1]; ++y) {
        for (std::int32_t z = first[2]; z <= last[2]; ++z) {
          const std::uint32_t block = blocks_.find({x, y, z});
          if (block != kNone) blocks.push_back(block);
        }
      }
    }
    return blocks;
  }

  template <class Visitor>
  void visit_blocks(std::vector<std::uint32_t> blocks, Visitor&& visit) const {
    std::sort(blocks.begin(), blocks.end(), [&](std::uint32_t a, std::uint32_t b) {
      const BlockIndex &i = blocks_[a].index, &k = blocks_[b].index;
      return i.x != k.x ? i.x < k.x : i.y != k.y ? i.y < k.y : i.z < k.z;
    });
    for (const std::uint32_t block : blocks) visit_block(block, visit);
  }

  /// The first point of each voxel; points are numbered by scans.
  template <class Visitor>
  void visit_block(std::uint32_t block, Visitor&& visit) const {
    struct First {
      std::uint32_t point = kNone;
      std::uint32_t scan = 0;
    };
    std::array<First, kVoxels> first;
    const BlockIndex& index = blocks_[block].index;
    for (const Run& run : blocks_[block].data) {
      const Pose& T = scans_[run.scan].T_world_sensor;
      for (std::uint32_t i = run.first; i < run.first + run.count; ++i) {
        First& entry = first[voxel_in(index, to_world(T, points_[i]))];
        if (i < entry.point) entry = {i, run.scan};
      }
    }
    for (const First& entry : first) {
      if (entry.point == kNone) continue;
      visit(to_world(scans_[entry.scan].T_world_sensor, points_[entry.point]));
    }
  }

  std::size_t voxel_in(const BlockIndex& block, const Eigen::Vector3d& point) const {
    const std::array<std::int32_t, 3> index = {block.x, block.y, block.z};
    std::size_t voxel = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double offset = point[static_cast<Eigen::Index>(axis)] - index[axis] * block_size(axis);
      // A point on a border can be rounded to either side of it.
      const int last = kBlockVoxels[axis] - 1;
      const int at = std::clamp(detail::floor_to<std::int32_t>(offset / voxel_), 0, last);
      voxel = voxel * static_cast<std::size_t>(kBlockVoxels[axis]) + static_cast<std::size_t>(at);
    }
    return voxel;
  }

  Config config_;
  double voxel_;                        // m
  std::array<double, 3> blocks_per_m_;  // along each axis
  std::vector<Scan> scans_;
  detail::ChunkedVector<Point, 4096> points_;  // in the order of the scans
  Blocks blocks_;
  VoxelHashTable<> taken_;  // voxels of the scan at hand
};

}  // namespace dynains
