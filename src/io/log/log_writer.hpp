// Writers of logs of robots.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "log_file.hpp"
#include "message_types.hpp"

namespace dynains {

/// The file appears whole, at `commit()`, or not at all. All members throw IoError.
class LogWriter {
 public:
  virtual ~LogWriter() = default;

  /// Encoding of all messages.
  virtual MessageEncoding encoding() const = 0;
  virtual std::uint16_t add_channel(const std::string& topic, const MessageType& type) = 0;
  /// `time`: ns, not before that of the message before. `message`: serialised by encoding().
  virtual void write(std::uint16_t channel, std::uint64_t time, const std::string& message) = 0;
  virtual void commit() = 0;
};

/// A writer by the name: *.mcap or *.db3 (ROS 2), or *.bag (ROS 1). Throws IoError, also if this
/// build lacks SQLite for .db3.
std::unique_ptr<LogWriter> create_log(const std::filesystem::path& path);

}  // namespace dynains
