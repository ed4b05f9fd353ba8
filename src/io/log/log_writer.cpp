#include "log_writer.hpp"

#include "../failure.hpp"
#include "bag_writer.hpp"
#include "mcap_writer.hpp"
#if defined(DYNAINS_HAS_SQLITE3)
#include "sqlite_writer.hpp"
#endif

namespace dynains {

std::unique_ptr<LogWriter> create_log(const std::filesystem::path& path) {
  const std::filesystem::path extension = path.extension();
  if (extension == ".mcap") return std::make_unique<McapWriter>(path);
  if (extension == ".bag") return std::make_unique<BagWriter>(path);
#if defined(DYNAINS_HAS_SQLITE3)
  if (extension == ".db3") return std::make_unique<SqliteWriter>(path);
#else
  if (extension == ".db3") fail(path, "this build has no SQLite (Debian: libsqlite3-dev)");
#endif
  fail(path, "expected a log with the name *.mcap, *.db3 or *.bag");
}

}  // namespace dynains
