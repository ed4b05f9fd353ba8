#include "read_text_file.hpp"

#include <fstream>
#include <ios>

#include "dynains/errors.hpp"
#include "io/input_file.hpp"

namespace dynains::program {

std::string read_text_file(const std::filesystem::path& path) {
  std::ifstream file = open_input(path);
  const std::uintmax_t size = std::filesystem::file_size(path);
  if (size > kMaxTextBytes) {
    throw IoError(path.string() + ": has " + std::to_string(size) + " bytes, more than " +
                  std::to_string(kMaxTextBytes));
  }
  std::string text(static_cast<std::size_t>(size), '\0');
  file.read(text.data(), static_cast<std::streamsize>(size));
  const auto count = static_cast<std::uint64_t>(file.gcount());
  if (count < size) fail_to_read(file, path, count, size);
  return text;
}

}  // namespace dynains::program
