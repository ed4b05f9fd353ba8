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

/// Calls `visit(members)` for each component of touching voxels; members are numbers in `keys`.
/// `numbers` has the number of each key.
template <class Visitor>
void for_each_component(const std::vector<VoxelKey>& keys, const VoxelHashTable<>& numbers,
                        Visitor&& visit) {
  std::vector<bool> is_done(keys.size(), false);
  std::vector<std::uint32_t> members;
  for (std::uint32_t first = 0; first < keys.size(); ++first) {
    if (is_done[first]) continue;
    is_done[first] = true;
    members.assign(1, first);
    for (std::size_t i = 0; i < members.size(); ++i) {
      for_each_touching(keys[members[i]], [&](VoxelKey key) {
        const std::uint32_t next = numbers.find(key);
        if (next == VoxelHashTable<>::kNone || is_done[next]) return;
        is_done[next] = true;
        members.push_back(next);
      });
    }
    visit(members);
  }
}

}  // namespace dynains
