#include "read_text_file.hpp"

#include <cerrno>
#include <cstddef>
#include <fstream>
#include <ios>
#include <string>
#include <system_error>

#include "dynains/errors.hpp"

namespace dynains::program {
namespace fs = std::filesystem;

std::string read_text_file(const fs::path& path, std::uint64_t max_bytes,
                           const std::string& expected) {
  const auto fail = [&](const std::string& what) {
    throw IoError(path.string() + ": " + what + "; expected " + expected);
  };
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) fail("does not exist");
  if (error) fail("cannot be read: " + error.message());
  if (status.type() == fs::file_type::directory) fail("is a folder");
  if (status.type() != fs::file_type::regular) fail("is not a regular file");
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) fail("cannot be read: " + error.message());
  if (size > max_bytes) {
    fail("has " + std::to_string(size) + " bytes, more than " + std::to_string(max_bytes));
  }
  const auto reason = [] { return std::generic_category().message(errno); };
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) fail("cannot be opened: " + reason());
  std::string text(static_cast<std::size_t>(size), '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.gcount() != static_cast<std::streamsize>(text.size())) {
    fail("cannot be read to its end" + (file.bad() ? ": " + reason() : ""));
  }
  return text;
}

}  // namespace dynains::program
