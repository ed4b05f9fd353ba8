// Copies of logs with other clouds, by their readers and byte by byte.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "db3_writer.hpp"
#include "files.hpp"
#include "io/log/cloud_edit.hpp"
#include "io/log/compress.hpp"
#include "io/log/decompress.hpp"
#include "io/log/log_file.hpp"
#include "io/log/message_editor.hpp"
#include "log_writer.hpp"
#include "ros_writer.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;
namespace fs = std::filesystem;

namespace {

SerialisedMessage serialised(const std::string& bytes, MessageEncoding encoding) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), encoding, "place"};
}

const std::string kCloud = "sensor_msgs/PointCloud2";

using Values = std::vector<std::uint8_t>;

std::string without(const std::string& type, const SerialisedMessage& cloud, const Values& keep) {
  return without_points(type, cloud, keep);
}

std::string marked_with(const std::string& type, const SerialisedMessage& cloud,
                        const Values& labels) {
  return with_labels(type, cloud, labels);
}

/// A cloud of `rows` rows, each of two points and `padding` bytes, with a field of another type.
std::string rows_of_points(MessageEncoding encoding, std::uint32_t rows, std::size_t padding) {
  FieldWriter out(encoding);
  out.header(1.5, "lidar").number(rows).number(std::uint32_t{2}).number(std::uint32_t{4});
  for (const CloudField& field : {kXyz[0], kXyz[1], kXyz[2], CloudField{"rgb", 12, 4}}) {
    out.string(field.name).number(field.offset).number(field.type).number(std::uint32_t{1});
  }
  ByteWriter data;
  for (std::uint32_t i = 0; i < 2 * rows; ++i) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) data.number(static_cast<float>(10 * i + axis));
    data.number(static_cast<std::uint16_t>(1000 + i));
    if (i % 2 == 1) data.raw(std::string(padding, 'p'));
  }
  out.number(std::uint8_t{0}).number(std::uint32_t{14});
  out.number(static_cast<std::uint32_t>(28 + padding));
  out.number(static_cast<std::uint32_t>(data.size())).raw(data.text()).number(std::uint8_t{1});
  return out.text();
}

/// A cloud of one row that has only the points with these numbers.
std::string one_row(MessageEncoding encoding, const std::vector<std::uint16_t>& numbers) {
  ByteWriter data;
  for (const std::uint16_t i : numbers) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) data.number(static_cast<float>(10 * i + axis));
    data.number(static_cast<std::uint16_t>(1000 + i));
  }
  std::vector<CloudField> fields = kXyz;
  fields.push_back({"rgb", 12, 4});
  return cloud_message(encoding, 1.5, "lidar", fields, 14, data.text());
}

std::string livox_message(MessageEncoding encoding, const std::vector<std::uint8_t>& points) {
  FieldWriter out(encoding);
  out.header(1.5, "livox").number(std::uint64_t{77});
  out.number(static_cast<std::uint32_t>(points.size()));
  out.number(std::uint8_t{3}).raw("abc").number(static_cast<std::uint32_t>(points.size()));
  for (const std::uint8_t i : points) {
    out.number(std::uint32_t{100U + i});
    for (std::uint32_t axis = 0; axis < 3; ++axis) out.number(static_cast<float>(i + axis));
    out.number(i).number(static_cast<std::uint8_t>(i + 1)).number(static_cast<std::uint8_t>(2));
  }
  return out.text();
}

/// Replaces the messages of one time, and ends the copy at another one.
class TimeEditor final : public MessageEditor {
 public:
  explicit TimeEditor(std::uint64_t replaced, std::uint64_t end = 0)
      : replaced_(replaced), end_(end) {}

  void pause() override {}
  bool changes(const LogMessage& place) override {
    if (end_ != 0 && place.time == end_) throw std::runtime_error("ended");
    return place.time == replaced_;
  }
  std::string edited(const LogMessage&, const std::vector<std::uint8_t>& message) override {
    return "other " + std::string(message.begin(), message.end());
  }

 private:
  std::uint64_t replaced_;
  std::uint64_t end_;
};

using Message = std::pair<std::string, std::string>;  // topic, type and time; bytes

std::vector<Message> messages_of(const fs::path& path) {
  const auto log = open_log(path);
  CHECK_FALSE(log->early_end());
  std::vector<Message> messages;
  std::vector<std::uint8_t> bytes;
  for (const LogMessage& message : log->messages()) {
    log->read(message, bytes);
    const LogTopic& topic = log->topics()[message.topic];
    messages.emplace_back(topic.name + ' ' + topic.type + ' ' + std::to_string(message.time),
                          std::string(bytes.begin(), bytes.end()));
  }
  return messages;
}

const std::vector<LogChannel> kChannels = {{"/points", "sensor_msgs/msg/PointCloud2"},
                                           {"/other", "any/msg/Thing", "json"}};
constexpr std::uint64_t kReplaced = 30;

std::vector<WrittenMessage> five_messages() {
  return {{0, 10, "first"}, {1, 20, "second"}, {0, kReplaced, "third"}, {1, 40, "4"}, {0, 50, "5"}};
}

/// Copies the log, which has five_messages(), and compares all messages.
void check_copy(const fs::path& log, const fs::path& target) {
  TimeEditor editor(kReplaced);
  open_log(log)->copy(target, editor);
  std::vector<Message> expected = messages_of(log);
  REQUIRE(expected.size() == 5);
  expected[2].second = "other " + expected[2].second;
  CHECK(messages_of(target) == expected);
}

}  // namespace

TEST_CASE("A cloud without some points keeps all other bytes, its rows become one") {
  for (const auto encoding : {MessageEncoding::kRos1, MessageEncoding::kCdr}) {
    for (const std::size_t padding : {0, 6}) {
      CAPTURE(padding);
      const std::string cloud = rows_of_points(encoding, 2, padding);
      const auto message = serialised(cloud, encoding);
      CHECK(without(kCloud, message, Values{1, 0, 0, 1}) == one_row(encoding, {0, 3}));
      CHECK(without(kCloud, message, Values(4, 0)) == one_row(encoding, {}));
      CHECK(without(kCloud, message, Values(4, 1)) == one_row(encoding, {0, 1, 2, 3}));
      CHECK_THROWS_WITH(without(kCloud, message, Values(3, 1)),
                        ContainsSubstring("place: expected 3 points, found 4"));
    }
  }
}

TEST_CASE("Bytes behind the points of a cloud stay") {
  const std::string cloud = one_row(MessageEncoding::kCdr, {0, 1}) + std::string(3, 'x');
  const std::string cut = without(kCloud, serialised(cloud, MessageEncoding::kCdr), Values{0, 1});
  CHECK(cut == one_row(MessageEncoding::kCdr, {1}) + std::string(3, 'x'));
}

TEST_CASE("Labels become the last field of a cloud, and all others are as they were") {
  const Values labels = {251, 9, 0, 9};
  for (const auto encoding : {MessageEncoding::kRos1, MessageEncoding::kCdr}) {
    const std::string cloud = rows_of_points(encoding, 2, 6);
    const std::string marked = marked_with(kCloud, serialised(cloud, encoding), labels);
    const auto message = serialised(marked, encoding);
    CHECK(read_cloud_labels(kCloud, message) == std::vector<std::uint32_t>{251, 9, 0, 9});
    const CloudInfo before = inspect_cloud(kCloud, serialised(cloud, encoding));
    const CloudInfo after = inspect_cloud(kCloud, message);
    CHECK(after.time == before.time);
    CHECK(after.frame == before.frame);
    RecordedScan points;
    RecordedScan marked_points;
    read_cloud(kCloud, serialised(cloud, encoding), nullptr, points);
    read_cloud(kCloud, message, nullptr, marked_points);
    CHECK(marked_points.xyzi == points.xyzi);
    // By hand: two rows of two points of 14 + 4 bytes, and the flag of dense clouds behind them.
    for (std::size_t i = 0; i < 4; ++i) {
      const std::string point = marked.substr(marked.size() - 1 - 18 * (4 - i), 18);
      CHECK(point.substr(12, 6) == ByteWriter()
                                       .number(static_cast<std::uint16_t>(1000 + i))
                                       .number(labels[i])
                                       .raw(std::string(3, '\0'))
                                       .text());
    }
    CHECK_THROWS_WITH(marked_with(kCloud, message, labels),
                      ContainsSubstring("place: expected no field \"label\""));
  }
}

TEST_CASE("A message of Livox without some points is as if it never had them") {
  for (const auto encoding : {MessageEncoding::kRos1, MessageEncoding::kCdr}) {
    const std::string all = livox_message(encoding, {0, 1, 2, 3});
    const std::string type = "livox_ros_driver2/CustomMsg";
    const auto with = [&](const Values& keep) {
      return without(type, serialised(all, encoding), keep);
    };
    CHECK(with({1, 1, 1, 1}) == all);
    CHECK(with({0, 1, 0, 1}) == livox_message(encoding, {1, 3}));
    CHECK(with({0, 0, 0, 0}) == livox_message(encoding, {}));
    CHECK_FALSE(can_have_labels(type));
    CHECK_THROWS_AS(marked_with(type, serialised(all, encoding), Values(4, 9)), IoError);
  }
}

TEST_CASE("A block that is compressed is what decompression gives") {
  std::string bytes;
  for (int i = 0; i < 50000; ++i) bytes += static_cast<char>(i * i / 100);
  for (const std::string method : {"lz4", "zstd", "bz2"}) {
    CAPTURE(method);
    std::vector<std::uint8_t> output;
    if (decompress(method, {}, 0, output).find("this build has no") == 0) continue;
    const std::string small = compress(method, bytes);
    CHECK(small.size() < bytes.size());
    CHECK(decompress(method, {small.begin(), small.end()}, bytes.size(), output).empty());
    CHECK(std::equal(bytes.begin(), bytes.end(), output.begin(), output.end(),
                     [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; }));
  }
  CHECK(compress("", bytes) == bytes);
  CHECK_THROWS_AS(compress("gzip", bytes), IoError);
}

TEST_CASE("The copy of an MCAP file has the same messages, with or without chunks and indexes") {
  const TemporaryFolder folder;
  for (const bool chunks : {true, false}) {
    for (const std::string compression : {"", "lz4", "zstd"}) {
      McapParts parts;
      parts.chunks = chunks;
      parts.message_index = compression != "lz4";
      parts.summary = compression.empty();
      parts.compression = compression;
      write_text(folder / "log.mcap", mcap_file(kChannels, five_messages(), parts));
      check_copy(folder / "log.mcap", folder / "copy.mcap");
      // A copy of the copy: all parts that this writer makes are read again.
      check_copy(folder / "copy.mcap", folder / "again.mcap");
      if (!chunks || compression.empty()) continue;
      CHECK_THAT(read_text(folder / "copy.mcap"), ContainsSubstring(compression));
    }
  }
}

TEST_CASE("Attachments, metadata, sequence numbers and publish times of an MCAP file stay") {
  const TemporaryFolder folder;
  std::string file = mcap_file(kChannels, five_messages(), {});
  const auto times = ByteWriter().number(std::uint64_t{5}).number(std::uint64_t{6});
  const std::string attachment = mcap_record(9, ByteWriter()
                                                    .raw(times.text())
                                                    .string("calibration")
                                                    .string("text/plain")
                                                    .number(std::uint64_t{4})
                                                    .raw("data")
                                                    .number(std::uint32_t{0}));
  const std::string metadata = mcap_record(12, ByteWriter().string("robot").string(""));
  const std::string message = mcap_record(5, ByteWriter()
                                                 .number(std::uint16_t{1})
                                                 .number(std::uint32_t{4711})
                                                 .number(std::uint64_t{60})
                                                 .number(std::uint64_t{55})
                                                 .raw("late"));
  const std::size_t data_end = file.find(mcap_record(15, ByteWriter().number(std::uint32_t{0})));
  file.insert(data_end, attachment + message + metadata);
  write_text(folder / "log.mcap", file);
  TimeEditor editor(kReplaced);
  open_log(folder / "log.mcap")->copy(folder / "copy.mcap", editor);
  const std::string copy = read_text(folder / "copy.mcap");
  for (const std::string& record : {attachment, metadata, message}) {
    CHECK_THAT(copy, ContainsSubstring(record));
  }
  const auto index = [&](const std::string& record) {
    return ByteWriter()
        .number(std::uint64_t{copy.find(record)})
        .number(std::uint64_t{record.size()})
        .text();
  };
  CHECK_THAT(copy, ContainsSubstring(mcap_record(10, ByteWriter()
                                                         .raw(index(attachment))
                                                         .raw(times.text())
                                                         .number(std::uint64_t{4})
                                                         .string("calibration")
                                                         .string("text/plain"))));
  CHECK_THAT(copy,
             ContainsSubstring(mcap_record(13, ByteWriter().raw(index(metadata)).string("robot"))));
}

TEST_CASE("The copy of a bag has the same messages") {
  const TemporaryFolder folder;
  for (const std::string compression : {"none", "lz4"}) {
    BagParts parts;
    parts.compression = compression;
    parts.index = compression == "none";
    parts.is_closed = compression == "none";
    write_text(folder / "log.bag", bag_file(kChannels, five_messages(), parts));
    TimeEditor editor(kReplaced);
    const auto log = open_log(folder / "log.bag");
    log->copy(folder / "copy.bag", editor);
    check_copy(folder / "copy.bag", folder / "again.bag");
    std::vector<Message> messages = messages_of(folder / "copy.bag");
    CHECK(messages[0].second == "first");
    CHECK(messages[2].second == "other third");
  }
}

TEST_CASE("A log that ends early is copied up to its end") {
  const TemporaryFolder folder;
  const std::string whole = mcap_file(kChannels, five_messages(), {});
  write_text(folder / "cut.mcap", whole.substr(0, whole.find("third") + 5));
  TimeEditor editor(20);
  open_log(folder / "cut.mcap")->copy(folder / "copy.mcap", editor);
  const std::vector<Message> messages = messages_of(folder / "copy.mcap");
  REQUIRE(messages.size() == 2);
  CHECK(messages[1].second == "other second");
}

TEST_CASE("A copy that ends early leaves nothing, and what was there before stays") {
  const TemporaryFolder folder;
  write_text(folder / "log.mcap", mcap_file(kChannels, five_messages(), {}));
  write_text(folder / "log.bag", bag_file(kChannels, five_messages(), {}));
  write_text(folder / "parts" / "parts_0.mcap", mcap_file(kChannels, five_messages(), {}));
  write_text(folder / "parts" / "metadata.yaml", "relative_file_paths:\n  - parts_0.mcap\n");
  const fs::path out = folder / "out";
  for (const bool is_there : {false, true}) {
    for (const std::string name : {"log.mcap", "log.bag", "parts"}) {
      CAPTURE(name, is_there);
      fs::remove_all(out);
      fs::create_directory(out);
      TimeEditor none(0);
      if (is_there) open_log(folder / name)->copy(out / name, none);
      const std::vector<Message> before =
          is_there ? messages_of(out / name) : std::vector<Message>();
      TimeEditor ends(kReplaced, 40);
      CHECK_THROWS_WITH(open_log(folder / name)->copy(out / name, ends), "ended");
      CHECK(count_entries(out) == (is_there ? 1 : 0));
      if (is_there) CHECK(messages_of(out / name) == before);
    }
  }
}

TEST_CASE("A log of several files is copied with its metadata, and replaced as a whole") {
  const TemporaryFolder folder;
  const std::vector<WrittenMessage> all = five_messages();
  const auto part = [&](std::size_t begin, std::size_t end) {
    const auto at = [&](std::size_t i) { return all.begin() + static_cast<std::ptrdiff_t>(i); };
    return mcap_file(kChannels, {at(begin), at(end)}, {});
  };
  const fs::path log = folder / "drive";
  write_text(log / "drive_0.mcap", part(0, 2));
  write_text(log / "drive_1.mcap", part(2, 5));
  write_text(log / "metadata.yaml",
             "rosbag2_bagfile_information:\n  relative_file_paths:\n    - drive_0.mcap\n"
             "    - drive_1.mcap\n  message_count: 5\n");
  for (int times = 0; times < 2; ++times) {
    check_copy(log, folder / "copy");
    CHECK(count_entries(folder.path()) == 2);
    CHECK(count_entries(folder / "copy") == 3);
    CHECK(read_text(folder / "copy" / "metadata.yaml") == read_text(log / "metadata.yaml"));
  }
}

#if defined(DYNAINS_HAS_SQLITE3)
TEST_CASE("The copy of a database has the same tables and messages, and no trace of what left") {
  const TemporaryFolder folder;
  std::vector<LogChannel> channels = kChannels;
  std::vector<WrittenMessage> messages = five_messages();
  for (const bool has_wal : {false, true}) {
    const fs::path log = folder / (has_wal ? "wal.db3" : "log.db3");
    write_db3(log, channels, messages);
    sqlite3* database = nullptr;
    REQUIRE(sqlite3_open(log.c_str(), &database) == SQLITE_OK);
    if (has_wal) execute(database, "PRAGMA journal_mode = WAL");
    execute(database, "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata TEXT)");
    execute(database, "INSERT INTO metadata VALUES(1, 'of the robot')");
    execute(database, "UPDATE topics SET offered_qos_profiles = '- history: 3'");
    // SQL of the file does not run.
    execute(database,
            "CREATE TRIGGER loud AFTER UPDATE ON messages BEGIN SELECT RAISE(FAIL, 'ran'); END");
    sqlite3_close(database);
    check_copy(log, folder / "copy.db3");
    CHECK(count_entries(folder.path()) == (has_wal ? 3 : 2));
    const std::string copy = read_text(folder / "copy.db3");
    CHECK_THAT(copy, ContainsSubstring("of the robot"));
    CHECK_THAT(copy, ContainsSubstring("- history: 3"));
  }

  // A long message, shortened: its bytes are nowhere in the file.
  const std::string secret(20000, 'S');
  messages[2].data = "begin" + secret;
  write_db3(folder / "long.db3", channels, messages);
  class Shortener final : public MessageEditor {
   public:
    void pause() override {}
    bool changes(const LogMessage& place) override { return place.time == kReplaced; }
    std::string edited(const LogMessage&, const std::vector<std::uint8_t>&) override {
      return "begin";
    }
  } shortener;
  open_log(folder / "long.db3")->copy(folder / "short.db3", shortener);
  CHECK(messages_of(folder / "short.db3")[2].second == "begin");
  CHECK(read_text(folder / "short.db3").find("SSSS") == std::string::npos);

  TimeEditor ends(0, 40);
  CHECK_THROWS_WITH(open_log(folder / "long.db3")->copy(folder / "none.db3", ends), "ended");
  CHECK_FALSE(fs::exists(folder / "none.db3"));
}
#endif
