// Room in buffers that are reused from scan to scan.
#pragma once

#include <cstddef>
#include <vector>

namespace dynains::detail {

/// Lets the vector hold `size` values without moving. Scans differ in size by a few percent: with
/// an eighth to spare, a buffer is seldom left for a slightly larger one, whose old place the
/// allocator would have to find a use for.
template <class T>
void ensure_capacity(std::vector<T>& values, std::size_t size) {
  if (values.capacity() < size) values.reserve(size + size / 8);
}

/// Grows a buffer to `size` values. The buffer keeps the size of the largest scan so far.
template <class T>
void grow(std::vector<T>& values, std::size_t size) {
  if (values.size() >= size) return;
  ensure_capacity(values, size);
  values.resize(size);
}

}  // namespace dynains::detail
