#include "sequential_file.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "input_file.hpp"

namespace dynains {

SequentialFile::SequentialFile(std::filesystem::path path, std::uint64_t size)
    : path_(std::move(path)), size_(size), file_(open_input(path_)) {}

void SequentialFile::read_bytes(char* bytes, std::uint64_t count) {
  // Some processors copy from files to unaligned memory four times slower than to aligned memory.
  alignas(64) std::array<char, std::size_t{1} << 16U> piece;
  while (count > 0) {
    const std::size_t size = std::min<std::uint64_t>(piece.size(), count);
    file_.read(piece.data(), static_cast<std::streamsize>(size));
    const auto done = static_cast<std::size_t>(file_.gcount());
    position_ += done;
    if (done != size) fail_to_read(file_, path_, position_, size_);
    bytes = std::copy_n(piece.data(), size, bytes);
    count -= size;
  }
}

}  // namespace dynains
