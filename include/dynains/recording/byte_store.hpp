// Where data of a recording waits that is not needed at the moment.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <vector>

#include "dynains/points.hpp"

namespace dynains {

/// Bytes that are added once and read later, in any order. Implementations may throw.
class ByteStore {
 public:
  ByteStore() = default;
  ByteStore(const ByteStore&) = delete;
  ByteStore& operator=(const ByteStore&) = delete;
  virtual ~ByteStore() = default;

  /// Adds bytes. Returns their offset.
  virtual std::uint64_t append(Span<const std::uint8_t> bytes) = 0;
  /// Reads `size` bytes that were added at `offset` into `bytes`. Other threads may read or append
  /// at the same time.
  virtual void read(std::uint64_t offset, std::size_t size,
                    std::vector<std::uint8_t>& bytes) const = 0;
};

/// Bytes in the memory.
class MemoryStore : public ByteStore {
 public:
  std::uint64_t append(Span<const std::uint8_t> bytes) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::uint64_t offset = bytes_.size();
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return offset;
  }
  void read(std::uint64_t offset, std::size_t size,
            std::vector<std::uint8_t>& bytes) const override {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto* const from = bytes_.data() + offset;
    bytes.assign(from, from + size);
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace dynains
