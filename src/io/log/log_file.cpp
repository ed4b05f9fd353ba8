#include "log_file.hpp"

#include <algorithm>
#include <system_error>

#include "../failure.hpp"
#include "../input_file.hpp"
#include "mcap.hpp"
#include "ros_bag.hpp"
#if defined(DYNAINS_HAS_SQLITE3)
#include "../text.hpp"
#include "sqlite_bag.hpp"
#endif

namespace dynains {
namespace {

namespace fs = std::filesystem;

std::string extension_of(const fs::path& path) {
  return text::lower_case(path.extension().string());
}

bool is_log_name(const fs::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".mcap" || extension == ".bag" || extension == ".db3";
}

/// The logs directly in a folder, by name.
std::vector<fs::path> logs_in_folder(const fs::path& folder) {
  std::vector<fs::path> logs;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (is_log_name(entry->path())) logs.push_back(entry->path());
  }
  if (error) fail(folder, "cannot be listed: " + error.message());
  std::sort(logs.begin(), logs.end());
  return logs;
}

std::unique_ptr<LogFile> open_file(const fs::path& path) {
  const std::string extension = extension_of(path);
  if (extension == ".mcap") return std::make_unique<McapFile>(path);
  if (extension == ".bag") return std::make_unique<RosBag>(path);
#if defined(DYNAINS_HAS_SQLITE3)
  if (extension == ".db3") return std::make_unique<SqliteBag>(path);
#else
  if (extension == ".db3") fail(path, "this build has no SQLite (Debian: libsqlite3-dev)");
#endif
  fail(path, "expected a log with the name *.mcap, *.db3 or *.bag");
}

/// A log that rosbag2 split into several files.
class SplitLog final : public LogFile {
 public:
  SplitLog(const fs::path& folder, const std::vector<fs::path>& files) : LogFile(folder) {
    for (const fs::path& file : files) {
      parts_.push_back(open_file(file));
      add(*parts_.back(), static_cast<std::uint32_t>(parts_.size() - 1));
      parts_.back()->release();
    }
    finish_index();
  }

  std::vector<fs::path> files() const override {
    std::vector<fs::path> files = {path_ / "metadata.yaml"};
    for (const auto& part : parts_) files.push_back(part->path());
    return files;
  }
  void read(const LogMessage& message, std::vector<std::uint8_t>& bytes) override {
    if (message.part != last_part_) parts_[last_part_]->release();
    last_part_ = message.part;
    parts_[message.part]->read(message, bytes);
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
  if (!is_folder(path)) return is_log_name(path);
  return is_file(path / "metadata.yaml") && !logs_in_folder(path).empty();
}

std::unique_ptr<LogFile> open_log(const fs::path& path) {
  if (!is_folder(path)) return open_file(path);
  return std::make_unique<SplitLog>(path, logs_in_folder(path));
}

std::string plain_type(std::string type) {
  const std::size_t at = type.find("/msg/");
  if (at != std::string::npos) type.erase(at, 4);
  return type;
}

}  // namespace dynains
