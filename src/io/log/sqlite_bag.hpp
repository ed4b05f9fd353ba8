// Logs of rosbag2 in SQLite (*.db3).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "log_file.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace dynains {

/// Opens the database read-only. LogMessage::block is the row of a message.
class SqliteBag final : public LogFile {
 public:
  explicit SqliteBag(const std::filesystem::path& path);
  void read(const LogMessage& message, std::vector<std::uint8_t>& bytes) override;

 private:
  struct CloseDatabase {
    void operator()(sqlite3* database) const;
  };
  struct FinishStatement {
    void operator()(sqlite3_stmt* statement) const;
  };
  using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

  void read_topics();
  void read_messages();
  void drop_unreadable();
  int select(const LogMessage& message);
  Statement prepare(const char* sql);
  bool step(sqlite3_stmt* statement);
  [[noreturn]] void fail_by_database() const;

  std::unique_ptr<sqlite3, CloseDatabase> database_;
  Statement select_message_;
  std::map<std::int64_t, std::uint32_t> topic_of_;  ///< by id in the database
};

}  // namespace dynains
