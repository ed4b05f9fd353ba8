#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../scalar.hpp"
#include "log_file.hpp"
#include "message_fields.hpp"

namespace dynains {
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using SqliteDatabase = std::unique_ptr<sqlite3, CloseDatabase>;
using SqliteStatement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

std::string text_of(sqlite3_stmt* statement, int column) {
  const unsigned char* const text = sqlite3_column_text(statement, column);
  return text == nullptr ? std::string() : reinterpret_cast<const char*>(text);
}

/// Opened in this way, the database is read as it is, and SQLite writes no file beside it.
std::string uri_of(const std::filesystem::path& path) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '/' || c == '.' || c == '-' || c == '_') {
      uri += c;
    } else {
      std::array<char, 4> code{};
      std::snprintf(code.data(), code.size(), "%%%02X", static_cast<unsigned>(byte));
      uri += code.data();
    }
  }
  return uri + "?mode=ro&immutable=1";
}

/// A recorder that was killed leaves a journal, without which its database is not consistent.
void refuse_journal(const std::filesystem::path& path) {
  for (const char* const suffix : {"-wal", "-journal"}) {
    std::error_code error;
    const std::filesystem::path journal = path.string() + suffix;
    if (std::filesystem::file_size(journal, error) == 0 || error) continue;
    fail(path, "is incomplete without " + journal.filename().string() +
                   ", which its recorder left; join them: sqlite3 FILE 'PRAGMA journal_mode = "
                   "DELETE'");
  }
}

/// Whether the file has fewer bytes than the pages that its header counts.
bool is_shorter_than_announced(const std::filesystem::path& path) {
  constexpr std::uint64_t kHeader = 100;  // bytes
  ByteReader file(path);
  if (file.size() < kHeader) return false;
  const std::string header = file.read_block(kHeader, "a header");
  const auto page_size =
      static_cast<std::uint64_t>(load_scalar(Scalar::kUint16, &header[16], true));
  const auto pages = static_cast<std::uint64_t>(load_scalar(Scalar::kUint32, &header[28], true));
  return pages * (page_size == 1 ? 65536 : page_size) > file.size();
}

/// Work of the database in virtual steps. Reading a row takes about ten.
constexpr int kStepsOfProgress = 100000;

/// Called after each kStepsOfProgress; another number than 0 ends the query.
int spend(void* budget) { return --*static_cast<std::int64_t*>(budget) < 0 ? 1 : 0; }

std::string row_of(std::int64_t row) { return "row " + std::to_string(row) + " of messages: "; }

const std::string kExpected = "expected the tables of rosbag2: ";

[[noreturn]] void fail_by_database(const SqliteDatabase& database,
                                   const std::filesystem::path& path) {
  fail(path, std::string("cannot be read: ") + sqlite3_errmsg(database.get()));
}

SqliteDatabase open_database(const std::filesystem::path& path) {
  sqlite3* database = nullptr;
  const int result = sqlite3_open_v2(uri_of(path).c_str(), &database,
                                     SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
  SqliteDatabase owner(database);
  if (result != SQLITE_OK) fail(path, std::string("cannot be opened: ") + sqlite3_errstr(result));
  return owner;
}

/// A log of rosbag2 in SQLite. Opens the database as it is, so that nothing is written beside it;
/// one with a journal is refused. Views, virtual tables and computed columns are refused, since
/// they are programs. LogMessage::block is the row of a message.
class SqliteBag final : public LogFile {
 public:
  explicit SqliteBag(const std::filesystem::path& path) : LogFile(path) {
    profile_ = "ros2";
    const bool is_cut_off = is_shorter_than_announced(path);
    refuse_journal(path);
    database_ = open_database(path);
    limit(size_of_file(path));
    // Lets SQLite read a database that is shorter than its header says. Nothing is written.
    step(prepare("PRAGMA writable_schema = ON").get());
    const auto columns = columns_of("messages");
    if (columns.empty()) fail(path_, kExpected + "messages is no table");
    const auto key = columns.find("id");
    if (key == columns.end() || !key->second) {
      fail(path_, kExpected + "id is no primary key of messages");
    }
    select_message_ = prepare("SELECT data FROM messages WHERE id = ?");
    read_topics();
    read_messages();
    if (is_cut_off && !early_end_) early_end_ = path.string() + ": the log ends early";
    if (early_end_) drop_unreadable();
    finish_index();
  }

  MessageStamp read(const LogMessage& message, std::vector<std::uint8_t>& bytes) override {
    const int result = select(message);
    if (result == SQLITE_DONE) {
      fail(path_, row_of(static_cast<std::int64_t>(message.block)) + "expected a message");
    }
    if (result != SQLITE_ROW) fail_by_database(database_, path_);
    sqlite3_stmt* const statement = select_message_.get();
    const auto* const data = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement, 0));
    bytes.assign(data, data + sqlite3_column_bytes(statement, 0));
    return {message.time, 0};
  }

 private:
  /// No SQL of the file runs, and nothing is larger or takes longer than a file of `size` bytes can
  /// need.
  void limit(std::uint64_t size) {
    constexpr std::uint64_t kSlack = 1U << 20U;  // bytes, for queries
    const std::uint64_t most = std::numeric_limits<int>::max();
    sqlite3* const database = database_.get();
    for (const int program : {SQLITE_DBCONFIG_ENABLE_VIEW, SQLITE_DBCONFIG_ENABLE_TRIGGER,
                              SQLITE_DBCONFIG_TRUSTED_SCHEMA}) {
      sqlite3_db_config(database, program, 0, nullptr);
    }
    sqlite3_limit(database, SQLITE_LIMIT_LENGTH, static_cast<int>(std::min(size + kSlack, most)));
    max_rows_ = size;
    budget_ = static_cast<std::int64_t>(100 + size / 1000);
    sqlite3_progress_handler(database, kStepsOfProgress, spend, &budget_);
  }

  /// Names of the columns of a table, and whether each is the primary key; none without such a
  /// table. Throws unless it is one of stored columns.
  std::map<std::string, bool> columns_of(const std::string& table) {
    const SqliteStatement kind =
        prepare("SELECT type, sql FROM sqlite_master WHERE name = '" + table + "'");
    if (!step(kind.get())) return {};
    if (text_of(kind.get(), 0) != "table" ||
        text_of(kind.get(), 1).rfind("CREATE VIRTUAL", 0) == 0) {
      fail(path_, kExpected + table + " is no table");
    }
    const SqliteStatement rows = prepare("PRAGMA table_xinfo(" + table + ")");
    std::map<std::string, bool> columns;
    while (step(rows.get())) {
      const std::string column = text_of(rows.get(), 1);
      columns[column] = sqlite3_column_int(rows.get(), 5) == 1;
      if (sqlite3_column_int(rows.get(), 6) == 0) continue;
      fail(path_, kExpected + "column " + column + " of " + table + " is computed");
    }
    return columns;
  }

  /// Counts a row that was read. A file with loops or links among its pages has rows without end.
  void count_row() {
    if (max_rows_-- == 0) fail(path_, "has more rows than its size allows");
  }

  /// Definitions by type, which ROS 2 writes since Iron.
  std::map<std::string, std::shared_ptr<const LogSchema>> read_schemas() {
    std::map<std::string, std::shared_ptr<const LogSchema>> schemas;
    if (columns_of("message_definitions").empty()) return schemas;
    const SqliteStatement rows =
        prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions");
    while (step(rows.get())) {
      count_row();
      const std::string type = text_of(rows.get(), 0);
      schemas[type] = std::make_shared<LogSchema>(
          LogSchema{type, text_of(rows.get(), 1), text_of(rows.get(), 2)});
    }
    return schemas;
  }

  void read_topics() {
    const auto columns = columns_of("topics");
    if (columns.empty()) fail(path_, kExpected + "topics is no table");
    const auto schemas = read_schemas();
    constexpr const char* kQos = "offered_qos_profiles";
    const bool has_qos = columns.count(kQos) > 0;
    const SqliteStatement topics =
        prepare(std::string("SELECT id, name, type, serialization_format, ") +
                (has_qos ? kQos : "''") + " FROM topics");
    while (step(topics.get())) {
      count_row();
      LogTopic topic;
      topic.name = text_of(topics.get(), 1);
      const std::string type = text_of(topics.get(), 2);
      topic.type = plain_type(type);
      topic.message_encoding = text_of(topics.get(), 3);
      topic.encoding =
          topic.message_encoding == "cdr" ? MessageEncoding::kCdr : MessageEncoding::kOther;
      const auto schema = schemas.find(type);
      topic.schema = schema == schemas.end() ? ros2_schema(type) : schema->second;
      if (has_qos) topic.metadata[kQos] = text_of(topics.get(), 4);
      topic_of_[sqlite3_column_int64(topics.get(), 0)] = add_topic(topic);
    }
  }

  void read_messages() {
    const SqliteStatement messages =
        prepare("SELECT id, topic_id, timestamp FROM messages ORDER BY id");
    std::int64_t row = 0;
    int result = sqlite3_step(messages.get());
    for (; result == SQLITE_ROW; result = sqlite3_step(messages.get())) {
      count_row();
      row = sqlite3_column_int64(messages.get(), 0);
      const auto topic = topic_of_.find(sqlite3_column_int64(messages.get(), 1));
      if (topic == topic_of_.end()) fail(path_, row_of(row) + "expected the id of a topic");
      messages_.push_back({static_cast<std::uint64_t>(sqlite3_column_int64(messages.get(), 2)),
                           static_cast<std::uint64_t>(row), 0, topic->second, 0});
    }
    if (result == SQLITE_DONE) return;
    if (result != SQLITE_CORRUPT) fail_by_database(database_, path_);
    early_end_ = path_.string() + ": " + row_of(row) + "the log ends early behind it";
  }

  /// Rows may be there whose data are missing.
  void drop_unreadable() {
    const auto is_unreadable = [this](const LogMessage& message) {
      return select(message) != SQLITE_ROW;
    };
    messages_.erase(std::remove_if(messages_.begin(), messages_.end(), is_unreadable),
                    messages_.end());
  }

  /// Result of the search for the data of a message.
  int select(const LogMessage& message) {
    budget_ = std::max<std::int64_t>(budget_, 100);
    sqlite3_reset(select_message_.get());
    sqlite3_bind_int64(select_message_.get(), 1, static_cast<std::int64_t>(message.block));
    return sqlite3_step(select_message_.get());
  }

  SqliteStatement prepare(const std::string& sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
      fail(path_, kExpected + sqlite3_errmsg(database_.get()));
    }
    return SqliteStatement(statement);
  }

  bool step(sqlite3_stmt* statement) {
    const int result = sqlite3_step(statement);
    if (result == SQLITE_ROW) return true;
    if (result != SQLITE_DONE) fail_by_database(database_, path_);
    return false;
  }

  std::uint64_t max_rows_ = 0;  ///< that are still accepted
  std::int64_t budget_ = 0;     ///< of the progress handler; outlives the database
  SqliteDatabase database_;
  SqliteStatement select_message_;
  std::map<std::int64_t, std::uint32_t> topic_of_;  ///< by id in the database
};

}  // namespace

std::unique_ptr<LogFile> open_sqlite_bag(const std::filesystem::path& path) {
  return std::make_unique<SqliteBag>(path);
}

}  // namespace dynains
