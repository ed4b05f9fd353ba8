#include "sqlite_bag.hpp"

#include <sqlite3.h>

#include <cctype>
#include <map>
#include <string>
#include <utility>

#include "../failure.hpp"
#include "../input_file.hpp"

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

std::string row_of(std::int64_t row) { return "row " + std::to_string(row) + " of messages: "; }

}  // namespace

void SqliteBag::CloseDatabase::operator()(sqlite3* database) const { sqlite3_close(database); }
void SqliteBag::FinishStatement::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

SqliteBag::SqliteBag(const std::filesystem::path& path) : LogFile(path) {
  open_input(path);  // for its errors
  sqlite3* database = nullptr;
  const int result = sqlite3_open_v2(uri_of(path).c_str(), &database,
                                     SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
  database_.reset(database);
  if (result != SQLITE_OK) fail(path, std::string("cannot be opened: ") + sqlite3_errstr(result));
  read_topics();
  read_messages();
  select_message_ = prepare("SELECT data FROM messages WHERE id = ?");
  finish_index();
}

void SqliteBag::read_topics() {
  const Statement topics = prepare("SELECT id, name, type, serialization_format FROM topics");
  while (step(topics.get())) {
    LogTopic topic;
    topic.name = text_of(topics.get(), 1);
    topic.type = plain_type(text_of(topics.get(), 2));
    topic.encoding =
        text_of(topics.get(), 3) == "cdr" ? MessageEncoding::kCdr : MessageEncoding::kOther;
    topic_of_[sqlite3_column_int64(topics.get(), 0)] = add_topic(topic);
  }
}

void SqliteBag::read_messages() {
  const Statement messages = prepare("SELECT id, topic_id, timestamp FROM messages ORDER BY id");
  while (step(messages.get())) {
    const std::int64_t row = sqlite3_column_int64(messages.get(), 0);
    const auto topic = topic_of_.find(sqlite3_column_int64(messages.get(), 1));
    if (topic == topic_of_.end()) fail(path_, row_of(row) + "expected the id of a topic");
    messages_.push_back({static_cast<std::uint64_t>(sqlite3_column_int64(messages.get(), 2)),
                         static_cast<std::uint64_t>(row), 0, topic->second, 0});
  }
}

void SqliteBag::read(const LogMessage& message, std::vector<std::uint8_t>& bytes) {
  const auto row = static_cast<std::int64_t>(message.block);
  sqlite3_stmt* const statement = select_message_.get();
  sqlite3_reset(statement);
  sqlite3_bind_int64(statement, 1, row);
  if (!step(statement)) fail(path_, row_of(row) + "expected a message");
  const auto* const data = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement, 0));
  bytes.assign(data, data + sqlite3_column_bytes(statement, 0));
}

SqliteBag::Statement SqliteBag::prepare(const char* sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql, -1, &statement, nullptr) != SQLITE_OK) {
    fail(path_, std::string("expected the tables of rosbag2: ") + sqlite3_errmsg(database_.get()));
  }
  return Statement(statement);
}

bool SqliteBag::step(sqlite3_stmt* statement) {
  const int result = sqlite3_step(statement);
  if (result == SQLITE_ROW) return true;
  if (result != SQLITE_DONE) {
    fail(path_, std::string("cannot be read: ") + sqlite3_errmsg(database_.get()));
  }
  return false;
}

}  // namespace dynains
