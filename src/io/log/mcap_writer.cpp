#include "mcap_writer.hpp"

#include <algorithm>

#include "../scalar.hpp"
#include "compress.hpp"
#include "decompress.hpp"

namespace dynains {
namespace {

constexpr std::size_t kChunkSize = std::size_t{1} << 22;  // bytes, about

/// Content of a record.
class Fields {
 public:
  template <class Number>
  Fields& number(Number value) {
    append_number(value, bytes_);
    return *this;
  }
  Fields& string(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size()));
    return raw(text);
  }
  Fields& raw(const std::string& bytes) {
    bytes_ += bytes;
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string record(mcap::Opcode opcode, const Fields& content) {
  return Fields().number(opcode).number(std::uint64_t{content.bytes().size()}).bytes() +
         content.bytes();
}

/// A list of pairs with the number of its bytes.
template <class Pairs>
Fields list(const Pairs& pairs) {
  Fields content;
  for (const auto& [first, second] : pairs) content.number(first).number(second);
  return Fields().string(content.bytes());
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& path)
    : McapWriter(path, record(mcap::kHeader, Fields().string("ros2").string("dynains"))) {}

McapWriter::McapWriter(const std::filesystem::path& path, const std::string& header) : file_(path) {
  append(mcap::kMagic + header);
}

std::uint16_t McapWriter::add_channel(const std::string& topic, const MessageType& type) {
  const auto channel = static_cast<std::uint16_t>(counts_.size());
  const auto schema = static_cast<std::uint16_t>(channel + 1);  // 0 is no schema
  define(record(mcap::kSchema, Fields()
                                   .number(schema)
                                   .string(type.ros2_name())
                                   .string("ros2msg")
                                   .string(type.definition(encoding()))));
  define(record(mcap::kChannel,
                Fields().number(channel).number(schema).string(topic).string("cdr").string("")));
  counts_[channel] = 0;
  return channel;
}

void McapWriter::define(const std::string& record) {
  if (defined_.insert(record).second) definitions_ += record;
  records_ += record;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t time, const std::string& message) {
  const auto sequence = static_cast<std::uint32_t>(counts_.at(channel));
  write({channel, sequence, time, time}, message.data(), message.size());
  if (records_.size() >= kChunkSize) finish_chunk("");
}

void McapWriter::write(const MessageHead& head, const char* data, std::size_t size) {
  const bool is_first = index_.empty();
  first_time_ = is_first ? head.log_time : std::min(first_time_, head.log_time);
  last_time_ = is_first ? head.log_time : std::max(last_time_, head.log_time);
  index_[head.channel].push_back({head.log_time, records_.size()});
  ++counts_[head.channel];
  const Fields fields = Fields()
                            .number(head.channel)
                            .number(head.sequence)
                            .number(head.log_time)
                            .number(head.publish_time);
  records_ += Fields()
                  .number(mcap::kMessage)
                  .number(std::uint64_t{fields.bytes().size() + size})
                  .raw(fields.bytes())
                  .bytes();
  records_.append(data, size);
}

void McapWriter::finish_chunk(const std::string& compression) {
  if (index_.empty()) return;
  const std::uint64_t records_size = records_.size();
  const std::uint32_t checksum =
      crc32(reinterpret_cast<const std::uint8_t*>(records_.data()), records_.size());
  const std::string compressed = compress(compression, std::move(records_));
  ChunkPlace chunk{first_time_,  last_time_,  position_, 0, compressed.size(),
                   records_size, compression, {},        0};
  append(record(mcap::kChunk, Fields()
                                  .number(first_time_)
                                  .number(last_time_)
                                  .number(records_size)
                                  .number(checksum)
                                  .string(compression)
                                  .number(std::uint64_t{compressed.size()})
                                  .raw(compressed)));
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

void McapWriter::copy_record(RawFile& source, std::uint64_t position, std::uint64_t size,
                             std::optional<mcap::Opcode> index_opcode, const std::string& index) {
  finish_chunk("");
  if (index_opcode) {
    (*index_opcode == mcap::kAttachmentIndex ? attachments_ : metadata_) += 1;
    other_indexes_ += record(*index_opcode, Fields().number(position_).number(size).raw(index));
  }
  constexpr std::uint64_t kPart = std::uint64_t{1} << 20;  // bytes
  for (std::uint64_t done = 0; done < size; done += kPart) {
    const auto part =
        source.read(position + done, std::min(kPart, size - done), "a part of a record");
    append(std::string(part.begin(), part.end()));
  }
}

std::string McapWriter::summary() const {
  std::string bytes = definitions_;
  const auto schemas = static_cast<std::uint16_t>(
      std::count_if(defined_.begin(), defined_.end(), [](const std::string& definition) {
        return definition.front() == static_cast<char>(mcap::kSchema);
      }));
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
                                         .number(schemas)
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
  finish_chunk("");
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
