#include "output_folder.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <random>
#include <system_error>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/version.hpp"
#include "io/failure.hpp"
#include "json_file.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kPartialEnd = ".partial";

fs::path partial_of(const fs::path& target) { return fs::path(target).concat(kPartialEnd); }

bool has_value(const Json& marker, const char* field, const Json& value) {
  const Json::json_pointer pointer(field);
  return marker.contains(pointer) && marker[pointer] == value;
}

/// `path` by whole_path(). Throws ConfigError for a name that another output has while it is
/// written, and IoError for one of `inputs`.
fs::path checked_target(const fs::path& path, const InputFiles& inputs) {
  fs::path target = whole_path(path);
  if (target.extension() == kPartialEnd) {
    throw ConfigError(target.string() +
                      ": names that end in .partial are those of unfinished outputs; choose "
                      "another");
  }
  inputs.refuse(target);
  return target;
}

/// Throws IoError for a folder that cannot be renamed.
void check_movable(const fs::path& folder, const fs::path& as_given) {
  const auto identity = identity_of(folder);
  const char* const what = identity == identity_of(".")
                               ? ": is the current folder, which a new one would replace"
                           : identity && identity->first != identity_of(folder.parent_path())->first
                               ? ": is mounted and cannot be replaced; choose a folder in it"
                               : nullptr;
  if (what != nullptr) throw IoError(as_given.string() + what);
}

/// `flags` of renameat2. False if the file system does not know them.
bool rename(const fs::path& from, const fs::path& to, unsigned flags) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flags) == 0) return true;
  if (flags != 0 && (errno == EINVAL || errno == ENOSYS)) return false;
  fail_by_system(to, "cannot be put in place", errno);
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

Json begin_marker(const OutputKind& kind) {
  return {{"program", "dynains"},
          {"version", kVersionString},
          {"command", kind.command},
          {"complete", false}};
}

ResultFolder::ResultFolder(fs::path folder, const OutputKind& kind)
    : path_(std::move(folder)), identity_(identity_of(path_)), lock_(path_), kind_(kind) {
  // Another command may have renamed the folder before it was locked here.
  if (identity_of(path_) != identity_) throw UsageError(path_.string() + ": is in use");
  const fs::file_type marker = fs::symlink_status(marker_path()).type();
  if (marker == fs::file_type::regular) {
    marker_ = read_json_file(marker_path());
    listing_ = read_listing(marker_path(), marker_, kind.command);
    return;
  }
  if (marker != fs::file_type::not_found) {
    throw IoError(marker_path().string() + ": is a link or a folder; expected a file");
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(path_)) {
    if (target_of_temporary(entry.path().filename()) == kind.marker) continue;
    throw IoError(path_.string() + ": is not empty and holds no earlier results (no " +
                  kind.marker + "); choose another folder");
  }
}

bool ResultFolder::is_listed(const std::string& folder, const fs::directory_entry& entry) const {
  if (entry.symlink_status().type() != fs::file_type::regular) return false;
  const std::string name = entry.path().filename();
  const std::string target = target_of_temporary(name);
  const std::string& file = target.empty() ? name : target;
  return listing_.contains(folder, file) || (folder.empty() && file == kind_.marker);
}

std::vector<ResultFolder::Entry> ResultFolder::entries() const {
  std::vector<Entry> result;
  for (const fs::directory_entry& entry : fs::directory_iterator(path_)) {
    const std::string name = entry.path().filename();
    if (entry.symlink_status().type() != fs::file_type::directory ||
        listing_.folders.count(listed_name(name)) == 0) {
      result.push_back({entry.path(), is_listed("", entry)});
      continue;
    }
    for (const fs::directory_entry& file : fs::directory_iterator(entry.path())) {
      result.push_back({file.path(), is_listed(name, file)});
    }
    result.push_back({entry.path(), true});
  }
  return result;
}

void ResultFolder::check(const InputFiles& inputs) const {
  inputs.refuse(path_);
  for (const Entry& entry : entries()) {
    if (!entry.is_ours) {
      throw IoError(entry.path.string() + ": is no file of the results (" + kind_.marker +
                    " does not list it), which would be replaced as a whole; move it away");
    }
    inputs.refuse(entry.path);
  }
}

void ResultFolder::mark(Json marker, OutputListing listing) {
  marker["outputs"] = listing.to_json();
  AtomicFile file(marker_path());
  file.stream() << to_text(marker);
  file.commit();
  marker_ = std::move(marker);
  listing_ = std::move(listing);
}

void ResultFolder::remove_results() const {
  const fs::path marker = marker_path();
  std::error_code error;
  for (const Entry& entry : entries()) {
    if (!entry.is_ours || entry.path == marker) continue;
    fs::remove(entry.path, error);  // a folder stays if it holds anything else
    if (error && error != std::errc::directory_not_empty) {
      throw IoError(entry.path.string() + ": cannot be removed: " + error.message());
    }
  }
  fs::remove(marker, error);
}

OutputFolder::OutputFolder(const fs::path& target, const OutputKind& kind, OutputListing listing,
                           bool may_replace, const InputFiles& inputs)
    : target_(checked_target(target, inputs)), listing_(std::move(listing)) {
  if (fs::exists(fs::symlink_status(target_))) {
    earlier_.emplace(target_, kind);
    if (earlier_->has_results() && !may_replace) {
      throw IoError(target.string() +
                    ": holds earlier results; choose another folder, or replace them by --force");
    }
    check_movable(target_, target);
    earlier_->check(inputs);
  }
  const fs::path partial = partial_of(target_);
  create_folder(target_.parent_path());
  std::error_code error;
  fs::create_directory(partial, error);
  if (fs::symlink_status(partial).type() != fs::file_type::directory) {
    throw IoError(partial.string() + (error ? ": cannot be created: " + error.message()
                                            : ": is a link or a file; move it away"));
  }
  partial_.emplace(partial, kind);
  partial_->check(inputs);
  left_ = partial_->marker();
  partial_->remove_results();
  partial_->mark(begin_marker(kind), listing_);
}

OutputFolder::~OutputFolder() {
  if (is_kept_) return;
  try {
    partial_->remove_results();
    fs::remove(path());
  } catch (const std::exception&) {
    // The next command with this target removes the rest.
  }
}

bool OutputFolder::earlier_have(const char* field, const std::string& text) const {
  return (earlier_ && has_value(earlier_->marker(), field, text)) ||
         (has_value(left_, "/complete", true) && has_value(left_, field, text));
}

void OutputFolder::keep_unfinished(const Json& marker) {
  partial_->mark(marker, listing_);
  sync_files(path());
  is_kept_ = true;
}

void OutputFolder::finish(Json marker, const std::function<void()>& put_others) {
  marker["complete"] = true;
  keep_unfinished(marker);
  try {
    put_others();
  } catch (...) {
    marker["complete"] = false;  // what is in their place is not ours
    partial_->mark(marker, listing_);
    throw;
  }
  put_in_place();
}

void OutputFolder::put_in_place() {
  const fs::path partial = path();
  if (earlier_ && rename(partial, target_, RENAME_EXCHANGE)) {
    sync_files(target_.parent_path());
    earlier_->was_moved_to(partial);
    earlier_->remove_results();
    std::error_code ignored;
    fs::remove(partial, ignored);
    return;
  }
  if (earlier_) {
    // Nothing that is called complete loses its files one by one.
    Json marker = earlier_->marker();
    marker["complete"] = false;
    earlier_->mark(marker, earlier_->listing());
    earlier_->remove_results();
  }
  rename(partial, target_, 0);
  sync_files(target_.parent_path());
}

OutputFile::OutputFile(const fs::path& target, bool may_replace, const InputFiles& inputs)
    : target_(checked_target(target, inputs)) {
  const fs::file_type type = fs::symlink_status(target_).type();
  if (type != fs::file_type::regular && type != fs::file_type::not_found) {
    throw IoError(target_.string() + ": is a link or a folder; expected a file or nothing there");
  }
  replaces_ = type == fs::file_type::regular;
  if (replaces_ && !may_replace) {
    throw IoError(target.string() + ": exists; choose another name, or replace it by --force");
  }
  std::random_device random;
  path_ = target_.parent_path() / ('.' + std::to_string(random()) + std::to_string(random()) +
                                   ".partial." + target_.filename().string());
  const int file = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) fail_by_system(target_, "cannot be created", errno);
  ::close(file);
}

OutputFile::~OutputFile() {
  std::error_code ignored;
  if (!is_kept_) fs::remove(path_, ignored);
}

void OutputFile::put_in_place() {
  sync_files(target_.parent_path());
  is_kept_ = true;  // the file is whole
  if (!replaces_ && rename(path_, target_, RENAME_NOREPLACE)) return;
  if (!replaces_ && fs::exists(fs::symlink_status(target_))) {
    fail_by_system(target_, "cannot be put in place", EEXIST);
  }
  rename(path_, target_, 0);
}

}  // namespace dynains::program
