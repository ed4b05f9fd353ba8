#include "sqlite_writer.hpp"

#include <sqlite3.h>

#include "../failure.hpp"

namespace dynains {

namespace {
constexpr const char* kUnwritable = "cannot be written";
}  // namespace

SqliteWriter::SqliteWriter(const std::filesystem::path& path)
    : path_(path),
      file_(path),
      database_(open_database(file_.temporary_path(), SQLITE_OPEN_READWRITE, path_, kUnwritable)) {
  // The file takes its name when it is whole: a journal would have no use.
  execute("PRAGMA journal_mode = OFF");
  execute("PRAGMA synchronous = OFF");
  execute("CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL)");
  execute("INSERT INTO schema VALUES(3, '')");
  execute(
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
      "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)");
  execute(
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
      "timestamp INTEGER NOT NULL, data BLOB NOT NULL)");
  execute("CREATE INDEX timestamp_idx ON messages(timestamp ASC)");
  execute("BEGIN");
  insert_message_ = prepare("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)");
}

std::uint16_t SqliteWriter::add_channel(const std::string& topic, const MessageType& type) {
  const SqliteStatement insert = prepare("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '')");
  const std::string name = type.ros2_name();
  const std::uint16_t channel = ++channels_;  // rows count from 1
  sqlite3_bind_int(insert.get(), 1, channel);
  sqlite3_bind_text(insert.get(), 2, topic.c_str(), -1, SQLITE_TRANSIENT);
  sqlite3_bind_text(insert.get(), 3, name.c_str(), -1, SQLITE_TRANSIENT);
  step(insert.get());
  return channel;
}

void SqliteWriter::write(std::uint16_t channel, std::uint64_t time, const std::string& message) {
  sqlite3_stmt* const insert = insert_message_.get();
  sqlite3_reset(insert);
  sqlite3_bind_int(insert, 1, channel);
  sqlite3_bind_int64(insert, 2, static_cast<std::int64_t>(time));
  sqlite3_bind_blob64(insert, 3, message.data(), message.size(), SQLITE_STATIC);
  step(insert);
}

void SqliteWriter::commit() {
  insert_message_.reset();
  execute("COMMIT");
  if (sqlite3_close(database_.release()) != SQLITE_OK) fail(path_, "cannot be written to the end");
  file_.commit();
}

SqliteStatement SqliteWriter::prepare(const char* sql) {
  return prepare_statement(database_, sql, path_, kUnwritable);
}

void SqliteWriter::step(sqlite3_stmt* statement) {
  if (sqlite3_step(statement) != SQLITE_DONE) fail_by_database(database_, path_, kUnwritable);
}

void SqliteWriter::execute(const char* sql) {
  if (sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK) {
    fail_by_database(database_, path_, kUnwritable);
  }
}

}  // namespace dynains
