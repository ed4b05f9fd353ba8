// Bytes that do not fit into the memory, in a file without a name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/recording/byte_store.hpp"

namespace dynains::program {

/// A file that no folder lists: it ends with this object or with the process, however that ends.
/// Errors throw IoError and name the folder.
class ScratchFile : public ByteStore {
 public:
  /// Makes the file on the file system of `folder`.
  explicit ScratchFile(const std::filesystem::path& folder);
  ~ScratchFile() override;

  std::uint64_t append(Span<const std::uint8_t> bytes) override;
  void read(std::uint64_t offset, std::size_t size,
            std::vector<std::uint8_t>& bytes) const override;

 private:
  std::filesystem::path folder_;
  int file_;
  std::uint64_t size_ = 0;
};

}  // namespace dynains::program
