// Writer of logs of rosbag2 in SQLite.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "dynains/io/atomic_file.hpp"
#include "log_writer.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace dynains {

class SqliteWriter final : public LogWriter {
 public:
  explicit SqliteWriter(const std::filesystem::path& path);

  MessageEncoding encoding() const override { return MessageEncoding::kCdr; }
  std::uint16_t add_channel(const std::string& topic, const MessageType& type) override;
  void write(std::uint16_t channel, std::uint64_t time, const std::string& message) override;
  void commit() override;

 private:
  struct CloseDatabase {
    void operator()(sqlite3* database) const;
  };
  struct FinishStatement {
    void operator()(sqlite3_stmt* statement) const;
  };
  using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

  Statement prepare(const char* sql);
  void step(sqlite3_stmt* statement);
  void execute(const char* sql);
  [[noreturn]] void fail_by_database() const;

  std::filesystem::path path_;
  AtomicFile file_;
  std::unique_ptr<sqlite3, CloseDatabase> database_;
  Statement insert_message_;
  std::uint16_t channels_ = 0;
};

}  // namespace dynains
