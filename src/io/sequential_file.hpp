// A file of numbers, read from begin to end into memory of the caller.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>

namespace dynains {

class SequentialFile {
 public:
  /// `size`: bytes of the file, for messages. Throws IoError unless `path` is a regular file that
  /// opens.
  SequentialFile(std::filesystem::path path, std::uint64_t size);

  /// Reads the next `count` numbers to `values`. Throws IoError with the byte if the file ends
  /// before them or cannot be read.
  template <class T>
  void read(T* values, std::size_t count) {
    read_bytes(reinterpret_cast<char*>(values), count * sizeof(T));
  }

 private:
  void read_bytes(char* bytes, std::uint64_t count);

  std::filesystem::path path_;
  std::uint64_t size_;
  std::uint64_t position_ = 0;
  std::ifstream file_;
};

}  // namespace dynains
