// A vector that grows without moving its elements.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

namespace dynains::detail {

/// Grows by chunks that never move: references stay valid, and a push allocates one chunk at most.
/// `T` is trivially constructible; `kChunk`: elements.
template <class T, std::uint32_t kChunk>
class ChunkedVector {
 public:
  std::uint32_t size() const { return size_; }
  T& operator[](std::uint32_t i) { return chunks_[i / kChunk][i % kChunk]; }
  const T& operator[](std::uint32_t i) const { return chunks_[i / kChunk][i % kChunk]; }

  /// Returns the index of the new element, at most 2^32 - 2. Throws std::length_error beyond it,
  /// and std::bad_alloc; then the vector is unchanged.
  std::uint32_t push_back(const T& value) {
    if (size_ == chunks_.size() * kChunk) add_chunk();
    (*this)[size_] = value;
    return size_++;
  }

  std::size_t memory_bytes() const {
    return chunks_.size() * kChunk * sizeof(T) + chunks_.capacity() * sizeof(chunks_[0]);
  }

 private:
  void add_chunk() {
    constexpr std::size_t kMostChunks = std::numeric_limits<std::uint32_t>::max() / kChunk;
    if (chunks_.size() == kMostChunks) throw std::length_error("2^32 - 1 elements are too many");
    chunks_.emplace_back(new T[kChunk]);
  }

  std::vector<std::unique_ptr<T[]>> chunks_;
  std::uint32_t size_ = 0;
};

}  // namespace dynains::detail
