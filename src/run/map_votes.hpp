// Votes of labelled scans on the points of a map.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::program {

/// Counts the static and the moving points of scans in the voxels that hold points of a map.
class MapVotes {
 public:
  enum class Verdict : std::uint8_t {
    kStatic,  ///< as many static as moving points of scans in the voxel, or more
    kMoving,
    kUnseen,  ///< no point of a scan in the voxel, or coordinates that are not finite
  };

  /// `map`: positions in the world frame, m. `voxel`: edge of the voxels, m, above 0.
  MapVotes(Span<const Eigen::Vector3d> map, double voxel) : voxel_(voxel) {
    voxels_.reserve(map.size());
    for (const Eigen::Vector3d& point : map) {
      // The first point is the centre of its voxel.
      if (!origin_ && point.allFinite()) origin_ = point.array() - 0.5 * voxel;
      const std::optional<VoxelKey> key = key_of(point);
      voxels_.push_back(key ? table_.insert(*key) : VoxelHashTable<>::kNone);
    }
    counts_.resize(table_.size());
  }

  std::size_t voxel_count() const { return counts_.size(); }

  /// Adds a point of a scan, in the world frame.
  void add(const Eigen::Vector3d& point, bool is_moving) {
    const std::optional<VoxelKey> key = key_of(point);
    const std::uint32_t voxel = key ? table_.find(*key) : VoxelHashTable<>::kNone;
    if (voxel != VoxelHashTable<>::kNone)
      ++(is_moving ? counts_[voxel].moving : counts_[voxel].rest);
  }

  /// Verdict on point `i` of the map.
  Verdict verdict(std::size_t i) const {
    if (voxels_[i] == VoxelHashTable<>::kNone) return Verdict::kUnseen;
    const Counts& counts = counts_[voxels_[i]];
    if (counts.moving > counts.rest) return Verdict::kMoving;
    return counts.rest > 0 ? Verdict::kStatic : Verdict::kUnseen;
  }

 private:
  struct Counts {
    std::uint32_t rest = 0, moving = 0;  // static and moving points
  };

  // Empty for points far from the map, and those that are not finite.
  std::optional<VoxelKey> key_of(const Eigen::Vector3d& point) const {
    if (!origin_) return std::nullopt;
    constexpr auto kEnd = static_cast<double>(kVoxelKeyOffset);
    std::int64_t index[3];
    for (int axis = 0; axis < 3; ++axis) {
      const double scaled = std::floor((point[axis] - (*origin_)[axis]) / voxel_);
      if (!(scaled >= -kEnd && scaled < kEnd)) return std::nullopt;
      index[axis] = static_cast<std::int64_t>(scaled);
    }
    return voxel_key(index[0], index[1], index[2]);
  }

  double voxel_;
  std::optional<Eigen::Vector3d> origin_;  // a corner of the voxels
  VoxelHashTable<> table_;
  std::vector<std::uint32_t> voxels_;  // by point of the map
  std::vector<Counts> counts_;         // by voxel
};

}  // namespace dynains::program
