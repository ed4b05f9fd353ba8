#include "folder_exchange.hpp"

#include <fcntl.h>

#include <cerrno>
#include <cstdio>

#include "failure.hpp"

namespace dynains {

bool put_in_place(const std::filesystem::path& staging, const std::filesystem::path& target) {
  const auto rename = [&](unsigned flags) {
    return ::renameat2(AT_FDCWD, staging.c_str(), AT_FDCWD, target.c_str(), flags) == 0;
  };
  if (std::filesystem::exists(std::filesystem::symlink_status(target))) {
    if (rename(RENAME_EXCHANGE)) return true;
    fail_by_system(target, "cannot be replaced in one step; remove it first", errno);
  }
  if (!rename(0)) fail_by_system(target, "cannot be put in place", errno);
  return false;
}

}  // namespace dynains
