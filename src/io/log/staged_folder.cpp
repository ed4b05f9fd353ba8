#include "staged_folder.hpp"

#include <exception>
#include <system_error>

#include "../failure.hpp"
#include "../folder_exchange.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

fs::path staging_of(const fs::path& target) {
  return target.parent_path() / ('.' + target.filename().string() + ".dynains_staging");
}

const fs::path& created(const fs::path& folder) {
  std::error_code error;
  fs::create_directory(folder, error);
  if (error) fail(folder, "cannot be created: " + error.message());
  return folder;
}

}  // namespace

StagedFolder::StagedFolder(const fs::path& target)
    : target_(target.has_filename() ? target : target.parent_path()),
      staging_(staging_of(target_)),
      lock_(created(staging_)) {
  // A killed process may have left files.
  for (const fs::directory_entry& left : fs::directory_iterator(staging_)) {
    fs::remove_all(left.path());
  }
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  if (!is_committed_) fs::remove_all(staging_, ignored);
}

void StagedFolder::commit() {
  const bool has_earlier = put_in_place(staging_, target_);
  is_committed_ = true;
  if (!has_earlier) return;
  // The earlier folder is the staging one now, which others may have begun to use.
  try {
    const FolderLock lock(staging_);
    std::error_code ignored;
    fs::remove_all(staging_, ignored);
  } catch (const std::exception&) {
    // The next writer removes its files.
  }
}

}  // namespace dynains
