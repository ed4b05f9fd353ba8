#include "mcap_writer.hpp"

#include "../scalar.hpp"
#include "decompress.hpp"
#include "mcap_format.hpp"

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

McapWriter::McapWriter(const std::filesystem::path& path) : file_(path) {
  append(mcap::kMagic + record(mcap::kHeader, Fields().string("ros2").string("dynains")));
}

std::uint16_t McapWriter::add_channel(const std::string& topic, const MessageType& type) {
  const auto channel = static_cast<std::uint16_t>(counts_.size());
  const auto schema = static_cast<std::uint16_t>(channel + 1);  // 0 is no schema
  const std::string records =
      record(mcap::kSchema, Fields()
                                .number(schema)
                                .string(type.ros2_name())
                                .string("ros2msg")
                                .string(type.definition(encoding()))) +
      record(mcap::kChannel,
             Fields().number(channel).number(schema).string(topic).string("cdr").string(""));
  definitions_ += records;
  records_ += records;
  counts_.push_back(0);
  return channel;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t time, const std::string& message) {
  if (index_.empty()) first_time_ = time;
  last_time_ = time;
  index_[channel].push_back({time, records_.size()});
  const auto sequence = static_cast<std::uint32_t>(counts_.at(channel)++);
  records_ +=
      record(mcap::kMessage,
             Fields().number(channel).number(sequence).number(time).number(time).raw(message));
  if (records_.size() >= kChunkSize) finish_chunk();
}

void McapWriter::finish_chunk() {
  if (index_.empty()) return;
  const std::uint64_t records_size = records_.size();
  const std::uint32_t checksum =
      crc32(reinterpret_cast<const std::uint8_t*>(records_.data()), records_.size());
  ChunkPlace chunk{first_time_, last_time_, position_, 0, records_size, {}, 0};
  append(record(mcap::kChunk, Fields()
                                  .number(first_time_)
                                  .number(last_time_)
                                  .number(records_size)
                                  .number(checksum)
                                  .string("")
                                  .number(records_size)
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

std::string McapWriter::summary() const {
  std::string bytes = definitions_;
  std::uint64_t messages = 0;
  std::vector<std::pair<std::uint16_t, std::uint64_t>> counts;
  for (const std::uint64_t count : counts_) {
    counts.emplace_back(static_cast<std::uint16_t>(counts.size()), count);
    messages += count;
  }
  const std::uint64_t begin = chunks_.empty() ? 0 : chunks_.front().begin_time;
  bytes += record(mcap::kStatistics, Fields()
                                         .number(messages)
                                         .number(static_cast<std::uint16_t>(counts_.size()))
                                         .number(static_cast<std::uint32_t>(counts_.size()))
                                         .number(std::uint32_t{0})  // attachments
                                         .number(std::uint32_t{0})  // metadata
                                         .number(static_cast<std::uint32_t>(chunks_.size()))
                                         .number(begin)
                                         .number(last_time_)
                                         .raw(list(counts).bytes()));
  for (const ChunkPlace& chunk : chunks_) {
    bytes += record(mcap::kChunkIndex, Fields()
                                           .number(chunk.begin_time)
                                           .number(chunk.end_time)
                                           .number(chunk.position)
                                           .number(chunk.size)
                                           .raw(list(chunk.indexes).bytes())
                                           .number(chunk.indexes_size)
                                           .string("")
                                           .number(chunk.records_size)
                                           .number(chunk.records_size));
  }
  return bytes;
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
