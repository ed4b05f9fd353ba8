#include "output_folder.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/version.hpp"
#include "io/byte_reader.hpp"
#include "io/fingerprint.hpp"
#include "io/scan_files.hpp"

namespace dynains::run {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kPartialEnd = ".partial";
const Json::json_pointer kComplete("/complete");
const Json::json_pointer kContents("/contents");

constexpr OutputKind kFileOutput = {"file", "partial.json"};  // the folder of an OutputFile

OutputListing listing_of_file(const std::string& name) { return {{listed_name(name)}, {}, {}}; }

bool has(const Json& marker, const Json::json_pointer& field, const Json& value) {
  return marker.contains(field) && marker[field] == value;
}

/// By whole_path(). Throws ConfigError for a name that another output has while it is written.
fs::path checked_place(const fs::path& target) {
  fs::path place = whole_path(target);
  if (place.extension() != kPartialEnd) return place;
  throw ConfigError(target.string() +
                    ": names that end in .partial are those of unfinished outputs; choose another");
}

/// Moves what is left in `from`, in folders too, to the same places in `to`. Throws IoError.
void move_rest(const Folder& from, const Folder& to) {
  for (const std::string& name : from.names()) {
    const auto moved = from.find(name), there = to.find(name);
    if (moved && there && moved->kind == there->kind && there->kind == Folder::Kind::kFolder) {
      move_rest(Folder(from, name), Folder(to, name));
      from.remove_folder(name);
    } else {
      from.rename(name, to, name, Folder::Rename::kNew);
    }
  }
}

/// The results in the place of `target`; nothing if it is missing or empty.
std::optional<ResultFolder> earlier_results(const fs::path& target, const OutputKind& kind,
                                            bool may_replace, const InputFiles& inputs) {
  const fs::path place = checked_place(target);
  inputs.refuse(place);
  if (!fs::exists(fs::symlink_status(place))) return std::nullopt;
  if (identity_of(place) == identity_of(".")) {
    throw IoError(target.string() +
                  ": is the current folder, which a new one would replace; choose another folder");
  }
  ResultFolder found(Folder(place), kind);
  if (found.has_results() && !may_replace) {
    throw IoError(target.string() +
                  ": holds earlier results; choose another folder, or replace them by --force");
  }
  found.check(inputs);
  found.check_contents();
  Folder(place.parent_path()).check_replaceable(place.filename().string());
  if (found.folder().names().empty()) return std::nullopt;
  return found;
}

[[noreturn]] void fail_at(const fs::path& path, std::string_view text, std::size_t byte,
                          const std::string& what) {
  const std::string_view before = text.substr(0, byte);
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t line_begin = before.rfind('\n') + 1;  // npos + 1 is 0
  throw IoError(path.string() + ":" + std::to_string(line) + ": column " +
                std::to_string(before.size() - line_begin + 1) + ": " + what);
}

/// The part of the JSON library's message with the found and the expected content.
std::string reason_of(const nlohmann::json::exception& error) {
  const std::string what = error.what();
  const std::size_t reason = what.find("syntax error");
  return reason == std::string::npos ? what.substr(what.find("] ") + 2) : what.substr(reason);
}

}  // namespace

Json read_json_file(const fs::path& path) {
  const std::string text = read_text_file(path);
  // Many functions of the JSON library call themselves for each level.
  const auto check_depth = [&](int depth, Json::parse_event_t event, const Json&) {
    const bool begins =
        event == Json::parse_event_t::array_start || event == Json::parse_event_t::object_start;
    if (!begins || depth < kMaxJsonDepth) return true;
    throw IoError(path.string() + ": expected at most " + std::to_string(kMaxJsonDepth) +
                  " arrays and objects within each other");
  };
  try {
    return Json::parse(text, check_depth);
  } catch (const Json::parse_error& error) {
    fail_at(path, text, error.byte == 0 ? 0 : error.byte - 1, "expected JSON: " + reason_of(error));
  } catch (const Json::exception& error) {  // a number that is too large: at no place
    throw IoError(path.string() + ": expected JSON: " + reason_of(error));
  }
}

std::string to_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

void InputFiles::add(const Recording& recording) {
  for (const fs::path& file : recording.files()) add(file);
  const fs::path& folder = recording.folder();
  const bool has_scans =
      recording.format() != ScanFormat::kLog && recording.scan_folder() == folder;
  add_owner(folder, has_scans ? Takes::kNoScans : Takes::kAny);
  if (!has_scans) add(recording.scan_folder());
  add(folder / "labels");
}

void InputFiles::add_results(const ResultFolder& out) { add_results(out.path(), Takes::kNone); }

void InputFiles::add_results(const fs::path& out, Takes takes) {
  add_owner(out, takes);
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
  const auto& [place, takes] = owner->second;
  const bool would_be_scan = takes == Takes::kNoScans && scan_format_of(name);
  if (!is_there && !would_be_scan && takes != Takes::kNone) return;
  throw IoError((folder.path() / name).string() + (is_there ? ": is" : ": would be") +
                " a part of " + place.string() +
                ", which this command reads; choose another place to write to");
}

void InputFiles::add_owner(const fs::path& folder, Takes takes) {
  if (const auto identity = identity_of(folder))
    owners_.emplace(*identity, std::pair(folder, takes));
}

std::string listed_name(const std::string& name) {
  std::string text;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte > 0x1F && byte < 0x7F && c != '%') {
      text += c;
      continue;
    }
    std::array<char, 4> code{};
    std::snprintf(code.data(), code.size(), "%%%02X", static_cast<unsigned>(byte));
    text += code.data();
  }
  return text;
}

bool OutputListing::contains(const std::string& folder, const std::string& name) const {
  const fs::path listed = listed_name(name);
  if (folder.empty()) return files.count(listed.string()) > 0;
  const auto found = folders.find(listed_name(folder));
  return found != folders.end() && listed.extension() == found->second &&
         scans.count(listed.stem().string()) > 0;
}

nlohmann::ordered_json OutputListing::to_json() const {
  return {{"files", files}, {"folders", folders}, {"scans", scans}};
}

OutputListing read_listing(const std::filesystem::path& file, const nlohmann::ordered_json& marker,
                           const std::string& command) {
  if (!has(marker, Json::json_pointer("/program"), "dynains") ||
      !has(marker, Json::json_pointer("/command"), command)) {
    throw IoError(file.string() + ": was not written by dynains " + command +
                  "; choose another folder");
  }
  try {
    const auto& outputs = marker.at("outputs");
    return {outputs.at("files"), outputs.at("folders"), outputs.at("scans")};
  } catch (const nlohmann::json::exception&) {
    throw IoError(file.string() +
                  ": /outputs: expected the names of files, folders and scans; remove the results "
                  "yourself, or choose another folder");
  }
}

Folder::Rename check_output(const Folder& folder, const std::string& name, Existing existing,
                            const InputFiles& inputs) {
  const std::string path = (folder.path() / name).string();
  inputs.refuse(folder.identity(), path);
  const std::optional<Folder::Entry> entry = folder.find(name);
  if (entry) inputs.refuse(entry->identity, path);
  if (entry && existing == Existing::kForeign) {
    throw IoError(path +
                  ": exists, and is no file of the results that would be replaced, as they "
                  "wrote it; move it away, or choose another name");
  }
  if (entry && entry->kind != Folder::Kind::kFile) {
    throw IoError(path + ": is a link or a folder; expected a file or nothing there");
  }
  if (!entry || existing != Existing::kOurs) inputs.refuse_part(folder, name, entry.has_value());
  if (!entry) return Folder::Rename::kNew;
  if (existing == Existing::kStays) {
    throw IoError(path + ": exists; choose another name, or replace it by --force");
  }
  folder.check_replaceable(name);
  return Folder::Rename::kReplace;
}

Json content_of(const fs::path& file) {
  ByteReader reader(file);
  Fingerprint fingerprint;
  while (reader.remaining() > 0) {
    constexpr std::uint64_t kBlock = 1U << 16U;  // bytes
    const std::string block = reader.read_block(std::min(kBlock, reader.remaining()), "its size");
    fingerprint.add_words(block.data(), block.size());
  }
  return {{"bytes", reader.size()}, {"fingerprint", fingerprint.text()}};
}

fs::path whole_path(const fs::path& path) {
  const fs::path whole = fs::weakly_canonical(fs::absolute(path)).lexically_normal();
  return whole.has_filename() ? whole : whole.parent_path();
}

Json begin_marker(const OutputKind& kind) {
  return {{"program", "dynains"},
          {"version", kVersionString},
          {"command", kind.command},
          {"complete", false}};
}

ResultFolder::ResultFolder(Folder folder, const OutputKind& kind)
    : folder_(std::move(folder)), kind_(kind) {
  folder_.lock();
  if (const std::optional<Folder::Entry> marker = folder_.find(kind.marker)) {
    if (marker->kind != Folder::Kind::kFile) {
      throw IoError(marker_path().string() + ": is a link or a folder; expected a file");
    }
    marker_ = read_json_file(marker_path());
    listing_ = read_listing(marker_path(), marker_, kind.command);
    return;
  }
  for (const std::string& name : folder_.names()) {
    if (target_of_temporary(name) == kind.marker) continue;
    throw IoError(path().string() + ": is not empty and holds no results of dynains " +
                  kind.command + " (no " + kind.marker + "); choose another folder");
  }
}

bool ResultFolder::is_complete() const { return has(marker_, kComplete, true); }

bool ResultFolder::is_listed(const std::string& folder, const std::string& name) const {
  const std::string target = target_of_temporary(name);
  const std::string& file = target.empty() ? name : target;
  return listing_.contains(folder, file) || (folder.empty() && file == kind_.marker);
}

template <class Visit>
void ResultFolder::visit_entries(Visit&& visit) const {
  for (const std::string& name : folder_.names()) {
    const std::optional<Folder::Entry> entry = folder_.find(name);
    if (!entry) continue;
    if (entry->kind != Folder::Kind::kFolder || listing_.folders.count(listed_name(name)) == 0) {
      visit(folder_, name, *entry, entry->kind == Folder::Kind::kFile && is_listed("", name));
      continue;
    }
    const Folder inner(folder_, name);
    for (const std::string& file : inner.names()) {
      const std::optional<Folder::Entry> found = inner.find(file);
      if (!found) continue;
      visit(inner, file, *found, found->kind == Folder::Kind::kFile && is_listed(name, file));
    }
    visit(folder_, name, *entry, true);
  }
}

void ResultFolder::check(const InputFiles& inputs) const {
  inputs.refuse(folder_.identity(), path());
  folder_.check_changeable();
  visit_entries(
      [&](const Folder& parent, const std::string& name, const Folder::Entry& entry, bool is_ours) {
        if (!is_ours || entry.kind != Folder::Kind::kFolder) {
          check_output(parent, name, is_ours ? Existing::kOurs : Existing::kForeign, inputs);
          return;
        }
        const Folder inner(parent, name);
        inputs.refuse(entry.identity, inner.path());
        inner.check_changeable();
      });
}

Json ResultFolder::contents() const {
  Json contents = Json::object();
  std::map<std::string, Fingerprint> folders;
  visit_entries(
      [&](const Folder& parent, const std::string& name, const Folder::Entry& entry, bool is_ours) {
        const bool is_direct = &parent == &folder_;
        if (!is_ours || entry.kind != Folder::Kind::kFile || (is_direct && name == kind_.marker))
          return;
        const Json content = content_of(parent.path() / name);
        if (is_direct) {
          contents[listed_name(name)] = content;
        } else {
          folders[parent.path().filename().string()].add(name + content.dump());
        }
      });
  for (const auto& [name, fingerprint] : folders) contents[listed_name(name)] = fingerprint.text();
  return contents;
}

void ResultFolder::check_contents() const {
  const Json none = Json::object(), now = is_complete() ? contents() : none;
  for (const auto& [name, content] : now.items()) {
    if (!marker_.contains(kContents)) return;  // of an earlier version
    if (has(marker_, kContents / name, content)) continue;
    throw IoError((path() / name).string() + ": has changed since dynains " + kind_.command +
                  " wrote it; move it away, or choose another folder");
  }
}

void ResultFolder::mark(Json marker, const OutputListing& listing) {
  for (const std::string& name : folder_.names()) {
    if (target_of_temporary(name) == kind_.marker)
      folder_.remove_file(name);  // of a killed command
  }
  marker["outputs"] = listing.to_json();
  AtomicFile file(marker_path());
  file.stream() << to_text(marker);
  file.commit();
  marker_ = std::move(marker);
  listing_ = listing;
}

void ResultFolder::remove_results() const {
  visit_entries(
      [&](const Folder& parent, const std::string& name, const Folder::Entry& entry, bool is_ours) {
        if (!is_ours || (&parent == &folder_ && name == kind_.marker)) return;
        if (entry.kind == Folder::Kind::kFile) return parent.remove_file(name);
        parent.remove_folder(name);  // stays if it holds anything else
      });
  folder_.remove_file(kind_.marker);
}

void ResultFolder::mark_with(Json marker, const fs::path& file) {
  const std::string name = listed_name(file.filename().string());
  OutputListing listing = listing_;
  listing.files.insert(name);
  if (marker.contains(kContents)) marker[kContents][name] = content_of(file);
  mark(std::move(marker), listing);
}

OutputFolder::OutputFolder(const fs::path& target, const OutputKind& kind,
                           const OutputListing& listing, bool may_replace, const InputFiles& inputs)
    : OutputFolder(checked_place(target), kind, listing, inputs,
                   earlier_results(target, kind, may_replace, inputs)) {}

OutputFolder::OutputFolder(const fs::path& place, const OutputKind& kind,
                           const OutputListing& listing, const InputFiles& inputs,
                           std::optional<ResultFolder> earlier)
    : parent_((create_folder(place.parent_path()), place.parent_path())),
      target_(place.filename().string()),
      name_(target_ + kPartialEnd),
      earlier_(std::move(earlier)) {
  parent_.make_folder(name_);
  results_.emplace(Folder(parent_, name_), kind);
  // Another command may have renamed the folder before it was locked here.
  const std::optional<Folder::Entry> entry = parent_.find(name_);
  if (!entry || entry->identity != results_->folder().identity()) {
    throw UsageError(path().string() + ": is in use");
  }
  results_->check(inputs);
  left_ = results_->marker();
  results_->remove_results();
  try {
    results_->mark(begin_marker(kind), listing);
  } catch (...) {
    parent_.remove_folder(name_);
    throw;
  }
}

OutputFolder::~OutputFolder() {
  if (is_kept_) return;
  try {
    remove();
  } catch (const IoError&) {
    // The next command with this target removes the rest.
  }
}

void OutputFolder::remove() {
  is_kept_ = true;
  results_->remove_results();
  parent_.remove_folder(name_);
}

void OutputFolder::replace_target() {
  // Files that others have put into the folder meanwhile stay there.
  const auto empty = [&] {
    earlier_->remove_results();
    move_rest(earlier_->folder(), results_->folder());
  };
  if (earlier_ && parent_.rename(name_, parent_, target_, Folder::Rename::kExchange)) {
    parent_.sync();
    empty();
    parent_.remove_folder(name_);
    return;
  }
  if (earlier_) {
    // Nothing that is called complete loses its files one by one.
    Json marker = earlier_->marker();
    marker["complete"] = false;
    earlier_->mark(marker, OutputListing(earlier_->listing()));
    empty();
  }
  parent_.rename(name_, parent_, target_, Folder::Rename::kReplace);
  parent_.sync();
}

bool OutputFolder::had(const char* field, const std::string& text) const {
  const Json::json_pointer where(field);
  return (earlier_ && has(earlier_->marker(), where, text)) ||
         (has(left_, kComplete, true) && has(left_, where, text));
}

Existing OutputFolder::owns(const fs::path& path) const {
  if (!is_file(path)) return Existing::kForeign;
  const Json::json_pointer field = Json::json_pointer("/written") / listed_name(path.string());
  const Json content = content_of(path);
  const bool is_ours =
      (earlier_ && has(earlier_->marker(), field, content)) || has(left_, field, content);
  return is_ours ? Existing::kOurs : Existing::kForeign;
}

fs::path OutputFolder::add(const fs::path& file, const InputFiles& inputs) {
  return files_.emplace_back(file, owns(file), inputs).path();
}

void OutputFolder::keep_unfinished(const Json& marker) {
  results_->mark(marker, OutputListing(results_->listing()));
  sync_files(path());
  is_kept_ = true;
}

void OutputFolder::put_files_in_place(std::list<OutputFile>::iterator first) {
  if (first == files_.end()) return;
  first->put_in_place([&] { put_files_in_place(std::next(first)); });
}

void OutputFolder::finish(Json marker, const std::function<void()>& put_others) {
  for (const OutputFile& file : files_) {
    marker["written"][file.listed_target()] = content_of(file.path());
  }
  marker["complete"] = true;
  marker[kContents] = results_->contents();
  results_->mark(marker, OutputListing(results_->listing()));
  sync_files(path());
  is_kept_ = true;  // the results are whole
  put_files_in_place(files_.begin());
  put_others();
  replace_target();
}

OutputFile::OutputFile(const fs::path& target, Existing existing, const InputFiles& inputs)
    : target_(checked_place(target)), locked_(target_.parent_path()) {
  const std::string name = target_.filename().string();
  // First: a folder that this command reads is in use, too.
  how_ = check_output(*locked_, name, existing, inputs);
  locked_->lock(Folder::Lock::kShared);
  partial_.reset(new OutputFolder(target_, kFileOutput, listing_of_file(name), inputs, {}));
  folder_ = &partial_->parent_;
}

OutputFile::OutputFile(const ResultFolder& results, const std::string& name)
    : target_(whole_path(results.path()) / name), folder_(&results.folder()) {
  const bool is_ours = results.listing().contains("", name);
  how_ = check_output(*folder_, name, is_ours ? Existing::kOurs : Existing::kForeign, {});
  // Beside the folder, in which a file that is not listed is one of the user.
  partial_.reset(new OutputFolder(whole_path(results.path()).concat('.' + name), kFileOutput,
                                  listing_of_file(name), InputFiles(), {}));
}

void OutputFile::put_in_place(const std::function<void()>& publish_more) {
  sync_files(partial_->path());
  publish_more();
  partial_->is_kept_ = true;  // the file is whole
  const std::string name = target_.filename().string();
  partial_->results_->folder().rename(name, *folder_, name, how_);
  folder_->sync();
  partial_->remove();
}

void OutputFile::write(const std::function<void(std::ostream&)>& fill) {
  AtomicFile file(path());
  fill(file.stream());
  file.commit();
  put_in_place();
}

}  // namespace dynains::run
