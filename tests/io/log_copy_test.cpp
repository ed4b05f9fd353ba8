// Copies of logs with other clouds, by their readers and byte by byte.
#include "io/logs/log_copy.hpp"

#include "db3_writer.hpp"
#include "io/logs/log_file.hpp"
#include "log_writer.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

const std::string kCloud = "sensor_msgs/PointCloud2";

using Values = std::vector<std::uint8_t>;

std::string without(const std::string& type, const SerialisedMessage& cloud, const Values& keep) {
  return without_points(type, cloud, keep);
}

std::string marked_with(const std::string& type, const SerialisedMessage& cloud,
                        const Values& labels) {
  return with_labels(type, cloud, labels);
}

const std::vector<CloudField> kFields = xyz_and({{"rgb", 12, 4}});

std::string point(std::size_t i) {
  const auto x = static_cast<float>(10 * i);
  return packed(x, x + 1.0F, x + 2.0F, static_cast<std::uint16_t>(1000 + i));
}

/// A cloud of `rows` rows, each of two points and `padding` bytes, with a field of another type.
std::string rows_of_points(MessageEncoding encoding, std::uint32_t rows, std::uint32_t padding) {
  std::string data;
  for (std::uint32_t i = 0; i < 2 * rows; ++i) {
    data += point(i);
    if (i % 2 == 1) data.append(padding, 'p');
  }
  return cloud_message(encoding, 1.5, "lidar", kFields, {rows, 2, 14, 28 + padding}, data);
}

/// A cloud of one row that has only the points with these numbers.
std::string one_row(MessageEncoding encoding, const std::vector<std::size_t>& numbers) {
  std::string data;
  for (const std::size_t i : numbers) data += point(i);
  return cloud_message(encoding, 1.5, "lidar", kFields, 14, data);
}

std::string livox_message(MessageEncoding encoding, const std::vector<std::uint8_t>& points) {
  MessageWriter out(encoding);
  out.header(nanoseconds(1.5), "livox").number(std::uint64_t{77});
  out.number(static_cast<std::uint32_t>(points.size()));
  out.number(std::uint8_t{3}).raw("abc").number(static_cast<std::uint32_t>(points.size()));
  for (const std::uint8_t i : points) {
    out.number(std::uint32_t{100U + i});
    for (std::uint32_t axis = 0; axis < 3; ++axis) out.number(static_cast<float>(i + axis));
    out.number(i).number(static_cast<std::uint8_t>(i + 1)).number(static_cast<std::uint8_t>(2));
  }
  return out.bytes();
}

/// Replaces the messages of one time.
EditMessage replacing(std::uint64_t replaced) {
  return [=](const LogMessage& place, const SerialisedMessage& message) {
    std::optional<std::string> edited;
    if (place.time == replaced) {
      edited = "other " + std::string(reinterpret_cast<const char*>(message.data), message.size);
    }
    return edited;
  };
}

const std::vector<LogChannel> kChannels = {kClouds, {"/other", "any/msg/Thing", "json"}};
constexpr std::uint64_t kReplaced = 30;

std::vector<WrittenMessage> five_messages() {
  return {{0, 10, "first"}, {1, 20, "second"}, {0, kReplaced, "third"}, {1, 40, "4"}, {0, 50, "5"}};
}

/// Copies the log, which has five_messages(), and compares all messages.
void check_copy(const fs::path& log, const fs::path& target) {
  copy_log(*open_log(log), target, replacing(kReplaced));
  std::vector<Message> expected = messages_of(log);
  REQUIRE(expected.size() == 5);
  expected[2].second = "other " + expected[2].second;
  CHECK(messages_of(target) == expected);
}

}  // namespace

TEST_CASE("A cloud without some points keeps all other bytes, its rows become one") {
  for (const auto encoding : {MessageEncoding::kRos1, MessageEncoding::kCdr}) {
    for (const std::uint32_t padding : {0U, 6U}) {
      CAPTURE(padding);
      const std::string cloud = rows_of_points(encoding, 2, padding);
      const auto message = serialised(cloud, encoding);
      CHECK(without(kCloud, message, Values{1, 0, 0, 1}) == one_row(encoding, {0, 3}));
      CHECK(without(kCloud, message, Values(4, 0)) == one_row(encoding, {}));
      CHECK(without(kCloud, message, Values(4, 1)) == one_row(encoding, {0, 1, 2, 3}));
      CHECK_THROWS_WITH(without(kCloud, message, Values(3, 1)),
                        ContainsSubstring("log: /t: expected 3 points, found 4"));
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
    read_cloud(kCloud, serialised(cloud, encoding), points);
    read_cloud(kCloud, message, marked_points);
    CHECK(marked_points.xyzi == points.xyzi);
    // By hand: two rows of two points of 14 + 4 bytes, and the flag of dense clouds behind them.
    for (std::size_t i = 0; i < 4; ++i) {
      const std::string point = marked.substr(marked.size() - 1 - 18 * (4 - i), 18);
      CHECK(point.substr(12, 6) ==
            packed(static_cast<std::uint16_t>(1000 + i), labels[i]) + std::string(3, '\0'));
    }
    CHECK_THROWS_WITH(marked_with(kCloud, message, labels),
                      ContainsSubstring("log: /t: expected no field \"label\""));
  }
}

TEST_CASE("A cloud with labels of another name gets none, for readers take the first ones") {
  for (const std::string name : {"LABEL", "class", "scalar_label"}) {
    CAPTURE(name);
    const std::string cloud =
        cloud_message(MessageEncoding::kCdr, 1.5, "lidar", xyz_and({{name, 12, 4}}), 14, point(0));
    const auto message = serialised(cloud, MessageEncoding::kCdr);
    CHECK_THROWS_AS(marked_with(kCloud, message, Values{9}), IoError);
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
    }
  }
}

TEST_CASE("Attachments, metadata, sequence numbers and publish times of an MCAP file stay") {
  const TemporaryFolder folder;
  std::string file = mcap_file(kChannels, five_messages(), {});
  const std::string times = packed(std::uint64_t{5}, std::uint64_t{6});
  const std::string attachment = mcap_record(
      9,
      packed(times, counted("calibration"), counted("text/plain"), std::uint64_t{4}, "data", 0U));
  const std::string metadata = mcap_record(12, counted("robot") + counted(""));
  const std::string message =
      mcap_record(5, packed(std::uint16_t{1}, 4711U, std::uint64_t{60}, std::uint64_t{55}, "late"));
  const std::size_t data_end = file.find(mcap_record(15, packed(0U)));
  file.insert(data_end, attachment + message + metadata);
  write_text(folder / "log.mcap", file);
  copy_log(*open_log(folder / "log.mcap"), folder / "copy.mcap", replacing(kReplaced));
  const std::string copy = read_text(folder / "copy.mcap");
  CHECK_THAT(copy, ContainsSubstring(attachment) && ContainsSubstring(metadata));
  const auto log = open_log(folder / "copy.mcap");
  std::vector<std::uint8_t> bytes;
  const MessageStamp stamp = log->read(log->messages().back(), bytes);
  CHECK(stamp.sequence == 4711);
  CHECK(stamp.publish_time == 55);
  CHECK(std::string(bytes.begin(), bytes.end()) == "late");
  const auto index = [&](const std::string& record) {
    return packed(std::uint64_t{copy.find(record)}, std::uint64_t{record.size()});
  };
  CHECK_THAT(copy, ContainsSubstring(
                       mcap_record(10, packed(index(attachment), times, std::uint64_t{4},
                                              counted("calibration"), counted("text/plain")))) &&
                       ContainsSubstring(mcap_record(13, index(metadata) + counted("robot"))));
}

TEST_CASE("Without chunks, a log is copied in chunks of some megabytes") {
  const TemporaryFolder folder;
  McapParts parts;
  parts.chunks = false;
  std::vector<WrittenMessage> messages;
  for (std::uint64_t i = 0; i < 12; ++i) messages.push_back({0, i, std::string(1U << 20U, 'm')});
  write_text(folder / "log.mcap", mcap_file(kChannels, messages, parts));
  copy_log(*open_log(folder / "log.mcap"), folder / "copy.mcap", replacing(kReplaced));
  CHECK(messages_of(folder / "copy.mcap") == messages_of(folder / "log.mcap"));
  std::set<std::uint64_t> chunks;
  const auto copy = open_log(folder / "copy.mcap");
  for (const LogMessage& message : copy->messages()) chunks.insert(message.block);
  CHECK(chunks.size() == 3);
}

TEST_CASE("A bag is copied with its messages, definitions and connections") {
  const TemporaryFolder folder;
  for (const std::string compression : {"none", "lz4"}) {
    BagParts parts;
    parts.compression = compression;
    parts.index = compression == "none";
    parts.is_closed = compression == "none";
    write_text(folder / "log.bag", bag_file(kChannels, five_messages(), parts));
    copy_log(*open_log(folder / "log.bag"), folder / "copy.mcap", replacing(kReplaced));
    const std::vector<Message> messages = messages_of(folder / "copy.mcap");
    CHECK(messages[0].second == "first");
    CHECK(messages[2].second == "other third");
    const auto log = open_log(folder / "copy.mcap");
    CHECK(log->profile() == "ros1");
    CHECK(log->topics()[0].encoding == MessageEncoding::kRos1);
    CHECK(log->topics()[0].schema->encoding == "ros1msg");
    CHECK(log->topics()[0].schema->definition == "std_msgs/Header header\n");
    CHECK(log->topics()[0].metadata == std::map<std::string, std::string>{{"latching", "1"}});
  }
}

TEST_CASE("A log that ends early is copied up to its end") {
  const TemporaryFolder folder;
  const std::string whole = mcap_file(kChannels, five_messages(), {});
  write_text(folder / "cut.mcap", whole.substr(0, whole.find("third") + 5));
  copy_log(*open_log(folder / "cut.mcap"), folder / "copy.mcap", replacing(20));
  const std::vector<Message> messages = messages_of(folder / "copy.mcap");
  REQUIRE(messages.size() == 2);
  CHECK(messages[1].second == "other second");
}

#if defined(DYNAINS_HAS_SQLITE3)
TEST_CASE("A database is copied with its messages, definitions and quality of service") {
  const TemporaryFolder folder;
  write_db3(folder / "log.db3", kChannels, five_messages());
  execute(folder / "log.db3", "UPDATE topics SET offered_qos_profiles = '- history: 3'");
  for (const bool has_definitions : {false, true}) {
    if (has_definitions) {
      execute(folder / "log.db3",
              "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding "
              "TEXT, encoded_message_definition TEXT, type_description_hash TEXT); INSERT INTO "
              "message_definitions VALUES(1, 'any/msg/Thing', 'ros2idl', 'module any', '')");
    }
    check_copy(folder / "log.db3", folder / "copy.mcap");
    const auto log = open_log(folder / "copy.mcap");
    const LogTopic& cloud = log->topics()[0];
    CHECK(cloud.metadata.at("offered_qos_profiles") == "- history: 3");
    CHECK(cloud.schema->name == "sensor_msgs/msg/PointCloud2");
    CHECK_THAT(cloud.schema->definition, StartsWith("std_msgs/Header header\nuint32 height\n"));
    const LogSchema& other = *log->topics()[1].schema;
    CHECK(other.encoding == (has_definitions ? "ros2idl" : ""));
    CHECK(other.definition == (has_definitions ? "module any" : ""));
  }
  CHECK(count_entries(folder.path()) == 2);
}
#endif
