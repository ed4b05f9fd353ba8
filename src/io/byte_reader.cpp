#include "byte_reader.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <string>
#include <system_error>

#include "failure.hpp"
#include "text.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

fs::file_status status_of(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::status_known(status)) fail_by_system(path, "cannot be read", error.value());
  return status;
}

/// For a read that gave fewer bytes than the file has, before anything else sets errno.
[[noreturn]] void fail_to_read(const std::ifstream& file, const fs::path& path,
                               std::uint64_t position, std::uint64_t size) {
  const int reason = errno;
  const std::string what =
      "reading stopped at byte " + std::to_string(position) + " of " + std::to_string(size);
  // Without a failed call the file has become shorter.
  if (file.bad()) fail_by_system(path, what, reason);
  fail(path, what + ": the file ends there");
}

}  // namespace

bool is_there(const fs::path& path) { return fs::exists(status_of(path)); }

bool is_folder(const fs::path& path) { return fs::is_directory(status_of(path)); }

bool is_file(const fs::path& path) { return fs::is_regular_file(status_of(path)); }

std::string lower_extension(const fs::path& path) {
  return text::lower_case(path.extension().string());
}

std::uint64_t size_of_file(const fs::path& path) {
  std::error_code error;
  const std::uint64_t size = fs::file_size(path, error);
  if (error) fail(path, "cannot be read: " + error.message());
  return size;
}

std::vector<fs::path> paths_in(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    paths.push_back(entry->path());
  }
  if (error) fail(folder, "cannot be listed: " + error.message());
  return paths;
}

std::ifstream open_input(const fs::path& path) {
  const fs::file_status status = status_of(path);
  if (!fs::exists(status)) fail_by_system(path, "cannot be read", ENOENT);
  if (fs::is_directory(status)) fail(path, "cannot be read: is a folder; expected a file");
  if (!fs::is_regular_file(status)) {
    fail(path, "cannot be read: is a device or a pipe; expected a file");
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) fail_by_system(path, "cannot be opened for reading", errno);
  return file;
}

ByteReader::ByteReader(const fs::path& path)
    : path_(path), file_(open_input(path)), size_(size_of_file(path)) {}

bool ByteReader::read_line(std::string& text) {
  text.clear();
  ++line_;
  if (remaining() == 0) return false;
  while (position_ < size_) {
    const int c = file_.get();
    if (c == std::ifstream::traits_type::eof()) fail_to_read(file_, path_, position_, size_);
    ++position_;
    if (c == '\n') break;
    if (text.size() == 1U << 16U) fail_on_line("expected a line of text, found no end of line");
    text.push_back(static_cast<char>(c));
  }
  if (!text.empty() && text.back() == '\r') text.pop_back();
  return true;
}

void ByteReader::read(char* target, std::size_t count, const char* purpose) {
  // Some processors copy from files to unaligned memory four times slower than to aligned memory.
  alignas(64) std::array<char, std::size_t{1} << 16U> piece;
  while (count > 0) {
    const std::size_t wanted = std::min(piece.size(), count);
    file_.read(piece.data(), static_cast<std::streamsize>(wanted));
    const auto got = static_cast<std::size_t>(file_.gcount());
    position_ += got;
    if (got != wanted && position_ < size_) fail_to_read(file_, path_, position_, size_);
    if (got != wanted) fail_here(std::string("file ends, expected ") + purpose);
    target = std::copy_n(piece.data(), wanted, target);
    count -= wanted;
  }
}

std::string ByteReader::read_block(std::uint64_t count, const char* purpose) {
  std::string bytes(static_cast<std::size_t>(count), '\0');
  read(bytes.data(), bytes.size(), purpose);
  return bytes;
}

void ByteReader::skip(std::uint64_t count, const char* purpose) {
  if (count > remaining()) {
    position_ = size_;
    fail_here(std::string("file ends, expected ") + purpose);
  }
  file_.ignore(static_cast<std::streamsize>(count));
  position_ += count;
}

void ByteReader::read_at(std::uint64_t position, std::uint64_t count, const char* purpose,
                         std::vector<std::uint8_t>& bytes) {
  const std::uint64_t available = size_ - std::min(position, size_);
  if (count > available || position > size_) {
    fail_at_byte(path_, position,
                 "expected " + std::to_string(count) + " bytes of " + purpose + ", the file has " +
                     std::to_string(available));
  }
  bytes.resize(static_cast<std::size_t>(count));
  if (position != position_) file_.seekg(static_cast<std::streamoff>(position));
  errno = 0;
  file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count));
  position_ = position + count;
  if (!file_) fail_to_read(file_, path_, position, size_);
}

std::uint64_t ByteReader::whole_number(std::string_view token, const std::string& what) const {
  std::uint64_t value = 0;
  const auto [stop, error] = std::from_chars(token.data(), token.data() + token.size(), value);
  if (token.empty() || error != std::errc{} || stop != token.data() + token.size()) {
    fail_on_line("expected " + what);
  }
  return value;
}

double ByteReader::number(std::string_view token, const std::string& name) const {
  if (const auto value = text::parse_number(token)) return *value;
  fail_on_line(
      "expected a number for " + name + ", found " +
      (token.empty() ? "the end of the line" : "\"" + std::string(token.substr(0, 40)) + "\""));
}

void ByteReader::check_room(std::uint64_t count, const char* what, std::uint64_t each,
                            bool is_text) const {
  if (each == 0 || count <= (remaining() + (is_text ? 1 : 0)) / each) return;
  fail_here("expected " + std::to_string(count) + ' ' + what + " of at least " +
            std::to_string(each) + " bytes, the file has " + std::to_string(remaining()) +
            " bytes left");
}

void ByteReader::fail_here(const std::string& what) const { fail_at_byte(path_, position_, what); }

void ByteReader::fail_on_line(const std::string& what) const { fail_at_line(path_, line_, what); }

std::string read_text_file(const fs::path& path) {
  constexpr std::uint64_t kMost = std::uint64_t{64} << 20U;  // bytes
  ByteReader file(path);
  if (file.size() > kMost) {
    fail(path, "has " + std::to_string(file.size()) + " bytes, more than " + std::to_string(kMost));
  }
  return file.read_block(file.size(), "a text");
}

}  // namespace dynains
