#include "log_file.hpp"

#include <algorithm>

#include "../failure.hpp"
#include "../input_file.hpp"
#include "dynains/io/atomic_file.hpp"
#include "log_folder.hpp"
#include "mcap.hpp"
#include "message_editor.hpp"
#include "raw_file.hpp"
#include "ros_bag.hpp"
#include "staged_folder.hpp"
#if defined(DYNAINS_HAS_SQLITE3)
#include "sqlite_bag.hpp"
#endif

namespace dynains {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<LogFile> open_file(const fs::path& path) {
  const std::string extension = log_extension(path);
  if (is_compressed_log(path) && !extension.empty()) {
    fail(path, "is compressed as a whole; decompress it: zstd -d --rm " + path.string());
  }
  if (extension == ".mcap") return std::make_unique<McapFile>(path);
  if (extension == ".bag") return std::make_unique<RosBag>(path);
#if defined(DYNAINS_HAS_SQLITE3)
  if (extension == ".db3") return std::make_unique<SqliteBag>(path);
#else
  if (extension == ".db3") fail(path, "this build has no SQLite (Debian: libsqlite3-dev)");
#endif
  fail(path, "expected a log with the name *.mcap, *.db3 or *.bag");
}

/// Tells the editor of a log the part of each message.
class PartEditor final : public MessageEditor {
 public:
  PartEditor(MessageEditor& whole, std::uint32_t part) : whole_(whole), part_(part) {}

  void pause() override { whole_.pause(); }
  bool changes(const LogMessage& place) override { return whole_.changes(in_part(place)); }
  std::string edited(const LogMessage& place, const std::vector<std::uint8_t>& message) override {
    return whole_.edited(in_part(place), message);
  }

 private:
  LogMessage in_part(LogMessage place) const {
    place.part = part_;
    return place;
  }

  MessageEditor& whole_;
  std::uint32_t part_;
};

void copy_text(const fs::path& source, const fs::path& target) {
  RawFile input(source);
  const auto bytes = input.read(0, input.size(), "a file");
  AtomicFile file(target);
  file.stream().write(reinterpret_cast<const char*>(bytes.data()),
                      static_cast<std::streamsize>(bytes.size()));
  file.commit();
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

  bool is_folder() const override { return true; }
  std::vector<fs::path> files() const override {
    std::vector<fs::path> files;
    if (metadata_) files.push_back(*metadata_);
    for (const auto& part : parts_) files.push_back(part->path());
    return files;
  }
  void read(const LogMessage& message, std::vector<std::uint8_t>& bytes) override {
    if (message.part != last_part_) parts_[last_part_]->release();
    last_part_ = message.part;
    parts_[message.part]->read(message, bytes);
  }
  void copy(const fs::path& target, MessageEditor& editor) override {
    StagedFolder folder(target);
    if (metadata_) copy_text(*metadata_, folder.path() / metadata_->filename());
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      PartEditor part(editor, static_cast<std::uint32_t>(i));
      parts_[i]->copy(folder.path() / parts_[i]->path().filename(), part);
      parts_[i]->release();
    }
    folder.commit();
  }
  void release() override { parts_[last_part_]->release(); }

 private:
  void add(const LogFile& part, std::uint32_t number) {
    if (part.early_end()) early_end_ = part.early_end();
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

std::uint32_t LogFile::add_topic(const LogTopic& topic) {
  const auto same = std::find_if(topics_.begin(), topics_.end(), [&](const LogTopic& other) {
    return other.name == topic.name && other.type == topic.type && other.encoding == topic.encoding;
  });
  const auto index = static_cast<std::uint32_t>(same - topics_.begin());
  if (same == topics_.end()) topics_.push_back({topic.name, topic.type, topic.encoding, 0});
  return index;
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
