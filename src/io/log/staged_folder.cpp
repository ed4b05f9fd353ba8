#include "staged_folder.hpp"

#include <system_error>

#include "../failure.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// The hidden folder beside `target` for `purpose`.
fs::path beside(const fs::path& target, const char* purpose) {
  return target.parent_path() / ('.' + target.filename().string() + purpose);
}

const fs::path& created(const fs::path& folder) {
  std::error_code error;
  fs::create_directory(folder, error);
  if (error) fail(folder, "cannot be created: " + error.message());
  return folder;
}

void rename_folder(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (error) fail(to, "cannot be put in place: " + error.message());
}

}  // namespace

StagedFolder::StagedFolder(const fs::path& target)
    : target_(target.has_filename() ? target : target.parent_path()),
      staging_(beside(target_, ".dynains_staging")),
      lock_(created(staging_)) {
  // A killed process may have left files.
  for (const fs::directory_entry& left : fs::directory_iterator(staging_)) {
    fs::remove_all(left.path());
  }
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  fs::remove_all(staging_, ignored);
}

void StagedFolder::commit() {
  if (!fs::exists(target_)) return rename_folder(staging_, target_);
  const fs::path earlier = beside(target_, ".dynains_earlier");
  rename_folder(target_, earlier);
  try {
    rename_folder(staging_, target_);
  } catch (...) {
    rename_folder(earlier, target_);
    throw;
  }
  std::error_code ignored;
  fs::remove_all(earlier, ignored);
}

}  // namespace dynains
