#include <algorithm>
#include <string>
#include <utility>

#include "../failure.hpp"
#include "chunked_log.hpp"

namespace dynains {
namespace {

namespace bag {

const std::string kMagic = "#ROSBAG V2.0\n";

/// In the order of the specification, from 2 on.
enum Opcode : std::uint8_t {
  kMessageData = 2,
  kBagHeader,
  kIndexData,
  kChunk,
  kChunkInfo,
  kConnection
};

}  // namespace bag

/// The value of a header field `name`; nothing if the header lacks it.
std::optional<Bytes> find_field(Bytes header, const std::string& name) {
  while (header.remaining() > 0) {
    Bytes field = header.block("a header field");
    if (field.remaining() <= name.size()) continue;
    const char* const text = reinterpret_cast<const char*>(field.here());
    if (text[name.size()] != '=' || !std::equal(name.begin(), name.end(), text)) continue;
    field.skip(name.size() + 1, "a field name");
    return field;
  }
  return std::nullopt;
}

Bytes field_of(const Bytes& header, const std::string& name) {
  const std::optional<Bytes> field = find_field(header, name);
  if (!field) header.fail("expected the header field " + name);
  return *field;
}

template <class Number>
Number number_in(const Bytes& header, const std::string& name) {
  return field_of(header, name).template number<Number>(name.c_str());
}

std::string text_in(const Bytes& header, const std::string& name) {
  return field_of(header, name).rest_as_text();
}

/// Seconds and nanoseconds as nanoseconds.
std::uint64_t read_time(Bytes& in) {
  const auto seconds = in.number<std::uint32_t>("seconds");
  return kSecondOfLog * seconds + in.number<std::uint32_t>("nanoseconds");
}

/// A bag of ROS 1 (wiki.ros.org/Bags/Format/2.0).
class RosBag final : public ChunkedLog {
 public:
  explicit RosBag(const std::filesystem::path& path) : ChunkedLog(path) {
    profile_ = "ros1";
    read_index(bag::kMagic, "expected \"#ROSBAG V2.0\" and the end of a line");
  }

 private:
  std::optional<std::uint64_t> record_size(std::uint64_t position) override {
    std::uint64_t size = 0;
    for (const char* const purpose : {"the length of a header", "the length of data"}) {
      if (file_.size() - position - size < sizeof(std::uint32_t)) return std::nullopt;
      FilePart length(file_, position + size, sizeof(std::uint32_t), purpose);
      size += sizeof(std::uint32_t) + length.fields.number<std::uint32_t>(purpose);
      if (size > file_.size() - position) return std::nullopt;
    }
    return size;
  }

  bool take_record(std::uint64_t position, std::uint64_t size, Bytes head) override {
    const Bytes header = head.block("a header");
    const auto opcode = number_in<std::uint8_t>(header, "op");
    if (opcode == bag::kIndexData) {
      take_index(position, size);
      return true;
    }
    finish_chunk();
    if (opcode == bag::kBagHeader) take_bag_header(position, header);
    if (opcode == bag::kChunk) take_chunk(position, header, head);
    if (opcode == bag::kChunkInfo) ++chunk_infos_;
    if (opcode == bag::kMessageData) {
      Bytes time = field_of(header, "time");
      add_message(number_in<std::uint32_t>(header, "conn"), read_time(time), position);
    }
    if (opcode == bag::kConnection) {
      FilePart record(file_, position, size, "a connection");
      parse_record(record.fields);
    }
    return true;
  }

  void take_bag_header(std::uint64_t position, const Bytes& header) {
    const std::optional<Bytes> encryptor = find_field(header, "encryptor");
    if (encryptor && encryptor->remaining() > 0) {
      fail_at_byte(path_, position, "expected a bag without encryption");
    }
    has_index_ = number_in<std::uint64_t>(header, "index_pos") != 0;
    announced_chunks_ = number_in<std::uint32_t>(header, "chunk_count");
  }

  void take_chunk(std::uint64_t position, const Bytes& header, Bytes& rest) {
    Chunk chunk;
    chunk.compression = text_in(header, "compression");
    if (chunk.compression == "none") chunk.compression.clear();
    chunk.uncompressed_size = number_in<std::uint32_t>(header, "size");
    chunk.compressed_size = rest.number<std::uint32_t>("the length of data");
    chunk.content = position + rest.position();
    add_chunk(position, std::move(chunk));
  }

  void take_index(std::uint64_t position, std::uint64_t size) {
    FilePart record(file_, position, size, "an index");
    Bytes& rest = record.fields;
    const Bytes header = rest.block("a header");
    if (number_in<std::uint32_t>(header, "ver") != 1) header.fail("expected an index of version 1");
    const auto connection = number_in<std::uint32_t>(header, "conn");
    Bytes entries = rest.block("an index");
    while (entries.remaining() > 0) {
      const std::uint64_t time = read_time(entries);
      add_indexed(connection, time, entries.number<std::uint32_t>("an offset"));
    }
  }

  std::optional<ChunkedLog::Message> parse_record(Bytes& records) override {
    const Bytes header = records.block("a header");
    const Bytes content = records.block("data");
    const auto opcode = number_in<std::uint8_t>(header, "op");
    if (opcode == bag::kConnection) take_connection(header, content);
    if (opcode != bag::kMessageData) return std::nullopt;
    Bytes time = field_of(header, "time");
    const std::uint64_t recorded = read_time(time);
    return Message{number_in<std::uint32_t>(header, "conn"), recorded, {recorded, 0}, content};
  }

  void take_connection(const Bytes& header, Bytes content) {
    LogTopic topic;
    topic.name = text_in(header, "topic");
    topic.type = text_in(content, "type");
    topic.encoding = MessageEncoding::kRos1;
    topic.message_encoding = "ros1";
    const std::optional<Bytes> definition = find_field(content, "message_definition");
    topic.schema = std::make_shared<LogSchema>(
        LogSchema{topic.type, "ros1msg", definition ? definition->rest_as_text() : std::string()});
    for (const std::string name : {"callerid", "latching", "md5sum"}) {
      const std::optional<Bytes> value = find_field(content, name);
      if (value) topic.metadata[name] = value->rest_as_text();
    }
    add_channel(number_in<std::uint32_t>(header, "conn"), std::move(topic));
  }

  /// A recorder writes the place of the index, and the number of chunks, when it closes the bag.
  bool is_complete() const override { return has_index_ && chunk_infos_ == announced_chunks_; }

  bool has_index_ = false;
  std::uint32_t announced_chunks_ = 0;
  std::uint32_t chunk_infos_ = 0;
};

}  // namespace

std::unique_ptr<LogFile> open_ros_bag(const std::filesystem::path& path) {
  return std::make_unique<RosBag>(path);
}

}  // namespace dynains
