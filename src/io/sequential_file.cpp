#include "sequential_file.hpp"

#include <utility>

#include "input_file.hpp"

namespace dynains {

SequentialFile::SequentialFile(std::filesystem::path path, std::uint64_t size)
    : path_(std::move(path)), size_(size), file_(open_input(path_)) {}

void SequentialFile::read_bytes(char* bytes, std::uint64_t count) {
  file_.read(bytes, static_cast<std::streamsize>(count));
  const auto done = static_cast<std::uint64_t>(file_.gcount());
  if (done != count) fail_to_read(file_, path_, position_ + done, size_);
  position_ += count;
}

}  // namespace dynains
