// Errors of files: path, position, expectation.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>

#include "dynains/errors.hpp"

namespace dynains {

[[noreturn]] inline void fail(const std::filesystem::path& path, const std::string& what) {
  throw IoError((path.empty() ? "\"\"" : path.string()) + ": " + what);
}

/// Appends the system's message for `error`, a value of errno.
[[noreturn]] inline void fail_by_system(const std::filesystem::path& path, const std::string& what,
                                        int error) {
  fail(path, what + ": " + std::generic_category().message(error));
}

[[noreturn]] inline void fail_at_line(const std::filesystem::path& path, std::uint64_t line,
                                      const std::string& what) {
  throw IoError(path.string() + ":" + std::to_string(line) + ": " + what);
}

[[noreturn]] inline void fail_at_byte(const std::filesystem::path& path, std::uint64_t byte,
                                      const std::string& what) {
  throw IoError(path.string() + ": byte " + std::to_string(byte) + ": " + what);
}

}  // namespace dynains
