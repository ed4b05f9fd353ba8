#include "sqlite_bag.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "../failure.hpp"
#include "../input_file.hpp"
#include "dynains/io/atomic_file.hpp"
#include "message_editor.hpp"
#include "raw_file.hpp"

namespace dynains {
namespace {

std::string text_of(sqlite3_stmt* statement, int column) {
  const unsigned char* const text = sqlite3_column_text(statement, column);
  return text == nullptr ? std::string() : reinterpret_cast<const char*>(text);
}

/// Without a journal beside it, the database is opened such that SQLite writes no file.
std::string uri_of(const std::filesystem::path& path) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '/' || c == '.' || c == '-' || c == '_') {
      uri += c;
    } else {
      uri = uri + '%' + kDigits[byte / 16] + kDigits[byte % 16];
    }
  }
  const bool has_journal = is_there(path.string() + "-wal") || is_there(path.string() + "-journal");
  return uri + (has_journal ? "?mode=ro" : "?mode=ro&immutable=1");
}

/// Whether the file has fewer bytes than the pages that its header counts.
bool is_shorter_than_announced(const std::filesystem::path& path) {
  constexpr std::uint64_t kHeader = 100;  // bytes
  RawFile file(path);
  if (file.size() < kHeader) return false;
  const auto header = file.read(0, kHeader, "a header");
  const auto big_endian = [&](std::size_t at, std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t i = at; i < at + size; ++i) value = value << 8U | header[i];
    return value;
  };
  const std::uint64_t page_size = big_endian(16, 2);
  const std::uint64_t pages = big_endian(28, 4);
  return pages * (page_size == 1 ? 65536 : page_size) > file.size();
}

/// Work of the database in virtual steps. Reading a row takes about ten.
constexpr int kStepsOfProgress = 100000;

/// Called after each kStepsOfProgress; another number than 0 ends the query.
int spend(void* budget) { return --*static_cast<std::int64_t*>(budget) < 0 ? 1 : 0; }

std::string row_of(std::int64_t row) { return "row " + std::to_string(row) + " of messages: "; }

constexpr const char* kUnreadable = "cannot be read";
constexpr const char* kNotWritable = "cannot be written";

/// SQL that is stored in the database does not run.
void refuse_programs(sqlite3* database) {
  sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
}

void execute(const SqliteDatabase& database, const char* sql, const std::filesystem::path& path) {
  if (sqlite3_exec(database.get(), sql, nullptr, nullptr, nullptr) == SQLITE_OK) return;
  fail_by_database(database, path, kNotWritable);
}

}  // namespace

SqliteBag::SqliteBag(const std::filesystem::path& path) : LogFile(path) {
  const bool is_cut_off = is_shorter_than_announced(path);
  database_ =
      open_database(uri_of(path), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, path, "cannot be opened");
  limit(RawFile(path).size());
  // Lets SQLite read a database that is shorter than its header says. Nothing is written.
  step(prepare("PRAGMA writable_schema = ON").get());
  check_table("topics");
  check_table("messages");
  select_message_ = prepare("SELECT data FROM messages WHERE id = ?");
  read_topics();
  read_messages();
  if (is_cut_off && !early_end_) early_end_ = path.string() + ": the log ends early";
  if (early_end_) drop_unreadable();
  finish_index();
}

/// No SQL of the file runs, and nothing is larger or takes longer than a file of `size` bytes can
/// need.
void SqliteBag::limit(std::uint64_t size) {
  constexpr std::uint64_t kLeast = 1U << 20U;
  constexpr std::uint64_t kMost = 1U << 30U;
  sqlite3* const database = database_.get();
  refuse_programs(database);
  sqlite3_limit(database, SQLITE_LIMIT_LENGTH, static_cast<int>(std::clamp(size, kLeast, kMost)));
  most_rows_ = size;
  budget_ = static_cast<std::int64_t>(100 + size / 1000);
  sqlite3_progress_handler(database, kStepsOfProgress, spend, &budget_);
}

/// Throws unless `table` is a table with stored columns and, if it has messages, found by id.
void SqliteBag::check_table(const std::string& table) {
  const SqliteStatement kind = prepare(
      ("SELECT sql FROM sqlite_master WHERE type = 'table' AND name = '" + table + "'").c_str());
  const bool is_table = step(kind.get());
  constexpr std::string_view kVirtual = "CREATE VIRTUAL";
  const std::string sql = is_table ? text_of(kind.get(), 0) : std::string();
  if (!is_table || sql.compare(0, kVirtual.size(), kVirtual) == 0) {
    fail(path_, "expected the tables of rosbag2: " + table + " is no table");
  }
  const SqliteStatement columns = prepare(("PRAGMA table_xinfo(" + table + ")").c_str());
  bool has_key = false;
  while (step(columns.get())) {
    const std::string column = text_of(columns.get(), 1);
    has_key = has_key || (column == "id" && sqlite3_column_int(columns.get(), 5) == 1);
    if (sqlite3_column_int(columns.get(), 6) == 0) continue;
    fail(path_,
         "expected the tables of rosbag2: column " + column + " of " + table + " is computed");
  }
  if (table == "messages" && !has_key) {
    fail(path_, "expected the tables of rosbag2: id is no primary key of messages");
  }
}

/// Counts a row that was read. A file with loops or links among its pages has rows without end.
void SqliteBag::count_row() {
  if (most_rows_-- == 0) fail(path_, "has more rows than its size allows");
}

void SqliteBag::read_topics() {
  const SqliteStatement topics = prepare("SELECT id, name, type, serialization_format FROM topics");
  while (step(topics.get())) {
    count_row();
    LogTopic topic;
    topic.name = text_of(topics.get(), 1);
    topic.type = plain_type(text_of(topics.get(), 2));
    topic.encoding =
        text_of(topics.get(), 3) == "cdr" ? MessageEncoding::kCdr : MessageEncoding::kOther;
    topic_of_[sqlite3_column_int64(topics.get(), 0)] = add_topic(topic);
  }
}

void SqliteBag::read_messages() {
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
  if (result != SQLITE_CORRUPT) fail_by_database(database_, path_, kUnreadable);
  early_end_ = path_.string() + ": " + row_of(row) + "the log ends early behind it";
}

/// Rows may be there whose data are missing.
void SqliteBag::drop_unreadable() {
  const auto is_unreadable = [this](const LogMessage& message) {
    return select(message) != SQLITE_ROW;
  };
  messages_.erase(std::remove_if(messages_.begin(), messages_.end(), is_unreadable),
                  messages_.end());
}

/// Result of the search for the data of a message.
int SqliteBag::select(const LogMessage& message) {
  budget_ = std::max<std::int64_t>(budget_, 100);
  sqlite3_reset(select_message_.get());
  sqlite3_bind_int64(select_message_.get(), 1, static_cast<std::int64_t>(message.block));
  return sqlite3_step(select_message_.get());
}

void SqliteBag::read(const LogMessage& message, std::vector<std::uint8_t>& bytes) {
  const int result = select(message);
  if (result == SQLITE_DONE) {
    fail(path_, row_of(static_cast<std::int64_t>(message.block)) + "expected a message");
  }
  if (result != SQLITE_ROW) fail_by_database(database_, path_, kUnreadable);
  sqlite3_stmt* const statement = select_message_.get();
  const auto* const data = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement, 0));
  bytes.assign(data, data + sqlite3_column_bytes(statement, 0));
}

SqliteStatement SqliteBag::prepare(const char* sql) {
  return prepare_statement(database_, sql, path_, "expected the tables of rosbag2");
}

bool SqliteBag::step(sqlite3_stmt* statement) {
  const int result = sqlite3_step(statement);
  if (result == SQLITE_ROW) return true;
  if (result != SQLITE_DONE) fail_by_database(database_, path_, kUnreadable);
  return false;
}

/// Copies all pages, so that every table stays as it is, and replaces messages afterwards.
void SqliteBag::copy(const std::filesystem::path& target, MessageEditor& editor) {
  if (early_end_) fail(path_, "ends early; expected a whole database for a copy");
  AtomicFile file(target);
  SqliteDatabase copy =
      open_database(file.temporary_path(), SQLITE_OPEN_READWRITE, target, kNotWritable);
  refuse_programs(copy.get());
  copy_pages(copy, target, editor);
  // The file takes its name when it is whole: a journal would have no use. What leaves a message
  // is overwritten by zeros.
  for (const char* const sql : {"PRAGMA journal_mode = OFF", "PRAGMA synchronous = OFF",
                                "PRAGMA secure_delete = ON", "BEGIN"}) {
    execute(copy, sql, target);
  }
  SqliteStatement update =
      prepare_statement(copy, "UPDATE messages SET data = ? WHERE id = ?", target, kNotWritable);
  std::vector<std::uint8_t> bytes;
  for (const LogMessage& message : messages_) {
    if (!editor.changes(message)) continue;
    read(message, bytes);
    const std::string edited = editor.edited(message, bytes);
    sqlite3_reset(update.get());
    sqlite3_bind_blob64(update.get(), 1, edited.data(), edited.size(), SQLITE_STATIC);
    sqlite3_bind_int64(update.get(), 2, static_cast<std::int64_t>(message.block));
    if (sqlite3_step(update.get()) != SQLITE_DONE) fail_by_database(copy, target, kNotWritable);
    sqlite3_clear_bindings(update.get());
  }
  update.reset();
  execute(copy, "COMMIT", target);
  if (sqlite3_close(copy.release()) != SQLITE_OK) fail(target, "cannot be written to the end");
  file.commit();
}

void SqliteBag::copy_pages(const SqliteDatabase& copy, const std::filesystem::path& target,
                           MessageEditor& editor) {
  constexpr int kPages = 4096;
  sqlite3_backup* const backup = sqlite3_backup_init(copy.get(), "main", database_.get(), "main");
  if (backup == nullptr) fail_by_database(copy, target, kNotWritable);
  int result = SQLITE_OK;
  const auto finish = [&] { return sqlite3_backup_finish(backup); };
  try {
    while (result == SQLITE_OK) {
      editor.pause();
      budget_ = std::max<std::int64_t>(budget_, 100);
      result = sqlite3_backup_step(backup, kPages);
    }
  } catch (...) {
    finish();
    throw;
  }
  if (finish() != SQLITE_OK || result != SQLITE_DONE) fail_by_database(copy, target, kNotWritable);
}

}  // namespace dynains
