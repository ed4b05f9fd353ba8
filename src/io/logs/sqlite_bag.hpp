// Logs of rosbag2 in SQLite (*.db3).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "log_file.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace dynains {

struct CloseDatabase {
  void operator()(sqlite3* database) const;
};
struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const;
};
using SqliteDatabase = std::unique_ptr<sqlite3, CloseDatabase>;
using SqliteStatement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

/// Opens the database as it is, so that nothing is written beside it; one with a journal is
/// refused. Views, virtual tables and computed columns are refused, since they
/// are programs. LogMessage::block is the row of a message.
class SqliteBag final : public LogFile {
 public:
  explicit SqliteBag(const std::filesystem::path& path);
  MessageStamp read(const LogMessage& message, std::vector<std::uint8_t>& bytes) override;

 private:
  void limit(std::uint64_t size);
  std::map<std::string, bool> columns_of(const std::string& table);
  void count_row();
  std::map<std::string, std::shared_ptr<const LogSchema>> read_schemas();
  void read_topics();
  void read_messages();
  void drop_unreadable();
  int select(const LogMessage& message);
  SqliteStatement prepare(const std::string& sql);
  bool step(sqlite3_stmt* statement);

  std::uint64_t max_rows_ = 0;  ///< that are still accepted
  std::int64_t budget_ = 0;     ///< of the progress handler; outlives the database
  SqliteDatabase database_;
  SqliteStatement select_message_;
  std::map<std::int64_t, std::uint32_t> topic_of_;  ///< by id in the database
};

}  // namespace dynains
