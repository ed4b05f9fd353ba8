// Storage outside of memory for data of a recording.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <type_traits>
#include <vector>

#include "dynains/points.hpp"

namespace dynains {

/// Adds values as they are in memory.
template <class Value>
void add_bytes(const Value* values, std::size_t count, std::vector<std::uint8_t>& bytes) {
  static_assert(std::is_trivially_copyable_v<Value>, "values are stored as bytes");
  const auto* const begin = reinterpret_cast<const std::uint8_t*>(values);
  bytes.insert(bytes.end(), begin, begin + count * sizeof(Value));
}

/// Bytes that are added once and read later, in any order. They are in an unlinked file, which the
/// operating system removes with this object or at the end of the process, also after a crash.
/// Errors throw IoError and name the folder.
class ByteStore {
 public:
  /// Makes the file on the file system of `folder`.
  explicit ByteStore(std::filesystem::path folder);
  ByteStore(const ByteStore&) = delete;
  ByteStore& operator=(const ByteStore&) = delete;
  ~ByteStore();

  /// Adds bytes. Returns their offset.
  std::uint64_t append(Span<const std::uint8_t> bytes);
  /// Reads `size` bytes that were added at `offset` into `bytes`. Other threads may read, and one
  /// may append, at the same time.
  void read(std::uint64_t offset, std::size_t size, std::vector<std::uint8_t>& bytes) const;

 private:
  std::filesystem::path folder_;
  int file_;
  std::uint64_t size_ = 0;
};

}  // namespace dynains
