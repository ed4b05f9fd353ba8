#include "sqlite_handles.hpp"

#include <sqlite3.h>

#include "../failure.hpp"

namespace dynains {

void CloseDatabase::operator()(sqlite3* database) const { sqlite3_close(database); }
void FinishStatement::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

SqliteDatabase open_database(const std::string& name, int flags, const std::filesystem::path& path,
                             const std::string& problem) {
  sqlite3* database = nullptr;
  const int result = sqlite3_open_v2(name.c_str(), &database, flags, nullptr);
  SqliteDatabase owner(database);
  if (result != SQLITE_OK) fail(path, problem + ": " + sqlite3_errstr(result));
  return owner;
}

SqliteStatement prepare_statement(const SqliteDatabase& database, const char* sql,
                                  const std::filesystem::path& path, const std::string& problem) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database.get(), sql, -1, &statement, nullptr) != SQLITE_OK) {
    fail_by_database(database, path, problem);
  }
  return SqliteStatement(statement);
}

void fail_by_database(const SqliteDatabase& database, const std::filesystem::path& path,
                      const std::string& problem) {
  fail(path, problem + ": " + sqlite3_errmsg(database.get()));
}

}  // namespace dynains
