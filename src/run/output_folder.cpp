#include "output_folder.hpp"

#include <unistd.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "json_file.hpp"
#include "run_report.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

/// Names of the entries that are listed.
std::vector<std::string> listed_names(const Folder& folder, const OutputListing& listing,
                                      const std::string& name) {
  std::vector<std::string> names = folder.names();
  names.erase(
      std::remove_if(names.begin(), names.end(),
                     [&](const std::string& entry) { return !listing.contains(name, entry); }),
      names.end());
  return names;
}

/// A folder below a folder of results, if it is there. Throws IoError if it is anything else.
std::optional<Folder> find_folder(const Folder& parent, const std::string& name) {
  if (!parent.find(name)) return std::nullopt;
  return Folder(parent, name);
}

/// Creates a folder and those above it. Returns the created ones, innermost first.
std::vector<fs::path> create_missing_folders(const fs::path& folder) {
  std::vector<fs::path> missing;
  std::error_code ignored;
  fs::path path = whole_path(folder);
  while (path.has_relative_path() && !fs::exists(path, ignored)) {
    missing.push_back(path);
    path = path.parent_path();
  }
  create_folder(folder);
  return missing;
}

}  // namespace

fs::path whole_path(const fs::path& path) {
  const fs::path whole = fs::weakly_canonical(fs::absolute(path)).lexically_normal();
  return whole.has_filename() ? whole : whole.parent_path();
}

void create_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw IoError(folder.string() + ": cannot be created: " + error.message());
}

LockedFolder::LockedFolder(const fs::path& folder)
    : created_(create_missing_folders(folder)), lock_(folder) {}

LockedFolder::~LockedFolder() {
  for (const fs::path& folder : created_) ::rmdir(folder.c_str());
}

OutputFolder::OutputFolder(Folder folder, const OutputKind& kind)
    : folder_(std::move(folder)), kind_(kind) {
  const fs::path file = path() / kind.marker;
  const std::optional<Folder::Entry> marker = folder_.find(kind.marker);
  if (marker) {
    if (marker->kind != Folder::Kind::kFile) {
      throw IoError(file.string() + ": is a link or a folder; expected a file");
    }
    marker_ = read_json_file(file);
    listing_ = read_listing(file, marker_, kind);
    if (auto staging = find_folder(folder_, kStagingFolder)) {
      staging_ = std::make_unique<OutputFolder>(std::move(*staging), kind);
    }
    return;
  }
  for (const std::string& name : folder_.names()) {
    if (target_of_temporary(name) == kind.marker) continue;
    const bool is_empty_folder = kind.folders.count(name) > 0 &&
                                 folder_.find(name)->kind == Folder::Kind::kFolder &&
                                 Folder(folder_, name).names().empty();
    if (is_empty_folder) continue;
    throw IoError(path().string() + ": is not empty and holds no earlier results (no " +
                  kind.marker + "); choose another folder");
  }
}

bool OutputFolder::is_complete() const {
  return has_results() &&
         json_field<bool>(path() / kind_.marker, marker_, "/complete").value_or(false);
}

void OutputFolder::check_file(const Folder& folder, const std::string& name, bool is_listed,
                              const InputFiles& inputs) const {
  const fs::path file = folder.path() / name;
  const std::optional<Folder::Entry> entry = folder.find(name);
  if (!entry) return;
  if (!is_listed) {
    throw IoError(file.string() + ": is in the way, and no part of earlier results (" +
                  kind_.marker + " does not list it); move it away, or choose another folder");
  }
  if (entry->kind != Folder::Kind::kFile) {
    throw IoError(file.string() + ": is a link or a folder; expected a file or nothing there");
  }
  inputs.refuse(entry->identity, file);
  folder.check_removable(name);
}

void OutputFolder::check_folder(const std::string& name, const OutputListing& planned,
                                const InputFiles& inputs) const {
  const std::optional<Folder> folder = find_folder(folder_, name);
  if (!folder) return;
  inputs.refuse(folder->identity(), folder->path());
  folder_.check_removable(name);
  folder->check_changeable();
  for (const std::string& entry : folder->names()) {
    const bool is_listed = listing_.contains(name, entry);
    if (is_listed || planned.contains(name, entry)) check_file(*folder, entry, is_listed, inputs);
  }
}

void OutputFolder::check(const OutputListing& planned, const InputFiles& inputs) const {
  inputs.refuse(folder_.identity(), path());
  folder_.check_changeable();
  if (has_results()) folder_.check_removable(kind_.marker);
  std::set<std::string> files = listing_.files;
  files.insert(planned.files.begin(), planned.files.end());
  for (const std::string& name : files) {
    check_file(folder_, name, listing_.contains("", name), inputs);
  }
  std::map<std::string, std::string> folders = listing_.folders;
  folders.insert(planned.folders.begin(), planned.folders.end());
  for (const auto& folder : folders) check_folder(folder.first, planned, inputs);
  if (staging_) {
    staging_->check_nothing_foreign();
    staging_->check(planned, inputs);
  }
}

void OutputFolder::check_nothing_foreign() const {
  const auto refuse = [](const fs::path& file) {
    throw IoError(file.string() + ": is no file of dynains; move it away");
  };
  const auto is_ours = [&](const std::string& folder, const std::string& name) {
    const std::string target = target_of_temporary(name);
    return listing_.contains(folder, target.empty() ? name : target) ||
           (folder.empty() && (name == kind_.marker || target == kind_.marker));
  };
  for (const std::string& name : folder_.names()) {
    if (is_ours("", name)) continue;
    if (kind_.folders.count(name) == 0) refuse(path() / name);
    const Folder folder(folder_, name);
    for (const std::string& entry : folder.names()) {
      if (!is_ours(name, entry)) refuse(folder.path() / entry);
    }
  }
}

void OutputFolder::mark(nlohmann::ordered_json marker, const OutputListing& listing) {
  marker["outputs"] = listing.to_json();
  AtomicFile file(path() / kind_.marker);
  file.stream() << to_text(marker);
  file.commit();
  marker_ = std::move(marker);
  listing_ = listing;
}

void OutputFolder::remove_folder_results(const std::string& name) const {
  const std::optional<Folder> folder = find_folder(folder_, name);
  if (!folder) return;
  remove_leftovers(folder->path(),
                   [&](const std::string& file) { return listing_.contains(name, file); });
  for (const std::string& file : listed_names(*folder, listing_, name)) folder->remove_file(file);
  folder_.remove_folder(name);  // stays if it holds anything else
}

void OutputFolder::remove_results() const {
  remove_temporaries();
  for (const std::string& name : listing_.files) folder_.remove_file(name);
  for (const auto& folder : listing_.folders) remove_folder_results(folder.first);
}

void OutputFolder::remove_temporaries() const {
  remove_leftovers(path(), [&](const std::string& file) {
    return file == kind_.marker || listing_.contains("", file);
  });
  for (const auto& entry : listing_.folders) {
    const std::string& name = entry.first;
    if (const auto folder = find_folder(folder_, name)) {
      remove_leftovers(folder->path(),
                       [&](const std::string& file) { return listing_.contains(name, file); });
    }
  }
}

void OutputFolder::move_results(const Folder& target) const {
  for (const auto& entry : listing_.folders) {
    const std::string& name = entry.first;
    const std::optional<Folder> folder = find_folder(folder_, name);
    if (!folder) continue;
    const Folder target_folder = target.make_folder(name);
    for (const std::string& file : listed_names(*folder, listing_, name)) {
      folder->move_file(file, target_folder);
    }
  }
  for (const std::string& file : listed_names(folder_, listing_, "")) {
    folder_.move_file(file, target);
  }
}

void OutputFolder::discard_staging() {
  if (!staging_) return;
  staging_->remove_results();
  // The marker is removed last: it lists the files that a power cut could bring back.
  sync_files(staging_->path());
  for (const auto& folder : kind_.folders) staging_->folder_.remove_folder(folder.first);
  staging_->folder_.remove_file(kind_.marker);
  folder_.remove_folder(kStagingFolder);
  staging_.reset();
}

OutputFolder& OutputFolder::make_staging(const nlohmann::ordered_json& marker,
                                         const OutputListing& listing) {
  discard_staging();
  staging_ = std::make_unique<OutputFolder>(folder_.make_folder(kStagingFolder), kind_);
  staging_->mark(marker, listing);
  return *staging_;
}

OutputChange::OutputChange(OutputFolder& out, Mode mode, nlohmann::ordered_json marker,
                           OutputListing planned)
    : out_(out), mode_(mode), marker_(std::move(marker)), planned_(std::move(planned)) {
  if (is_staged()) {
    out_.make_staging(marker_, planned_);
    return;
  }
  out_.discard_staging();
  if (!planned_.contains(out_.listing())) remove_earlier();
  out_.mark(marker_, planned_);
  out_.remove_temporaries();
}

OutputChange::~OutputChange() {
  try {
    if (is_staged()) out_.discard_staging();
  } catch (const IoError&) {
    // The next command with this folder removes the staging folder.
  }
}

const fs::path& OutputChange::folder() const {
  return is_staged() ? out_.staging()->path() : out_.path();
}

/// Their listing stays in the marker until they are gone for good. From the mark on, the staging
/// folder is no longer removed in case of an error.
void OutputChange::remove_earlier() {
  out_.mark(marker_, OutputListing(out_.listing()));
  mode_ = Mode::kInPlace;
  out_.remove_results();
  sync_files(out_.path());
}

void OutputChange::put_in_place(const std::function<void()>& put_others) {
  if (is_staged()) {
    sync_files(out_.staging()->path());
    remove_earlier();
    out_.mark(marker_, planned_);
    put_others();
    out_.staging()->move_results(out_.folder());
    sync_files(out_.path());
    out_.discard_staging();
  } else {
    put_others();
    sync_files(out_.path());
  }
}

void OutputChange::finish(const nlohmann::ordered_json& marker, const OutputListing& written) {
  out_.mark(marker, written);
}

}  // namespace dynains::program
