// Instances of a chunk under the numbers that they have in the whole run.
#pragma once

#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/verdict.hpp"

namespace dynains::program {

/// Instances of a chunk that its neighbours need.
struct ChunkInstances {
  /// By point of the scan that the chunk shares with the one before it, or with the one behind it.
  /// Empty if there is none.
  std::vector<std::uint32_t> shared_before, shared_behind;
  std::uint32_t last = kNoInstance;  ///< largest id in the own scans
  /// Ids, ascending, of `shared_before` that are static in an own scan.
  std::vector<std::uint32_t> still_before;
  /// Ids, ascending, that are dynamic in all of the last own scans.
  std::vector<std::uint32_t> moving_behind;
};

/// Translates ids of a chunk to ids of the run. A chunk numbers its instances from 1 in the order
/// of their appearance. An instance that the chunk before saw, too, keeps the id of that chunk; the
/// others get the numbers behind all ids before.
class InstanceNumbers {
 public:
  /// For the first chunk: ids stay.
  explicit InstanceNumbers(const ChunkInstances& chunk) : last_(chunk.last) {}

  /// For the chunk behind one with `before` and its numbers. An instance has the id of the instance
  /// with which it shares the most points of the shared scan; of two that want the same id, the one
  /// with more points gets it, and of two with equally many the one with the lower id.
  InstanceNumbers(const InstanceNumbers& numbers_before, const ChunkInstances& before,
                  const ChunkInstances& chunk);

  std::uint32_t operator()(std::uint32_t id) const {
    return id < known_.size() ? known_[id] : id + shift_;
  }
  /// Whether the chunk before calls an instance of this chunk dynamic up to the border. Its id of
  /// the chunk.
  bool moved_before(std::uint32_t id) const { return id < moved_.size() && moved_[id]; }
  /// Largest id of the run in this chunk and those before.
  std::uint32_t last() const { return last_; }

 private:
  std::vector<std::uint32_t> known_;  // by id in the chunk, for those up to the shared scan
  std::vector<bool> moved_;           // by id in the chunk, as known_
  std::uint32_t shift_ = 0;           // of all others; may wrap around
  std::uint32_t last_;
};

}  // namespace dynains::program
