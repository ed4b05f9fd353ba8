#include "log_file.hpp"

#include <algorithm>

#include "../failure.hpp"
#include "../input_file.hpp"
#include "log_folder.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

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
