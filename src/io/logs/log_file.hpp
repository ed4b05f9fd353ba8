// Logs of robots: files of messages by topic and time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace dynains {

class McapWriter;

inline constexpr std::uint64_t kSecondOfLog = 1000000000;  ///< ns

/// How the fields of a message are serialised.
enum class MessageEncoding : std::uint8_t {
  kRos1,  ///< little endian, without padding
  kCdr,   ///< ROS 2: XCDR1 with an encapsulation header of four bytes
  kOther  ///< not readable here
};

inline constexpr std::size_t kCdrHeader = 4;  ///< bytes

/// What decodes the messages of a topic, in the terms of MCAP.
struct LogSchema {
  std::string name;      ///< of the type, as in the file
  std::string encoding;  ///< of the definition, for example "ros2msg"; empty without one
  std::string definition;
};

/// One stream of messages of one type.
struct LogTopic {
  std::string name;  ///< for example "/points"
  std::string type;  ///< package and name, for example "sensor_msgs/PointCloud2"
  MessageEncoding encoding = MessageEncoding::kOther;
  std::uint64_t message_count = 0;
  // For copies.
  std::string message_encoding;                 ///< as in the file, for example "cdr"
  std::shared_ptr<const LogSchema> schema;      ///< may be null
  std::map<std::string, std::string> metadata;  ///< for example the quality of service
};

/// What a message of MCAP has beside its data and log time.
struct MessageStamp {
  std::uint64_t publish_time = 0;  ///< ns
  std::uint32_t sequence = 0;
};

/// Address of one message.
struct LogMessage {
  std::uint64_t time = 0;    ///< ns, when the message was recorded
  std::uint64_t block = 0;   ///< meaning by format: byte of a chunk or of a message, or row
  std::uint64_t offset = 0;  ///< bytes from the begin of the records of a chunk
  std::uint32_t topic = 0;   ///< index in LogFile::topics()
  std::uint32_t part = 0;    ///< index of the file, if the log has several
};

/// An index of all messages of a log, and access to each. One object serves one thread at a time.
///
/// Opening reads the index, 32 bytes for each message, and keeps no message. A log that ends early,
/// as after a crash of the recorder, gives the messages before its end; early_end() describes it.
/// All members throw IoError with path, position and the expected content.
class LogFile {
 public:
  virtual ~LogFile() = default;

  const std::filesystem::path& path() const { return path_; }
  /// Every file that belongs to the log.
  virtual std::vector<std::filesystem::path> files() const { return {path_}; }
  const std::vector<LogTopic>& topics() const { return topics_; }
  /// All messages by time; messages of equal time keep their order in the file.
  const std::vector<LogMessage>& messages() const { return messages_; }
  /// Path, position and reason, if the log ends early.
  const std::optional<std::string>& early_end() const { return early_end_; }
  /// Which parts are missing, if the log has several and some are not there.
  const std::optional<std::string>& missing_parts() const { return missing_parts_; }

  /// "ros1", "ros2", or as an MCAP file says.
  const std::string& profile() const { return profile_; }

  /// Replaces `bytes` by the serialised message. Memory of `bytes` is reused.
  virtual MessageStamp read(const LogMessage& message, std::vector<std::uint8_t>& bytes) = 0;
  /// Copies what is no message: attachments and metadata of MCAP.
  virtual void copy_others(McapWriter&) {}
  /// Gives memory back that the next read() would reuse.
  virtual void release() {}

 protected:
  explicit LogFile(std::filesystem::path path) : path_(std::move(path)) {}
  /// The index of a topic of this name, type and encoding, which is added if it is new.
  std::uint32_t add_topic(LogTopic topic);
  /// Sorts the messages and counts them by topic.
  void finish_index();

  std::filesystem::path path_;
  std::vector<LogTopic> topics_;
  std::vector<LogMessage> messages_;
  std::optional<std::string> early_end_;
  std::optional<std::string> missing_parts_;
  std::string profile_;

 private:
  std::map<std::tuple<std::string, std::string, std::string>, std::uint32_t> topic_index_;
};

/// Whether `path` is a log by its name: *.mcap, *.bag, *.bag.active, *.db3, one of these compressed
/// as a whole (which open_log() refuses), or a folder with metadata.yaml and one or more of these.
/// Throws IoError if the system does not report it.
bool is_log(const std::filesystem::path& path);

/// Whether files with the name of a log lie directly in a folder. Throws IoError.
bool has_logs(const std::filesystem::path& folder);

/// Opens a log of ROS 1 (.bag) or ROS 2 (.mcap, .db3), or a folder with the parts of one. Throws
/// IoError, also for parts that are missing unless these are accepted, and if this build lacks the
/// library that the format needs; the message names its package.
std::unique_ptr<LogFile> open_log(const std::filesystem::path& path, bool accept_missing = false);

/// Open one file: MCAP, a bag of ROS 1, a database of rosbag2.
std::unique_ptr<LogFile> open_mcap(const std::filesystem::path& path);
std::unique_ptr<LogFile> open_ros_bag(const std::filesystem::path& path);
std::unique_ptr<LogFile> open_sqlite_bag(const std::filesystem::path& path);

/// "sensor_msgs/msg/PointCloud2" of ROS 2 as in ROS 1.
std::string plain_type(std::string type);

}  // namespace dynains
