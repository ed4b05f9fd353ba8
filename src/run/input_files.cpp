#include "input_files.hpp"

#include <sys/stat.h>

#include "dynains/errors.hpp"

namespace dynains::program {

std::optional<FileIdentity> identity_of(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return FileIdentity(status.st_dev, status.st_ino);
}

void InputFiles::refuse(const std::filesystem::path& output) const {
  const auto identity = identity_of(output);
  const auto input = identity ? paths_.find(*identity) : paths_.end();
  if (input == paths_.end()) return;
  throw IoError(output.string() + ": is read by this command, as " + input->second.string() +
                ", and would be changed; choose another place to write to");
}

}  // namespace dynains::program
