#include "log_file.hpp"

#include <algorithm>
#include <set>
#include <string_view>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../text.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// Whether the file is compressed as a whole, by its name.
bool is_compressed_log(const fs::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".zstd" || extension == ".zst";
}

/// Extension of a log by its name: ".mcap", ".bag" (also for NAME.bag.active) or ".db3"; also if
/// the file is compressed as a whole, as NAME.mcap.zstd. Else empty.
std::string log_extension(const fs::path& path) {
  std::string extension = lower_extension(path);
  if (is_compressed_log(path)) extension = lower_extension(path.stem());
  if (extension == ".active") extension = lower_extension(path.stem()) == ".bag" ? ".bag" : "";
  const bool is_log = extension == ".mcap" || extension == ".bag" || extension == ".db3";
  return is_log ? extension : std::string();
}

/// Files with a name of a log directly in a folder, by name. A compressed file beside its
/// decompressed form is left out.
std::vector<fs::path> logs_in_folder(const fs::path& folder) {
  std::set<fs::path> all;
  for (const fs::path& path : paths_in(folder)) {
    if (!log_extension(path).empty()) all.insert(path);
  }
  std::vector<fs::path> logs;
  for (const fs::path& log : all) {
    if (!is_compressed_log(log) || all.count(folder / log.stem()) == 0) logs.push_back(log);
  }
  return logs;
}

/// A log that consists of several files in a folder.
struct LogParts {
  std::vector<fs::path> files;
  std::optional<fs::path> metadata;
  std::optional<std::string> missing;  ///< which parts are not there, one sentence
};

/// Name without directory and without the extension of a compression.
std::string plain_name(const fs::path& path) {
  return (is_compressed_log(path) ? path.stem() : path.filename()).string();
}

/// Names below `relative_file_paths` of a metadata.yaml of rosbag2, without folders.
std::vector<std::string> listed_files(const fs::path& metadata) {
  ByteReader reader(metadata);
  std::vector<std::string> names;
  bool is_inside = false;
  for (std::string line; reader.read_line(line);) {
    std::string_view rest = line;
    const std::string_view first = text::next_token(rest);
    const bool is_begin = first == "relative_file_paths:";
    if (is_inside && !is_begin && first != "-") break;
    if (!is_begin && !is_inside) continue;
    is_inside = true;
    for (const std::string_view token : text::tokens(rest)) {
      const std::string_view name = text::trimmed(token, "\"'[],");
      if (!name.empty()) names.push_back(plain_name(fs::path(name).filename()));
    }
  }
  return names;
}

std::string missing_text(const std::vector<std::string>& missing, std::size_t found) {
  return std::to_string(missing.size()) + " of " + std::to_string(missing.size() + found) +
         " parts of the log are missing: " + text::listed(missing);
}

/// N of a name NAME_N.
std::optional<std::size_t> part_number(const std::string& stem) {
  const std::size_t at = stem.rfind('_');
  if (at == std::string::npos || at + 1 == stem.size() || stem.size() - at > 7) {
    return std::nullopt;
  }
  const std::string digits = stem.substr(at + 1);
  if (digits.find_first_not_of("0123456789") != std::string::npos) return std::nullopt;
  return std::stoul(digits);
}

std::string stem_of(const fs::path& path) { return fs::path(plain_name(path)).stem().string(); }

/// Parts that are missing by metadata.yaml.
std::vector<std::string> missing_by_list(const LogParts& parts) {
  std::set<std::string> names;
  for (const fs::path& file : parts.files) names.insert(plain_name(file));
  std::vector<std::string> missing;
  for (const std::string& name : listed_files(*parts.metadata)) {
    if (names.count(name) == 0) missing.push_back(name);
  }
  return missing;
}

/// Parts that are missing in NAME_0, NAME_1, ... up to the last one that is there.
std::vector<std::string> missing_by_number(const fs::path& folder, const LogParts& parts) {
  std::set<std::size_t> numbers;
  std::set<std::string> kinds;
  for (const fs::path& file : parts.files) {
    const auto number = part_number(stem_of(file));
    if (number) numbers.insert(*number);
    kinds.insert(log_extension(file));
  }
  if (numbers.size() != parts.files.size() || kinds.size() != 1) {
    std::vector<std::string> names;
    for (const fs::path& file : parts.files) names.push_back(file.filename().string());
    fail(folder, "has " + std::to_string(names.size()) + " logs (" + text::listed(names) +
                     ") and no metadata.yaml; expected one log, or parts NAME_0, NAME_1, ... of "
                     "one; name one of the files");
  }
  std::vector<std::string> missing;
  const std::string stem = stem_of(parts.files.front());
  const std::string base = stem.substr(0, stem.rfind('_') + 1);
  for (std::size_t number = 0; number < *numbers.rbegin() && missing.size() < 1000; ++number) {
    if (numbers.count(number) == 0) missing.push_back(base + std::to_string(number));
  }
  return missing;
}

/// The parts of the log in a folder, by metadata.yaml; without that file the only log, or parts
/// NAME_0, NAME_1, ... Throws IoError if the files may be several logs.
LogParts find_parts(const fs::path& folder) {
  LogParts parts;
  parts.files = logs_in_folder(folder);
  if (is_file(folder / "metadata.yaml")) parts.metadata = folder / "metadata.yaml";
  std::vector<std::string> missing;
  if (parts.metadata) {
    missing = missing_by_list(parts);
  } else if (parts.files.size() > 1) {
    missing = missing_by_number(folder, parts);
  }
  if (!missing.empty()) parts.missing = missing_text(missing, parts.files.size());
  return parts;
}

std::unique_ptr<LogFile> open_file(const fs::path& path) {
  const std::string extension = log_extension(path);
  if (is_compressed_log(path) && !extension.empty()) {
    fail(path, "is compressed as a whole; decompress it: zstd -d --rm " + path.string());
  }
  if (extension == ".mcap") return open_mcap(path);
  if (extension == ".bag") return open_ros_bag(path);
#if defined(DYNAINS_HAS_SQLITE3)
  if (extension == ".db3") return open_sqlite_bag(path);
#else
  if (extension == ".db3") fail(path, "this build has no SQLite (Debian: libsqlite3-dev)");
#endif
  fail(path, "expected a log with the name *.mcap, *.db3 or *.bag");
}

/// A log that rosbag2 split into several files.
class SplitLog final : public LogFile {
 public:
  SplitLog(const fs::path& folder, const LogParts& parts)
      : LogFile(folder), metadata_(parts.metadata) {
    missing_parts_ = parts.missing;
    for (const fs::path& file : parts.files) {
      parts_.push_back(open_file(file));
      add(*parts_.back(), static_cast<std::uint32_t>(parts_.size() - 1));
      parts_.back()->release();
    }
    finish_index();
  }

  std::vector<fs::path> files() const override {
    std::vector<fs::path> files;
    if (metadata_) files.push_back(*metadata_);
    for (const auto& part : parts_) files.push_back(part->path());
    return files;
  }
  MessageStamp read(const LogMessage& message, std::vector<std::uint8_t>& bytes) override {
    if (message.part != last_part_) parts_[last_part_]->release();
    last_part_ = message.part;
    return parts_[message.part]->read(message, bytes);
  }
  void copy_others(McapWriter& writer) override {
    for (const auto& part : parts_) part->copy_others(writer);
  }
  void release() override { parts_[last_part_]->release(); }

 private:
  void add(const LogFile& part, std::uint32_t number) {
    if (part.early_end()) early_end_ = part.early_end();
    profile_ = part.profile();
    std::vector<std::uint32_t> topic_of;
    for (const LogTopic& topic : part.topics()) topic_of.push_back(add_topic(topic));
    for (LogMessage message : part.messages()) {
      message.topic = topic_of[message.topic];
      message.part = number;
      messages_.push_back(message);
    }
  }

  std::optional<fs::path> metadata_;
  std::vector<std::unique_ptr<LogFile>> parts_;
  std::size_t last_part_ = 0;  ///< the part that was read last
};

}  // namespace

std::uint32_t LogFile::add_topic(LogTopic topic) {
  const auto [known, is_new] =
      topic_index_.emplace(std::tuple(topic.name, topic.type, topic.message_encoding),
                           static_cast<std::uint32_t>(topics_.size()));
  topic.message_count = 0;
  if (is_new) topics_.push_back(std::move(topic));
  return known->second;
}

void LogFile::finish_index() {
  std::stable_sort(messages_.begin(), messages_.end(),
                   [](const LogMessage& a, const LogMessage& b) { return a.time < b.time; });
  for (const LogMessage& message : messages_) ++topics_[message.topic].message_count;
}

bool is_log(const fs::path& path) {
  if (!is_folder(path)) return !log_extension(path).empty();
  return is_file(path / "metadata.yaml") && has_logs(path);
}

bool has_logs(const fs::path& folder) { return !logs_in_folder(folder).empty(); }

std::unique_ptr<LogFile> open_log(const fs::path& path, bool accept_missing) {
  if (!is_folder(path)) return open_file(path);
  const LogParts parts = find_parts(path);
  if (parts.missing && !accept_missing) {
    fail(path, *parts.missing + "; --accept-missing reads the others");
  }
  return std::make_unique<SplitLog>(path, parts);
}

std::string plain_type(std::string type) {
  const std::size_t at = type.find("/msg/");
  if (at != std::string::npos) type.erase(at, 4);
  return type;
}

}  // namespace dynains
