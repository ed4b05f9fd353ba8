// Logs of rosbag2 in SQLite (*.db3).
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "log_file.hpp"
#include "sqlite_handles.hpp"

namespace dynains {

/// Opens the database read-only. LogMessage::block is the row of a message.
class SqliteBag final : public LogFile {
 public:
  explicit SqliteBag(const std::filesystem::path& path);
  void read(const LogMessage& message, std::vector<std::uint8_t>& bytes) override;

 private:
  void read_topics();
  void read_messages();
  void drop_unreadable();
  int select(const LogMessage& message);
  SqliteStatement prepare(const char* sql);
  bool step(sqlite3_stmt* statement);

  SqliteDatabase database_;
  SqliteStatement select_message_;
  std::map<std::int64_t, std::uint32_t> topic_of_;  ///< by id in the database
};

}  // namespace dynains
