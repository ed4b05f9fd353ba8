// Connected groups of supervoxels: separate objects within one instance.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/instance_samples.hpp"

namespace dynains {

/// Finds groups that are connected in the 26-neighbourhood.
class SupervoxelGroups {
 public:
  /// Removes those of `members` (supervoxels of one instance) whose group has fewer than
  /// `least_samples` samples; the order changes.
  void keep_large(const InstanceSamples& samples, std::size_t least_samples,
                  std::vector<std::uint32_t>& members) {
    entries_.clear();
    for (const std::uint32_t member : members) {
      entries_.push_back({samples.place[member], member, false});
    }
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
      return a.place != b.place ? a.place < b.place : a.member < b.member;
    });
    members.clear();
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      if (entries_[i].visited) continue;
      collect(i);
      std::size_t count = 0;
      for (const std::size_t entry : group_) {
        const std::uint32_t s = entries_[entry].member;
        count += samples.sample_begin[s + 1] - samples.sample_begin[s];
      }
      if (count < least_samples) continue;
      for (const std::size_t entry : group_) members.push_back(entries_[entry].member);
    }
  }

 private:
  struct Entry {
    VoxelKey place;
    std::uint32_t member;
    bool visited;
  };

  // Writes the group of one entry to group_.
  void collect(std::size_t first) {
    group_.assign(1, first);
    entries_[first].visited = true;
    for (std::size_t next = 0; next < group_.size(); ++next) {
      const VoxelKey place = entries_[group_[next]].place;
      for (int dx = -1; dx <= 1; ++dx) {
        for (int dy = -1; dy <= 1; ++dy) {
          // The three neighbours along z are consecutive in the order of keys.
          const VoxelKey low = place + voxel_key_step(dx, dy, -1);
          const VoxelKey high = place + voxel_key_step(dx, dy, 1);
          auto at = std::lower_bound(
              entries_.begin(), entries_.end(), low,
              [](const Entry& entry, VoxelKey value) { return entry.place < value; });
          for (; at != entries_.end() && at->place <= high; ++at) {
            if (at->visited) continue;
            at->visited = true;
            group_.push_back(static_cast<std::size_t>(at - entries_.begin()));
          }
        }
      }
    }
  }

  std::vector<Entry> entries_;
  std::vector<std::size_t> group_;
};

}  // namespace dynains
