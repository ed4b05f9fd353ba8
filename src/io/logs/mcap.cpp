#include <algorithm>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "../scalar.hpp"
#include "chunked_log.hpp"
#include "mcap_writer.hpp"

namespace dynains {
namespace {

constexpr std::uint64_t kRecordHead = 9;  // opcode and length

MessageEncoding encoding_of(const std::string& name) {
  if (name == "ros1") return MessageEncoding::kRos1;
  return name == "cdr" ? MessageEncoding::kCdr : MessageEncoding::kOther;
}

/// The fields of an index record of an attachment that follow its position and size.
std::string attachment_index(Bytes fields) {
  const std::uint8_t* const times = fields.here();
  fields.skip(16, "the times of an attachment");
  const std::string name = fields.string("the name of an attachment");
  const std::string type = fields.string("the type of an attachment");
  const auto size = fields.number<std::uint64_t>("the size of an attachment");
  return ByteWriter()
      .raw(std::string(times, times + 16))
      .number(size)
      .string(name)
      .string(type)
      .bytes();
}

std::string metadata_index(Bytes fields) {
  return ByteWriter().string(fields.string("the name of metadata")).bytes();
}

/// MCAP (mcap.dev, specification of version 0).
class McapFile final : public ChunkedLog {
 public:
  explicit McapFile(const std::filesystem::path& path) : ChunkedLog(path) {
    read_index(mcap::kMagic, "expected the magic bytes of MCAP, version 0");
  }

  void copy_others(McapWriter& writer) override {
    for (const std::uint64_t position : others_) {
      const std::uint64_t size = record_size(position).value_or(0);
      FilePart record(file_, position, std::min(size, kMaxHead), "a record");
      Bytes& fields = record.fields;
      const auto opcode = fields.number<std::uint8_t>("an opcode");
      fields.skip(kRecordHead - 1, "a length");
      if (opcode == mcap::kAttachment) {
        writer.copy_record(file_, position, size, mcap::kAttachmentIndex, attachment_index(fields));
      } else if (opcode == mcap::kMetadata) {
        writer.copy_record(file_, position, size, mcap::kMetadataIndex, metadata_index(fields));
      } else {
        writer.copy_record(file_, position, size, std::nullopt, "");
      }
    }
  }

 private:
  std::optional<std::uint64_t> record_size(std::uint64_t position) override {
    if (file_.size() - position < kRecordHead) return std::nullopt;
    FilePart head(file_, position, kRecordHead, "a record");
    const auto opcode = head.fields.number<std::uint8_t>("an opcode");
    const auto size = head.fields.number<std::uint64_t>("a length");
    // Some file systems fill the end of a file with zeros after a crash.
    if (opcode == mcap::kNone || size > file_.size() - position - kRecordHead) return std::nullopt;
    return kRecordHead + size;
  }

  bool take_record(std::uint64_t position, std::uint64_t size) override {
    FilePart head(file_, position, std::min(size, kMaxHead), "a record");
    Bytes& fields = head.fields;
    const auto opcode = fields.number<std::uint8_t>("an opcode");
    if (opcode == mcap::kMessageIndex) {
      take_message_index(position, size);
      return true;
    }
    finish_chunk();
    if (opcode == mcap::kChunk) take_chunk(position, size);
    if (opcode == mcap::kMessage) {
      fields.skip(8, "a length");
      const auto channel = fields.number<std::uint16_t>("a channel id");
      fields.skip(4, "a sequence number");
      add_message(channel, fields.number<std::uint64_t>("a log time"), position);
    }
    if (opcode == mcap::kSchema || opcode == mcap::kChannel) {
      FilePart record(file_, position, size, "a record");
      parse_record(record.fields);
    }
    if (opcode == mcap::kAttachment || opcode == mcap::kMetadata || opcode >= 0x80) {
      others_.push_back(position);
    }
    if (opcode == mcap::kHeader) take_header(position, size);
    has_footer_ = opcode == mcap::kFooter;
    return !has_footer_;
  }

  void take_header(std::uint64_t position, std::uint64_t size) {
    FilePart record(file_, position, size, "a header");
    record.fields.skip(kRecordHead, "a record");
    profile_ = record.fields.string("a profile");
  }

  void take_chunk(std::uint64_t position, std::uint64_t size) {
    FilePart head(file_, position, std::min(size, kMaxHead), "a chunk");
    Bytes& fields = head.fields;
    Chunk chunk;
    fields.skip(kRecordHead + 16, "the times of a chunk");
    chunk.uncompressed_size = fields.number<std::uint64_t>("the size of a chunk");
    chunk.uncompressed_crc = fields.number<std::uint32_t>("the checksum of a chunk");
    chunk.compression = fields.string("the compression of a chunk");
    chunk.compressed_size = fields.number<std::uint64_t>("the size of compressed records");
    chunk.content = position + fields.position();
    add_chunk(position, std::move(chunk));
  }

  void take_message_index(std::uint64_t position, std::uint64_t size) {
    FilePart record(file_, position, size, "a message index");
    Bytes& fields = record.fields;
    fields.skip(kRecordHead, "a record");
    const auto channel = fields.number<std::uint16_t>("a channel id");
    Bytes pairs =
        fields.block(fields.number<std::uint32_t>("the length of an index"), "a message index");
    while (pairs.remaining() > 0) {
      const auto time = pairs.number<std::uint64_t>("a log time");
      add_indexed(channel, time, pairs.number<std::uint64_t>("an offset"));
    }
  }

  std::optional<ChunkedLog::Message> parse_record(Bytes& records) override {
    const auto opcode = records.number<std::uint8_t>("an opcode");
    Bytes fields = records.block(records.number<std::uint64_t>("a length"), "a record");
    if (opcode != mcap::kMessage) {
      take_definition(opcode, fields);
      return std::nullopt;
    }
    const auto channel = fields.number<std::uint16_t>("a channel id");
    MessageStamp stamp;
    stamp.sequence = fields.number<std::uint32_t>("a sequence number");
    const auto time = fields.number<std::uint64_t>("a log time");
    stamp.publish_time = fields.number<std::uint64_t>("a publish time");
    return Message{channel, time, stamp, fields};
  }

  void take_definition(std::uint8_t opcode, Bytes fields) {
    if (opcode == mcap::kSchema) {
      auto& schema = schemas_[fields.number<std::uint16_t>("a schema id")];
      const std::string name = fields.string("a schema name");
      const std::string encoding = fields.string("a schema encoding");
      schema = std::make_shared<LogSchema>(
          LogSchema{name, encoding, fields.string("the definition of a schema")});
    }
    if (opcode != mcap::kChannel) return;
    const auto id = fields.number<std::uint16_t>("a channel id");
    const auto schema = schemas_.find(fields.number<std::uint16_t>("a schema id"));
    LogTopic topic;
    if (schema != schemas_.end()) {
      topic.schema = schema->second;
      topic.type = plain_type(topic.schema->name);
    }
    topic.name = fields.string("a topic");
    topic.message_encoding = fields.string("a message encoding");
    topic.encoding = encoding_of(topic.message_encoding);
    Bytes metadata = fields.block(fields.number<std::uint32_t>("the length of metadata"),
                                  "metadata of a channel");
    while (metadata.remaining() > 0) {
      const std::string name = metadata.string("a name");
      topic.metadata[name] = metadata.string("a value");
    }
    add_channel(id, std::move(topic));
  }

  bool is_complete() const override { return has_footer_; }

  std::map<std::uint16_t, std::shared_ptr<const LogSchema>> schemas_;  ///< by id
  std::vector<std::uint64_t> others_;  ///< positions of records that belong to no channel
  bool has_footer_ = false;
};

}  // namespace

std::unique_ptr<LogFile> open_mcap(const std::filesystem::path& path) {
  return std::make_unique<McapFile>(path);
}

}  // namespace dynains
