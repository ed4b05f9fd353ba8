// Databases and statements of SQLite that close themselves.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

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

/// Opens the database `name`, a path or a URI. Throws IoError, which says that `path` has the
/// `problem`.
SqliteDatabase open_database(const std::string& name, int flags, const std::filesystem::path& path,
                             const std::string& problem);

/// Throws IoError, which says that `path` has the `problem`.
SqliteStatement prepare_statement(const SqliteDatabase& database, const char* sql,
                                  const std::filesystem::path& path, const std::string& problem);

/// Throws IoError: `path` has the `problem`, with the last error of the database.
[[noreturn]] void fail_by_database(const SqliteDatabase& database,
                                   const std::filesystem::path& path, const std::string& problem);

}  // namespace dynains
