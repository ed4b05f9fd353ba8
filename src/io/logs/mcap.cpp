#include <algorithm>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "../scalar.hpp"
#include "chunked_log.hpp"
#include "decompress.hpp"
#include "mcap_writer.hpp"
#if defined(DYNAINS_HAS_ZSTD)
#include <zstd.h>
#endif

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

  bool take_record(std::uint64_t position, std::uint64_t size, Bytes head) override {
    const auto opcode = head.number<std::uint8_t>("an opcode");
    head.skip(kRecordHead - 1, "a length");
    const bool is_definition = opcode == mcap::kSchema || opcode == mcap::kChannel;
    const bool is_whole = is_definition || opcode == mcap::kMessageIndex || opcode == mcap::kHeader;
    std::optional<FilePart> record;
    if (is_whole) {
      record.emplace(file_, position, size, "a record");
      record->fields.skip(kRecordHead, "a record");
    }
    if (opcode == mcap::kMessageIndex) {
      take_message_index(record->fields);
      return true;
    }
    finish_chunk();
    if (opcode == mcap::kChunk) take_chunk(position, head);
    if (opcode == mcap::kMessage) {
      const auto channel = head.number<std::uint16_t>("a channel id");
      head.skip(4, "a sequence number");
      add_message(channel, head.number<std::uint64_t>("a log time"), position);
    }
    if (is_definition) take_definition(opcode, record->fields);
    if (opcode == mcap::kAttachment || opcode == mcap::kMetadata || opcode >= 0x80) {
      others_.push_back(position);
    }
    if (opcode == mcap::kHeader) profile_ = record->fields.string("a profile");
    has_footer_ = opcode == mcap::kFooter;
    return !has_footer_;
  }

  void take_chunk(std::uint64_t position, Bytes& fields) {
    Chunk chunk;
    fields.skip(16, "the times of a chunk");
    chunk.uncompressed_size = fields.number<std::uint64_t>("the size of a chunk");
    chunk.uncompressed_crc = fields.number<std::uint32_t>("the checksum of a chunk");
    chunk.compression = fields.string("the compression of a chunk");
    chunk.compressed_size = fields.number<std::uint64_t>("the size of compressed records");
    chunk.content = position + fields.position();
    add_chunk(position, std::move(chunk));
  }

  void take_message_index(Bytes& fields) {
    const auto channel = fields.number<std::uint16_t>("a channel id");
    Bytes pairs = fields.block("a message index");
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
    Bytes metadata = fields.block("metadata of a channel");
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

using Fields = ByteWriter;  // content of a record

std::string record(mcap::Opcode opcode, const Fields& content) {
  return Fields().numbers(opcode, std::uint64_t{content.bytes().size()}).bytes() + content.bytes();
}

/// Compresses `bytes` if this build has zstd. Returns the name of the compression, empty for none.
std::string compress([[maybe_unused]] std::string& bytes) {
#if defined(DYNAINS_HAS_ZSTD)
  std::string result(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(result.data(), result.size(), bytes.data(), bytes.size(), ZSTD_CLEVEL_DEFAULT);
  if (ZSTD_isError(size) == 0) {
    result.resize(size);
    bytes = std::move(result);
    return "zstd";
  }
#endif
  return {};
}

/// A list of pairs with the number of its bytes.
template <class Pairs>
Fields list(const Pairs& pairs) {
  Fields content;
  for (const auto& [first, second] : pairs) content.numbers(first, second);
  return Fields().string(content.bytes());
}

}  // namespace

std::unique_ptr<LogFile> open_mcap(const std::filesystem::path& path) {
  return std::make_unique<McapFile>(path);
}

McapWriter::McapWriter(const std::filesystem::path& path, const std::string& profile,
                       Compression compression)
    : file_(path), compression_(compression) {
  append(mcap::kMagic + record(mcap::kHeader, Fields().string(profile).string("dynains")));
}

std::uint16_t McapWriter::add_channel(const LogTopic& topic) {
  const auto channel = static_cast<std::uint16_t>(counts_.size());
  const std::uint16_t schema = topic.schema ? add_schema(*topic.schema) : std::uint16_t{0};
  Fields metadata;
  for (const auto& [name, value] : topic.metadata) metadata.string(name).string(value);
  define(record(mcap::kChannel, Fields()
                                    .numbers(channel, schema)
                                    .string(topic.name)
                                    .string(topic.message_encoding)
                                    .string(metadata.bytes())));
  counts_[channel] = 0;
  return channel;
}

std::uint16_t McapWriter::add_schema(const LogSchema& schema) {
  const Fields content =
      Fields().string(schema.name).string(schema.encoding).string(schema.definition);
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);  // 0 is no schema
  const auto [known, is_new] = schemas_.emplace(content.bytes(), id);
  if (is_new) define(record(mcap::kSchema, Fields().number(id).raw(content.bytes())));
  return known->second;
}

void McapWriter::define(const std::string& record) {
  definitions_ += record;
  records_ += record;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t time, const MessageStamp& stamp,
                       Span<const char> message) {
  const bool is_first = index_.empty();
  first_time_ = is_first ? time : std::min(first_time_, time);
  last_time_ = is_first ? time : std::max(last_time_, time);
  index_[channel].push_back({time, records_.size()});
  ++counts_[channel];
  const Fields fields = Fields().numbers(channel, stamp.sequence, time, stamp.publish_time);
  records_ += Fields()
                  .numbers(mcap::kMessage, std::uint64_t{fields.bytes().size() + message.size()})
                  .raw(fields.bytes())
                  .bytes();
  records_.append(message.data(), message.size());
  if (records_.size() >= 1U << 22U) finish_chunk();
}

void McapWriter::finish_chunk() {
  if (index_.empty()) return;
  const std::uint64_t records_size = records_.size();
  const std::uint32_t checksum =
      crc32(reinterpret_cast<const std::uint8_t*>(records_.data()), records_.size());
  const std::string compression =
      compression_ == Compression::kZstd ? compress(records_) : std::string();
  const std::uint64_t begin = position_;
  append(record(mcap::kChunk, Fields()
                                  .numbers(first_time_, last_time_, records_size, checksum)
                                  .string(compression)
                                  .number(std::uint64_t{records_.size()})
                                  .raw(records_)));
  const std::uint64_t size = position_ - begin;
  std::map<std::uint16_t, std::uint64_t> places;  // of the indexes, by channel
  for (const auto& [channel, entries] : index_) {
    places[channel] = position_;
    append(record(mcap::kMessageIndex, Fields().number(channel).raw(list(entries).bytes())));
  }
  chunk_indexes_ +=
      record(mcap::kChunkIndex, Fields()
                                    .numbers(first_time_, last_time_, begin, size)
                                    .raw(list(places).bytes())
                                    .number(position_ - begin - size)
                                    .string(compression)
                                    .numbers(std::uint64_t{records_.size()}, records_size));
  begin_time_ = chunk_count_ == 0 ? first_time_ : std::min(begin_time_, first_time_);
  end_time_ = std::max(end_time_, last_time_);
  ++chunk_count_;
  records_.clear();
  index_.clear();
}

void McapWriter::copy_record(ByteReader& source, std::uint64_t position, std::uint64_t size,
                             std::optional<mcap::Opcode> index_opcode, const std::string& index) {
  finish_chunk();
  if (index_opcode) {
    (*index_opcode == mcap::kAttachmentIndex ? attachments_ : metadata_) += 1;
    other_indexes_ += record(*index_opcode, Fields().numbers(position_, size).raw(index));
  }
  constexpr std::uint64_t kPart = std::uint64_t{1} << 20;  // bytes
  for (std::uint64_t done = 0; done < size; done += kPart) {
    const auto part =
        source.read_at(position + done, std::min(kPart, size - done), "a part of a record");
    append(std::string(part.begin(), part.end()));
  }
}

std::string McapWriter::summary() const {
  std::uint64_t messages = 0;
  for (const auto& [channel, count] : counts_) messages += count;
  const Fields statistics = Fields()
                                .numbers(messages, static_cast<std::uint16_t>(schemas_.size()),
                                         static_cast<std::uint32_t>(counts_.size()), attachments_,
                                         metadata_, chunk_count_, begin_time_, end_time_)
                                .raw(list(counts_).bytes());
  return definitions_ + record(mcap::kStatistics, statistics) + chunk_indexes_ + other_indexes_;
}

void McapWriter::commit() {
  finish_chunk();
  append(record(mcap::kDataEnd, Fields().number(std::uint32_t{0})));
  const std::uint64_t summary_begin = position_;
  append(summary());
  // Without offsets and checksum of the summary.
  append(
      record(mcap::kFooter, Fields().numbers(summary_begin, std::uint64_t{0}, std::uint32_t{0})) +
      mcap::kMagic);
  file_.commit();
}

void McapWriter::append(const std::string& bytes) {
  file_.stream().write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  position_ += bytes.size();
}

}  // namespace dynains
