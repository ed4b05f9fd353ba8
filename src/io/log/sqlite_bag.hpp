// Logs of rosbag2 in SQLite (*.db3).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "log_file.hpp"
#include "sqlite_handles.hpp"

namespace dynains {

/// Opens the database read-only. Views, virtual tables and computed columns are refused, since they
/// are programs. LogMessage::block is the row of a message.
class SqliteBag final : public LogFile {
 public:
  explicit SqliteBag(const std::filesystem::path& path);
  void read(const LogMessage& message, std::vector<std::uint8_t>& bytes) override;
  void copy(const std::filesystem::path& target, MessageEditor& editor) override;

 private:
  void limit(std::uint64_t size);
  void check_table(const std::string& table);
  void count_row();
  void read_topics();
  void read_messages();
  void drop_unreadable();
  int select(const LogMessage& message);
  SqliteStatement prepare(const char* sql);
  bool step(sqlite3_stmt* statement);
  void copy_pages(const SqliteDatabase& copy, const std::filesystem::path& target,
                  MessageEditor& editor);

  std::uint64_t most_rows_ = 0;  ///< that are still accepted
  std::int64_t budget_ = 0;      ///< of the progress handler; outlives the database
  SqliteDatabase database_;
  SqliteStatement select_message_;
  std::map<std::int64_t, std::uint32_t> topic_of_;  ///< by id in the database
};

}  // namespace dynains
