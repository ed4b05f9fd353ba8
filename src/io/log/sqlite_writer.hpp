// Writer of logs of rosbag2 in SQLite.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "dynains/io/atomic_file.hpp"
#include "log_writer.hpp"
#include "sqlite_handles.hpp"

namespace dynains {

class SqliteWriter final : public LogWriter {
 public:
  explicit SqliteWriter(const std::filesystem::path& path);

  MessageEncoding encoding() const override { return MessageEncoding::kCdr; }
  std::uint16_t add_channel(const std::string& topic, const MessageType& type) override;
  void write(std::uint16_t channel, std::uint64_t time, const std::string& message) override;
  void commit() override;

 private:
  SqliteStatement prepare(const char* sql);
  void step(sqlite3_stmt* statement);
  void execute(const char* sql);

  std::filesystem::path path_;
  AtomicFile file_;
  SqliteDatabase database_;
  SqliteStatement insert_message_;
  std::uint16_t channels_ = 0;
};

}  // namespace dynains
