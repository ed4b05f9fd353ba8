#include "input_files.hpp"

#include <system_error>

#include "dynains/errors.hpp"
#include "io/scan_files.hpp"

namespace dynains::run {
namespace fs = std::filesystem;

void InputFiles::add(const Recording& recording) {
  for (const fs::path& file : recording.files()) add(file);
  const fs::path& folder = recording.folder();
  const bool has_scans =
      recording.format() != ScanFormat::kLog && recording.scan_folder() == folder;
  add_owner(folder, has_scans);
  if (!has_scans) add(recording.scan_folder());
  add(folder / "labels");
}

void InputFiles::add_results(const fs::path& out) {
  add_owner(out, false);
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(out, error)) {
    if (entry.is_directory(error)) add(entry.path());
  }
}

void InputFiles::refuse(const FileIdentity& identity, const fs::path& output) const {
  const auto input = paths_.find(identity);
  if (input == paths_.end()) return;
  throw IoError(output.string() + ": is read by this command, as " + input->second.string() +
                ", and would be changed; choose another place to write to");
}

void InputFiles::refuse_part(const Folder& folder, const std::string& name, bool is_there) const {
  const auto owner = owners_.find(folder.identity());
  if (owner == owners_.end()) return;
  const auto& [place, has_scans] = owner->second;
  if (!is_there && !(has_scans && scan_format_of(name))) return;
  throw IoError((folder.path() / name).string() + (is_there ? ": is" : ": would be") +
                " a part of " + place.string() +
                ", which this command reads; choose another place to write to");
}

void InputFiles::add_owner(const fs::path& folder, bool has_scans) {
  if (const auto identity = identity_of(folder))
    owners_.emplace(*identity, std::pair(folder, has_scans));
}

}  // namespace dynains::run
