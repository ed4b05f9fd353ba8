#include "mcap_writer.hpp"

#include <algorithm>

#include "../scalar.hpp"
#include "decompress.hpp"
#if defined(DYNAINS_HAS_ZSTD)
#include <zstd.h>
#endif

namespace dynains {
namespace {

using Fields = ByteWriter;  // content of a record

std::string record(mcap::Opcode opcode, const Fields& content) {
  return Fields().number(opcode).number(std::uint64_t{content.bytes().size()}).bytes() +
         content.bytes();
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
  for (const auto& [first, second] : pairs) content.number(first).number(second);
  return Fields().string(content.bytes());
}

}  // namespace

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
                                    .number(channel)
                                    .number(schema)
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
  const Fields fields =
      Fields().number(channel).number(stamp.sequence).number(time).number(stamp.publish_time);
  records_ += Fields()
                  .number(mcap::kMessage)
                  .number(std::uint64_t{fields.bytes().size() + message.size()})
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
  ChunkPlace chunk{first_time_,  last_time_,  position_, 0, records_.size(),
                   records_size, compression, {},        0};
  append(record(mcap::kChunk, Fields()
                                  .number(first_time_)
                                  .number(last_time_)
                                  .number(records_size)
                                  .number(checksum)
                                  .string(compression)
                                  .number(std::uint64_t{records_.size()})
                                  .raw(records_)));
  chunk.size = position_ - chunk.position;
  for (const auto& [channel, entries] : index_) {
    chunk.indexes[channel] = position_;
    append(record(mcap::kMessageIndex, Fields().number(channel).raw(list(entries).bytes())));
  }
  chunk.indexes_size = position_ - chunk.position - chunk.size;
  chunks_.push_back(std::move(chunk));
  records_.clear();
  index_.clear();
}

void McapWriter::copy_record(ByteReader& source, std::uint64_t position, std::uint64_t size,
                             std::optional<mcap::Opcode> index_opcode, const std::string& index) {
  finish_chunk();
  if (index_opcode) {
    (*index_opcode == mcap::kAttachmentIndex ? attachments_ : metadata_) += 1;
    other_indexes_ += record(*index_opcode, Fields().number(position_).number(size).raw(index));
  }
  constexpr std::uint64_t kPart = std::uint64_t{1} << 20;  // bytes
  for (std::uint64_t done = 0; done < size; done += kPart) {
    const auto part =
        source.read_at(position + done, std::min(kPart, size - done), "a part of a record");
    append(std::string(part.begin(), part.end()));
  }
}

std::string McapWriter::summary() const {
  std::string bytes = definitions_;
  std::uint64_t messages = 0;
  for (const auto& [channel, count] : counts_) messages += count;
  std::uint64_t begin = chunks_.empty() ? 0 : chunks_.front().begin_time;
  std::uint64_t end = 0;
  for (const ChunkPlace& chunk : chunks_) {
    begin = std::min(begin, chunk.begin_time);
    end = std::max(end, chunk.end_time);
  }
  bytes += record(mcap::kStatistics, Fields()
                                         .number(messages)
                                         .number(static_cast<std::uint16_t>(schemas_.size()))
                                         .number(static_cast<std::uint32_t>(counts_.size()))
                                         .number(attachments_)
                                         .number(metadata_)
                                         .number(static_cast<std::uint32_t>(chunks_.size()))
                                         .number(begin)
                                         .number(end)
                                         .raw(list(counts_).bytes()));
  for (const ChunkPlace& chunk : chunks_) {
    bytes += record(mcap::kChunkIndex, Fields()
                                           .number(chunk.begin_time)
                                           .number(chunk.end_time)
                                           .number(chunk.position)
                                           .number(chunk.size)
                                           .raw(list(chunk.indexes).bytes())
                                           .number(chunk.indexes_size)
                                           .string(chunk.compression)
                                           .number(chunk.compressed_size)
                                           .number(chunk.records_size));
  }
  return bytes + other_indexes_;
}

void McapWriter::commit() {
  finish_chunk();
  append(record(mcap::kDataEnd, Fields().number(std::uint32_t{0})));
  const std::uint64_t summary_begin = position_;
  append(summary());
  append(record(mcap::kFooter, Fields()
                                   .number(summary_begin)
                                   .number(std::uint64_t{0})     // no offsets of the summary
                                   .number(std::uint32_t{0})) +  // no checksum of the summary
         mcap::kMagic);
  file_.commit();
}

void McapWriter::append(const std::string& bytes) {
  file_.stream().write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  position_ += bytes.size();
}

}  // namespace dynains
