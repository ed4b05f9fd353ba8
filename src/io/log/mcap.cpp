#include "mcap.hpp"

#include <algorithm>
#include <utility>

#include "../scalar.hpp"
#include "mcap_format.hpp"
#include "mcap_writer.hpp"
#include "message_editor.hpp"

namespace dynains {
namespace {

constexpr std::uint64_t kRecordHead = 9;  // opcode and length

MessageEncoding encoding_of(const std::string& name) {
  if (name == "ros1") return MessageEncoding::kRos1;
  return name == "cdr" ? MessageEncoding::kCdr : MessageEncoding::kOther;
}

/// Copies the records of a chunk, or one of them. `block`: the byte of the chunk or record.
void copy_records(Bytes records, std::uint64_t block, MessageEditor& editor, McapWriter& writer) {
  while (records.remaining() > 0) {
    LogMessage place;
    place.block = block;
    place.offset = records.position();
    const auto* const begin = reinterpret_cast<const char*>(records.here());
    const auto opcode = records.number<std::uint8_t>("an opcode");
    Bytes fields = records.block(records.number<std::uint64_t>("a length"), "a record");
    if (opcode == mcap::kSchema || opcode == mcap::kChannel) {
      writer.define(std::string(begin, kRecordHead + fields.remaining()));
    }
    if (opcode != mcap::kMessage) continue;
    McapWriter::MessageHead head;
    head.channel = fields.number<std::uint16_t>("a channel id");
    head.sequence = fields.number<std::uint32_t>("a sequence number");
    head.log_time = fields.number<std::uint64_t>("a log time");
    head.publish_time = fields.number<std::uint64_t>("a publish time");
    place.time = head.log_time;
    write_edited(editor, place, fields.here(), fields.remaining(),
                 [&](const char* data, std::size_t size) { writer.write(head, data, size); });
  }
}

/// The fields of an index record of an attachment that follow its position and size.
std::string attachment_index(Bytes fields) {
  const std::uint8_t* const times = fields.here();
  fields.skip(16, "the times of an attachment");
  const std::string name = fields.string("the name of an attachment");
  const std::string type = fields.string("the type of an attachment");
  const auto size = fields.number<std::uint64_t>("the size of an attachment");
  std::string index(times, times + 16);
  append_number(size, index);
  for (const std::string& text : {name, type}) {
    append_number(static_cast<std::uint32_t>(text.size()), index);
    index += text;
  }
  return index;
}

std::string metadata_index(Bytes fields) {
  const std::string name = fields.string("the name of metadata");
  std::string index;
  append_number(static_cast<std::uint32_t>(name.size()), index);
  return index + name;
}

}  // namespace

McapFile::McapFile(const std::filesystem::path& path) : ChunkedLog(path) {
  read_index(mcap::kMagic, "expected the magic bytes of MCAP, version 0");
}

std::optional<std::uint64_t> McapFile::record_size(std::uint64_t position) {
  if (file_.size() - position < kRecordHead) return std::nullopt;
  const auto head = file_.read(position, kRecordHead, "a record");
  Bytes fields(path_, position, head.data(), head.size());
  const auto opcode = fields.number<std::uint8_t>("an opcode");
  const auto size = fields.number<std::uint64_t>("a length");
  // Some file systems fill the end of a file with zeros after a crash.
  if (opcode == 0 || size > file_.size() - position - kRecordHead) return std::nullopt;
  return kRecordHead + size;
}

bool McapFile::take_record(std::uint64_t position, std::uint64_t size) {
  constexpr std::uint64_t kMessageHead = kRecordHead + 14;  // and channel, sequence, log time
  const std::uint64_t head_size = std::min(size, kMessageHead);
  const auto head = file_.read(position, head_size, "a record");
  Bytes fields(path_, position, head.data(), head.size());
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
    const auto record = file_.read(position, size, "a record");
    Bytes bytes(path_, position, record.data(), record.size());
    parse_record(bytes);
  }
  has_footer_ = opcode == mcap::kFooter;
  return !has_footer_;
}

void McapFile::take_chunk(std::uint64_t position, std::uint64_t size) {
  constexpr std::uint64_t kLongestHead = 128;  // compression names are short
  const auto head = file_.read(position, std::min(size, kLongestHead), "a chunk");
  Bytes fields(path_, position, head.data(), head.size());
  Chunk chunk;
  fields.skip(kRecordHead + 16, "the times of a chunk");
  chunk.uncompressed_size = fields.number<std::uint64_t>("the size of a chunk");
  chunk.uncompressed_crc = fields.number<std::uint32_t>("the checksum of a chunk");
  chunk.compression = fields.string("the compression of a chunk");
  chunk.compressed_size = fields.number<std::uint64_t>("the size of compressed records");
  chunk.content = position + fields.position();
  add_chunk(position, std::move(chunk));
}

void McapFile::take_message_index(std::uint64_t position, std::uint64_t size) {
  const auto record = file_.read(position, size, "a message index");
  Bytes fields(path_, position, record.data(), record.size());
  fields.skip(kRecordHead, "a record");
  const auto channel = fields.number<std::uint16_t>("a channel id");
  Bytes pairs =
      fields.block(fields.number<std::uint32_t>("the length of an index"), "a message index");
  while (pairs.remaining() > 0) {
    const auto time = pairs.number<std::uint64_t>("a log time");
    add_indexed(channel, time, pairs.number<std::uint64_t>("an offset"));
  }
}

std::optional<ChunkedLog::Message> McapFile::parse_record(Bytes& records) {
  const auto opcode = records.number<std::uint8_t>("an opcode");
  Bytes fields = records.block(records.number<std::uint64_t>("a length"), "a record");
  if (opcode != mcap::kMessage) {
    take_definition(opcode, fields);
    return std::nullopt;
  }
  const auto channel = fields.number<std::uint16_t>("a channel id");
  fields.skip(4, "a sequence number");
  const auto time = fields.number<std::uint64_t>("a log time");
  fields.skip(8, "a publish time");
  return Message{channel, time, fields};
}

void McapFile::take_definition(std::uint8_t opcode, Bytes fields) {
  if (opcode == mcap::kSchema) {
    const auto id = fields.number<std::uint16_t>("a schema id");
    schemas_[id] = plain_type(fields.string("a schema name"));
  }
  if (opcode != mcap::kChannel) return;
  const auto id = fields.number<std::uint16_t>("a channel id");
  const auto schema = schemas_.find(fields.number<std::uint16_t>("a schema id"));
  LogTopic topic;
  if (schema != schemas_.end()) topic.type = schema->second;
  topic.name = fields.string("a topic");
  topic.encoding = encoding_of(fields.string("a message encoding"));
  add_channel(id, std::move(topic));
}

void McapFile::copy(const std::filesystem::path& target, MessageEditor& editor) {
  std::uint64_t position = mcap::kMagic.size();
  const auto head = file_.read(position, record_size(position).value_or(0), "a header");
  if (head.empty() || head.front() != mcap::kHeader) {
    fail_at_byte(path_, position, "expected a header");
  }
  McapWriter writer(target, std::string(head.begin(), head.end()));
  position += head.size();
  while (const auto size = record_size(position)) {
    copy_record(position, *size, editor, writer);
    position += *size;
  }
  writer.commit();
}

void McapFile::copy_record(std::uint64_t position, std::uint64_t size, MessageEditor& editor,
                           McapWriter& writer) {
  constexpr std::uint64_t kLongestHead = std::uint64_t{1} << 16;  // names are short
  const auto opcode = file_.read(position, 1, "an opcode").front();
  if (opcode == mcap::kChunk) {
    const std::vector<std::uint8_t>& records = load(position);
    copy_records(Bytes(path_, 0, records.data(), records.size()), position, editor, writer);
    writer.finish_chunk(compression_of(position));
    return;
  }
  if (opcode == mcap::kMessage || opcode == mcap::kSchema || opcode == mcap::kChannel) {
    const auto record = file_.read(position, size, "a record");
    copy_records(Bytes(path_, position, record.data(), record.size()), position, editor, writer);
    return;
  }
  const auto begin = file_.read(position, std::min(size, kLongestHead), "a record");
  Bytes fields(path_, position, begin.data(), begin.size());
  fields.skip(kRecordHead, "a record");
  if (opcode == mcap::kAttachment) {
    writer.copy_record(file_, position, size, mcap::kAttachmentIndex, attachment_index(fields));
  } else if (opcode == mcap::kMetadata) {
    writer.copy_record(file_, position, size, mcap::kMetadataIndex, metadata_index(fields));
  } else if (opcode >= mcap::kFirstPrivate) {
    writer.copy_record(file_, position, size, std::nullopt, "");
  }
}

}  // namespace dynains
