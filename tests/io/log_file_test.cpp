#include "io/logs/log_file.hpp"

#include "db3_writer.hpp"
#include "io/logs/decompress.hpp"
#include "io/logs/log_copy.hpp"
#include "log_writer.hpp"
#include "support/catch.hpp"
#if defined(DYNAINS_HAS_ZSTD)
#include <zstd.h>
#endif

namespace dynains {

using namespace test;

namespace {

const std::vector<LogChannel> kChannels = {kClouds, {"/chatter", "std_msgs/msg/String"}};

/// Seven messages, with some times out of order.
std::vector<WrittenMessage> seven_messages() {
  std::vector<WrittenMessage> messages;
  for (const std::uint64_t time : {10, 20, 40, 30, 50, 60, 70}) {
    messages.push_back(
        {static_cast<std::uint16_t>(time / 10 % 2), time, "message " + std::to_string(time)});
  }
  return messages;
}

const std::string kAllMessages =
    "10 /chatter message 10\n20 /points message 20\n30 /chatter message 30\n"
    "40 /points message 40\n50 /chatter message 50\n60 /points message 60\n"
    "70 /chatter message 70\n";

/// Times and contents of all messages.
std::string contents(LogFile& log) {
  std::string all;
  std::vector<std::uint8_t> bytes;
  for (const LogMessage& message : log.messages()) {
    log.read(message, bytes);
    all += std::to_string(message.time) + ' ' + log.topics()[message.topic].name + ' ' +
           std::string(bytes.begin(), bytes.end()) + '\n';
  }
  return all;
}

std::string read_error(const fs::path& path) {
  return message_of<IoError>([&] { contents(*open_log(path)); });
}

void check_messages(LogFile& log) {
  CHECK(contents(log) == kAllMessages);
  REQUIRE(log.topics().size() == 2);
  CHECK(log.topics()[0].type == "sensor_msgs/PointCloud2");
  CHECK(log.topics()[0].message_count == 3);
  CHECK_FALSE(log.early_end());
}

std::string mcap(const McapParts& parts = {}) {
  return mcap_file(kChannels, seven_messages(), parts);
}
std::string bag(const BagParts& parts = {}) {
  return bag_file({{"/points", "sensor_msgs/PointCloud2"}, {"/chatter", "std_msgs/String"}},
                  seven_messages(), parts);
}

/// Whether this build decompresses `method`.
bool has(const std::string& method) {
  std::vector<std::uint8_t> output;
  return decompress(method, {}, 1, output).find("this build has no") == std::string::npos;
}

}  // namespace

TEST_CASE("Every kind of MCAP file gives the same messages, by time") {
  const TemporaryFolder folder;
  for (const std::string compression : {"", "lz4", "zstd"}) {
    if (!compression.empty() && !has(compression)) continue;
    for (const int choice : {0, 1, 2, 3, 4, 5, 6, 7}) {
      CAPTURE(compression, choice);
      McapParts parts;
      parts.chunks = (choice & 1) != 0;
      parts.message_index = (choice & 2) != 0;
      parts.summary = (choice & 4) != 0;
      parts.compression = compression;
      write_text(folder / "log.mcap", mcap(parts));
      check_messages(*open_log(folder / "log.mcap"));
    }
  }
}

TEST_CASE("Every kind of bag gives the same messages, by time") {
  const TemporaryFolder folder;
  for (const bool index : {true, false}) {
    for (const std::string compression : {"none", "lz4"}) {
      if (compression != "none" && !has(compression)) continue;
      CAPTURE(index, compression);
      write_text(folder / "log.bag", bag({index, true, compression}));
      check_messages(*open_log(folder / "log.bag"));
    }
  }
  // A bag that was not closed by its recorder.
  write_text(folder / "log.bag", bag({true, false, "none"}));
  const auto log = open_log(folder / "log.bag");
  CHECK(contents(*log) == kAllMessages);
  REQUIRE(log->early_end());
  CHECK_THAT(*log->early_end(),
             ContainsSubstring("log.bag: byte ") && ContainsSubstring("the log ends early"));
}

TEST_CASE("A database of rosbag2 gives its messages, by time") {
  const TemporaryFolder folder;
  const fs::path path = folder / "log #1?.db3";
#if defined(DYNAINS_HAS_SQLITE3)
  write_db3(path, kChannels, seven_messages());
  const std::size_t entries = count_entries(folder.path());
  check_messages(*open_log(path));
  CHECK(count_entries(folder.path()) == entries);

  std::vector<WrittenMessage> large = seven_messages();
  for (WrittenMessage& message : large) message.data.append(20000, 'x');
  fs::remove(path);
  write_db3(path, kChannels, large);
  const std::string whole = read_text(path);
  for (const double share : {0.3, 0.6, 0.9, 0.99}) {
    write_text(
        path, whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
    const auto cut = open_log(path);
    const std::string all = contents(*cut);
    CHECK(cut->messages().size() < 7);
    CHECK(all.empty() == (share < 0.5));
    REQUIRE(cut->early_end());
    CHECK_THAT(*cut->early_end(),
               StartsWith(path.string() + ": ") && ContainsSubstring("the log ends early"));
  }

  write_text(path, "no database");
  CHECK_THAT(read_error(path), StartsWith(path.string() + ": expected the tables of rosbag2"));
  fs::remove(path);
  write_db3(path, {}, {{1, 10, "message"}});
  CHECK(read_error(path) == path.string() + ": row 1 of messages: expected the id of a topic");
#else
  write_text(path, "");
  CHECK_THAT(read_error(path), ContainsSubstring("libsqlite3-dev"));
#endif
}

#if defined(DYNAINS_HAS_SQLITE3)
TEST_CASE("A database with a journal is refused, and nothing is written beside it") {
  const TemporaryFolder folder;
  const TemporaryFolder recorder;
  const fs::path path = recorder / "log.db3";
  write_db3(path, kChannels, seven_messages());
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &database) == SQLITE_OK);
  execute(database, "PRAGMA journal_mode = WAL; DELETE FROM messages WHERE id = 7");
  fs::copy(recorder.path(), folder / "killed", fs::copy_options::recursive);
  const std::string killed = folder / "killed" / "log.db3";
  const std::size_t entries = count_entries(folder / "killed");
  CHECK(read_error(killed) == killed +
                                  ": is incomplete without log.db3-wal, which its recorder left; "
                                  "join them: sqlite3 FILE 'PRAGMA journal_mode = DELETE'");
  CHECK(count_entries(folder / "killed") == entries);
  // What the advice does.
  execute(killed, "PRAGMA journal_mode = DELETE");
  CHECK(open_log(killed)->messages().size() == 6);
  CHECK(count_entries(folder / "killed") == 1);

  // A recorder that ended leaves a database of this mode, or an empty journal.
  execute(database, "PRAGMA wal_checkpoint(TRUNCATE)");
  fs::copy(recorder.path(), folder / "ended", fs::copy_options::recursive);
  fs::permissions(folder / "ended", fs::perms::owner_read | fs::perms::owner_exec);
  CHECK(open_log(folder / "ended" / "log.db3")->messages().size() == 6);
  fs::permissions(folder / "ended", fs::perms::owner_all);
  sqlite3_close(database);
}

TEST_CASE("No SQL of a database runs, and tables are real ones") {
  const TemporaryFolder folder;
  const fs::path path = folder / "log.db3";
  const std::string topics =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format "
      "TEXT); INSERT INTO topics VALUES(0, '/points', 'sensor_msgs/msg/PointCloud2', 'cdr');";
  const std::string endless =
      " AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS id, 0 AS "
      "topic_id, i AS timestamp, x'00' AS data FROM n;";
  const std::string columns = "(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, ";
  const std::string message = "INSERT INTO messages(topic_id, timestamp";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {topics + "CREATE VIEW messages" + endless, "messages is no table"},
      {"CREATE VIEW topics AS SELECT 0 AS id, 'a' AS name, 'b' AS type, 'cdr' AS "
       "serialization_format; CREATE TABLE messages" +
           columns + "data BLOB);",
       "topics is no table"},
      {topics + "CREATE TABLE messages" + columns + "data BLOB AS (zeroblob(1000000000)));" +
           message + ") VALUES(0, 1);",
       "column data of messages is computed"},
      {topics + "CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER, data "
                "BLOB);",
       "id is no primary key of messages"},
  };
  for (const auto& [sql, expected] : cases) {
    fs::remove(path);
    execute(path, sql);
    CHECK_THAT(read_error(path), StartsWith(path.string() + ": expected the tables of rosbag2") &&
                                     ContainsSubstring(expected));
  }
}

TEST_CASE("A database whose pages are linked many times is refused in time") {
  const TemporaryFolder folder;
  const fs::path path = folder / "log.db3";
  std::vector<WrittenMessage> messages;
  for (std::uint64_t i = 0; i < 3000; ++i) messages.push_back({0, i, std::string(100, 'x')});
  write_db3(path, kChannels, messages);
  std::string bytes = read_text(path);
  constexpr std::size_t kPage = 4096;
  constexpr char kInner = 5;  // kind of a page of a table with children
  const auto number = [&](std::size_t at, std::size_t size) {
    std::size_t value = 0;
    for (std::size_t i = at; i < at + size; ++i) {
      value = value << 8U | static_cast<unsigned char>(bytes[i]);
    }
    return value;
  };
  const auto put = [&](std::size_t at, std::size_t size, std::size_t value) {
    for (std::size_t i = 0; i < size; ++i) {
      bytes[at + i] = static_cast<char>(value >> (8 * (size - 1 - i)) & 0xFFU);
    }
  };
  // The root of messages gets four further levels of pages below it, of which each has the next
  // one a hundred times as its child.
  constexpr std::size_t kLevels = 4;
  constexpr std::size_t kCells = 100;
  const std::size_t pages = bytes.size() / kPage;
  std::size_t leaf = 0;
  for (std::size_t page = kPage; page < pages * kPage; page += kPage) {
    if (bytes[page] != kInner) continue;
    leaf = number(page + 8, 4);
    for (std::size_t cell = 0; cell < number(page + 3, 2); ++cell) {
      put(page + number(page + 12 + 2 * cell, 2), 4, pages + 1);
    }
  }
  REQUIRE(leaf > 0);
  bytes.resize(bytes.size() + kLevels * kPage);
  for (std::size_t level = 0; level < kLevels; ++level) {
    const std::size_t page = (pages + level) * kPage;
    const std::size_t child = level + 1 == kLevels ? leaf : pages + level + 2;
    bytes[page] = kInner;
    put(page + 3, 2, kCells);
    put(page + 5, 2, kPage - 5 * kCells);
    put(page + 8, 4, child);
    for (std::size_t cell = 0; cell < kCells; ++cell) {
      const std::size_t at = kPage - 5 * (cell + 1);
      put(page + 12 + 2 * cell, 2, at);
      put(page + at, 4, child);
      put(page + at + 4, 1, cell + 1);
    }
  }
  put(28, 4, pages + kLevels);
  write_text(path, bytes);
  CHECK(read_error(path) == path.string() + ": has more rows than its size allows");
}
#endif

#if defined(DYNAINS_HAS_ZSTD)
namespace {

std::string zstd(const std::string& bytes) {
  std::string result(ZSTD_compressBound(bytes.size()), '\0');
  result.resize(ZSTD_compress(result.data(), result.size(), bytes.data(), bytes.size(), 3));
  return result;
}

/// A chunk of MCAP with an index of `messages`.
std::string zstd_chunk(const std::string& records, const std::string& index) {
  return mcap_chunk_record(records, "zstd", zstd(records)) + index;
}

}  // namespace

TEST_CASE("A small file of MCAP takes little memory, even if its chunks unpack to much") {
  const TemporaryFolder folder;
  const fs::path path = folder / "log.mcap";
  std::string empty;
  for (int i = 0; i < 300000; ++i) empty += mcap_message({0, 1, ""});
  write_text(path, mcap_of(mcap_definitions(kChannels) + zstd_chunk(empty, "")));
  REQUIRE(fs::file_size(path) < 100000);
  CHECK_THAT(read_error(path), StartsWith(path.string() + ": byte ") &&
                                   ContainsSubstring("expected at most one record for each byte"));

  const std::string zeros(std::size_t{40} << 20U, '\0');
  write_text(path, mcap_of(mcap_definitions(kChannels) + zstd_chunk(zeros, "")));
  CHECK_THAT(read_error(path), ContainsSubstring("expected a chunk of at most 16777216 bytes"));
}

TEST_CASE("A message that is packed by itself unpacks to as much as a chunk may") {
  const TemporaryFolder folder;
  for (const std::size_t size : {std::size_t{15} << 20U, std::size_t{40} << 20U}) {
    write_text(folder / "log.mcap",
               mcap_file({kClouds}, {{0, 1, zstd(std::string(size, '\0'))}}, {}));
    const auto log = open_log(folder / "log.mcap");
    const auto copy = [&] {
      copy_log(*log, folder / "copy.mcap",
               [](const LogMessage&, const SerialisedMessage&) { return std::nullopt; });
    };
    if (size < std::size_t{16} << 20U) {
      copy();
      CHECK(contents(*open_log(folder / "copy.mcap")).size() > size);
    } else {
      CHECK_THAT(message_of<IoError>(copy),
                 StartsWith((folder / "log.mcap").string()) &&
                     ContainsSubstring("expected a frame of zstd of at most 16777216 bytes"));
    }
  }
}

TEST_CASE("Chunks whose messages alternate in time are unpacked once, if they are few") {
  const TemporaryFolder folder;
  const fs::path path = folder / "log.mcap";
  const std::string skipped = mcap_record(0x90, std::string(std::size_t{15} << 20U, '\0'));
  const auto write_chunks = [&](std::uint64_t count, std::uint64_t messages) {
    std::string chunks;
    for (std::uint64_t chunk = 0; chunk < count; ++chunk) {
      std::string records = skipped;
      std::string entries;
      for (std::uint64_t i = 0; i < messages; ++i) {
        entries += packed(count * i + chunk, std::uint64_t{records.size()});
        records += mcap_message({0, count * i + chunk, "m"});
      }
      chunks += zstd_chunk(records, mcap_record(7, std::string(2, '\0') + counted(entries)));
    }
    write_text(path, mcap_of(mcap_definitions(kChannels) + chunks));
  };
  // Unpacked for each of their messages, two chunks would exceed the work that a file may take.
  write_chunks(2, 3000);
  std::string expected;
  for (int i = 0; i < 6000; ++i) expected += std::to_string(i) + " /points m\n";
  CHECK(contents(*open_log(path)) == expected);

  write_chunks(20, 10);
  CHECK_THAT(message_of<IoError>([&] { contents(*open_log(path)); }),
             StartsWith(path.string()) && ContainsSubstring("found messages that alternate"));
}
#endif

TEST_CASE("A folder of rosbag2 may have several files") {
  const TemporaryFolder folder;
  write_text(folder / "metadata.yaml", "");
  CHECK_FALSE(is_log(folder.path()));
  const std::vector<WrittenMessage> messages = seven_messages();
  const std::vector<LogChannel> swapped = {kChannels[1], kChannels[0]};
  std::vector<WrittenMessage> rest(messages.begin() + 4, messages.end());
  for (WrittenMessage& message : rest) message.channel ^= 1U;
  write_text(folder / "log_0.mcap",
             mcap_file(kChannels, {messages.begin(), messages.begin() + 4}, {}));
  write_text(folder / "log_1.mcap", mcap_file(swapped, rest, {}));
  CHECK(is_log(folder.path()));
  const auto log = open_log(folder.path());
  check_messages(*log);
  CHECK(log->files() == std::vector<fs::path>{folder / "metadata.yaml", folder / "log_0.mcap",
                                              folder / "log_1.mcap"});
}

TEST_CASE("A log that is cut off anywhere gives the messages before that byte") {
  const TemporaryFolder folder;
  const auto check_cuts = [&](const std::string& name, const std::string& whole, std::size_t first,
                              std::size_t last) {
    std::size_t before = 0;
    for (std::size_t size = first; size < last; size += 5) {
      CAPTURE(name, size);
      write_text(folder / name, whole.substr(0, size));
      const auto log = open_log(folder / name);
      const std::string all = contents(*log);
      const std::size_t count = log->messages().size();
      // A damaged index of a chunk loses no message.
      if (count < before) FAIL(count << " messages after " << before);
      if (!log->early_end()) FAIL("no early end");
      before = count;
    }
    CHECK(before == 7);
  };
  for (const bool index : {true, false}) {
    McapParts parts;
    parts.message_index = index;
    const std::string whole = mcap(parts);
    check_cuts("cut.mcap", whole, 8, whole.size() - 28);
    const std::string bag_of_ros = bag({index, true, "none"});
    check_cuts("cut.bag", bag_of_ros, 13, bag_of_ros.size());
  }
  // Zeros at the end, as some file systems leave after a crash.
  write_text(folder / "cut.mcap", mcap().substr(0, 900) + std::string(5000, '\0'));
  CHECK(open_log(folder / "cut.mcap")->early_end());
}

TEST_CASE("Damaged logs give path, byte and expectation") {
  const TemporaryFolder folder;
  struct Case {
    std::string name;
    std::string bytes;
    std::string expected;
  };
  McapParts checksum;
  checksum.checksum = 12345;
  McapParts unknown;
  unknown.compression = "xz";
  // A chunk with an uncompressed size of 2^40 bytes is refused before any memory is allocated.
  std::string large = mcap();
  const std::size_t chunk = large.find('\x06', 20);
  large[chunk + 9 + 16 + 5] = '\x01';
  std::string longer = mcap();
  longer[chunk + 9 + 16 + 8 + 4 + 4 + 6] = '\x01';  // its compressed size
  std::string no_op = bag();
  no_op[no_op.find("op=")] = 'x';
  std::string encrypted = bag();
  encrypted.replace(encrypted.find("conn_count"), 10, "encryptor=");
  const std::vector<Case> cases = {
      {"log.mcap", "", ": byte 0: expected the magic bytes of MCAP, version 0"},
      {"log.mcap", "no log at all", ": byte 0: expected the magic bytes of MCAP, version 0"},
      {"log.mcap", mcap(checksum), ": expected the checksum of the chunk, found that of other"},
      {"log.mcap", mcap(unknown), ": expected lz4, zstd, bz2 or none, found \"xz\""},
      {"log.mcap", large, ": expected a chunk of at most 16777216 bytes, found the size 1099"},
      {"log.mcap", longer, " bytes, found the size 281474976"},
      {"log.mcap", mcap_file({kChannels[0]}, seven_messages(), {}),
       ": expected a message of a known channel, found channel 1"},
      {"log.bag", "", ": byte 0: expected \"#ROSBAG V2.0\""},
      {"log.bag", "#ROSBAG V1.2\n", ": byte 0: expected \"#ROSBAG V2.0\""},
      {"log.bag", bag({true, true, "xz"}), ": expected lz4, zstd, bz2 or none, found \"xz\""},
      {"log.bag", no_op, ": expected the header field op"},
      {"log.bag", encrypted, ": expected a bag without encryption"},
      {"log.txt", "", ": expected a log with the name *.mcap, *.db3 or *.bag"},
  };
  for (const Case& one : cases) {
    write_text(folder / one.name, one.bytes);
    CHECK_THAT(read_error(folder / one.name),
               StartsWith((folder / one.name).string() + ": ") && ContainsSubstring(one.expected));
  }
  CHECK_THAT(read_error(folder / "none.mcap"), ContainsSubstring("No such file"));
}

TEST_CASE("Compressed blocks are decompressed to the announced size, and to no other") {
  std::vector<std::uint8_t> output;
  const auto decompressed = [&](const std::string& method, const std::string& bytes,
                                std::uint64_t size) {
    return decompress(method, {bytes.begin(), bytes.end()}, size, output);
  };
  CHECK(decompressed("bz9", "", 1) == "expected lz4, zstd, bz2 or none, found \"bz9\"");
  const std::string text = "to be or not to be";
  const std::string bz2(
      "\x42\x5a\x68\x39\x31\x41\x59\x26\x53\x59\xd3\x46\x11\xd3\x00\x00"
      "\x08\x11\x80\x40\x00\x12\x01\x94\x00\x20\x00\x21\x29\xa3\x10\x86"
      "\x01\x91\xd6\x41\x68\xad\x27\x78\xbb\x92\x29\xc2\x84\x86\x9a\x30"
      "\x8e\x98",
      50);
  for (const std::string method : {"lz4", "zstd", "bz2"}) {
    CAPTURE(method);
    const std::string bytes = method == "bz2" ? bz2 : compressed(method, text);
    if (!has(method)) {
      CHECK(decompressed(method, bytes, text.size()) ==
            "this build has no " + method + " (Debian: lib" + method + "-dev)");
      continue;
    }
    CHECK(decompressed(method, bytes, text.size()).empty());
    CHECK(std::string(output.begin(), output.end()) == text);
    CHECK_FALSE(decompressed(method, bytes, text.size() - 1).empty());
    CHECK_FALSE(decompressed(method, bytes, std::uint64_t{1} << 40U).empty());
    CHECK(output.capacity() <= max_decompressed(bytes.size()));
    CHECK_FALSE(decompressed(method, bytes.substr(0, bytes.size() - 1), text.size()).empty());
    CHECK_FALSE(decompressed(method, "12345678", 100).empty());
    CHECK_FALSE(decompressed(method, "", 100).empty());
  }
  CHECK(crc32(reinterpret_cast<const std::uint8_t*>("123456789"), 9) ==
        (has_crc32() ? 0xCBF43926U : 0U));
  CHECK(crc32(nullptr, 0) == 0);
}

}  // namespace dynains
