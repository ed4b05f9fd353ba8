// Components of touching voxels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Calls `visit(key)` for a voxel and the 26 that touch it.
template <class Visitor>
void for_each_touching(VoxelKey key, Visitor&& visit) {
  for (int i = 0; i < 27; ++i) visit(key + voxel_key_step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
}

/// Finds components of touching voxels. Later calls reuse the memory.
class ComponentSearch {
 public:
  /// Calls `visit(members)` for each component; members are numbers in `keys`. `numbers` has the
  /// number of each key.
  template <class Visitor>
  void for_each(const std::vector<VoxelKey>& keys, const VoxelHashTable<>& numbers,
                Visitor&& visit) {
    is_done_.assign(keys.size(), false);
    for (std::uint32_t first = 0; first < keys.size(); ++first) {
      if (is_done_[first]) continue;
      is_done_[first] = true;
      members_.assign(1, first);
      for (std::size_t i = 0; i < members_.size(); ++i) {
        for_each_touching(keys[members_[i]], [&](VoxelKey key) {
          const std::uint32_t next = numbers.find(key);
          if (next == VoxelHashTable<>::kNone || is_done_[next]) return;
          is_done_[next] = true;
          members_.push_back(next);
        });
      }
      visit(members_);
    }
  }

 private:
  std::vector<bool> is_done_;
  std::vector<std::uint32_t> members_;
};

}  // namespace dynains
