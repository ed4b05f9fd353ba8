// Writes logs of rosbag2 in SQLite for tests, if this build has SQLite.
#pragma once

#if defined(DYNAINS_HAS_SQLITE3)

#include <sqlite3.h>

#include "log_writer.hpp"
#include "support/standard.hpp"

namespace dynains::test {

inline void execute(sqlite3* database, const std::string& sql) {
  if (sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    throw std::runtime_error(sqlite3_errmsg(database));
  }
}

/// Runs SQL on a file, which is made if there is none.
inline void execute(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* database = nullptr;
  if (sqlite3_open(path.c_str(), &database) != SQLITE_OK) throw std::runtime_error(path.string());
  execute(database, sql);
  sqlite3_close(database);
}

inline std::string blob_of(const std::string& bytes) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text = "x'";
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += kDigits[byte / 16];
    text += kDigits[byte % 16];
  }
  return text + "'";
}

inline void write_db3(const std::filesystem::path& path, const std::vector<LogChannel>& channels,
                      const std::vector<WrittenMessage>& messages) {
  std::string sql =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, "
      "serialization_format TEXT, offered_qos_profiles TEXT);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
      "data BLOB); BEGIN;";
  for (std::size_t i = 0; i < channels.size(); ++i) {
    sql += "INSERT INTO topics VALUES(" + std::to_string(i) + ", '" + channels[i].topic + "', '" +
           channels[i].type + "', '" + channels[i].encoding + "', '');";
  }
  for (const WrittenMessage& message : messages) {
    sql += "INSERT INTO messages(topic_id, timestamp, data) VALUES(" +
           std::to_string(message.channel) + ", " + std::to_string(message.time) + ", " +
           blob_of(message.data) + ");";
  }
  execute(path, sql + "COMMIT");
}

}  // namespace dynains::test

#endif
