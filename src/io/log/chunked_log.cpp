#include "chunked_log.hpp"

#include <algorithm>
#include <utility>

#include "../failure.hpp"
#include "decompress.hpp"

namespace dynains {
namespace {

/// Recorders write chunks of some megabytes.
constexpr std::uint64_t kLargestChunk = std::uint64_t{1} << 28;

}  // namespace

void ChunkedLog::read_index(const std::string& magic, const std::string& expectation) {
  const auto begin =
      file_.read(0, std::min<std::uint64_t>(file_.size(), magic.size()), "magic bytes");
  const auto is_equal = [](std::uint8_t byte, char expected) {
    return byte == static_cast<std::uint8_t>(expected);
  };
  if (!std::equal(begin.begin(), begin.end(), magic.begin(), magic.end(), is_equal)) {
    fail_at_byte(path_, 0, expectation);
  }
  std::uint64_t position = magic.size();
  bool goes_on = true;
  while (goes_on && position < file_.size()) {
    const std::optional<std::uint64_t> size = record_size(position);
    if (!size) break;
    goes_on = take_record(position, *size);
    position += *size;
  }
  if (!is_complete() || (goes_on && position < file_.size())) {
    early_end_ = path_.string() + ": byte " + std::to_string(position) +
                 ": the log ends early, as after a crash of its recorder";
    drop_index_of_last_chunk();
  }
  finish_chunk();
  find_missing_channels();
  make_messages();
  finish_index();
}

void ChunkedLog::add_chunk(std::uint64_t position, Chunk header) {
  if (header.compressed_size > file_.size() - header.content) {
    fail_at_byte(path_, position,
                 "expected a chunk of at most " + std::to_string(file_.size() - header.content) +
                     " bytes, found the size " + std::to_string(header.compressed_size));
  }
  if (header.uncompressed_size > kLargestChunk) {
    fail_at_byte(path_, position,
                 "expected a chunk of at most " + std::to_string(kLargestChunk) +
                     " bytes, found the size " + std::to_string(header.uncompressed_size));
  }
  chunks_[position] = std::move(header);
  last_chunk_ = position;
  first_of_last_ = entries_.size();
}

void ChunkedLog::add_indexed(std::uint32_t channel, std::uint64_t time, std::uint64_t offset) {
  if (last_chunk_ == 0) return;
  chunks_[last_chunk_].has_index = true;
  entries_.push_back({time, last_chunk_, offset, channel});
}

/// Some of the index may be missing at the end of a file.
void ChunkedLog::drop_index_of_last_chunk() {
  if (last_chunk_ == 0) return;
  chunks_[last_chunk_].has_index = false;
  entries_.resize(first_of_last_);
}

void ChunkedLog::finish_chunk() {
  const std::uint64_t chunk = std::exchange(last_chunk_, 0);
  if (chunk != 0 && !chunks_[chunk].has_index) read_chunk_records(chunk, true);
}

/// Adds the channels of a chunk, and its messages if asked for.
void ChunkedLog::read_chunk_records(std::uint64_t chunk, bool with_messages) {
  const std::vector<std::uint8_t>& records = load(chunk);
  Bytes rest(chunk_place_, 0, records.data(), records.size());
  while (rest.remaining() > 0) {
    const std::uint64_t offset = rest.position();
    const std::optional<Message> message = parse_record(rest);
    if (message && with_messages) {
      entries_.push_back({message->time, chunk, offset, message->channel});
    }
  }
}

/// Without a summary, channels are defined in chunks only.
void ChunkedLog::find_missing_channels() {
  std::uint64_t last = 0;
  for (const Entry& entry : entries_) {
    if (entry.block == last || channels_.count(entry.channel) != 0) continue;
    last = entry.block;
    if (chunks_.count(entry.block) != 0) read_chunk_records(entry.block, false);
  }
}

void ChunkedLog::make_messages() {
  std::map<std::uint32_t, std::uint32_t> topic_of;
  for (const auto& [id, channel] : channels_) topic_of[id] = add_topic(channel);
  messages_.reserve(entries_.size());
  for (const Entry& entry : entries_) {
    const auto topic = topic_of.find(entry.channel);
    if (topic == topic_of.end()) {
      fail_at_byte(
          path_, entry.block,
          "expected a message of a known channel, found channel " + std::to_string(entry.channel));
    }
    messages_.push_back({entry.time, entry.block, entry.offset, topic->second, 0});
  }
  entries_ = {};
}

void ChunkedLog::read(const LogMessage& message, std::vector<std::uint8_t>& bytes) {
  const auto chunk = chunks_.find(message.block);
  const bool is_lone = chunk == chunks_.end();
  if (is_lone) {
    file_.read(message.block, record_size(message.block).value_or(0), "a message", compressed_);
  }
  const std::vector<std::uint8_t>& records = is_lone ? compressed_ : load(message.block);
  Bytes rest(is_lone ? path_ : chunk_place_, is_lone ? message.block : 0, records.data(),
             records.size());
  rest.skip(message.offset, "records before a message");
  const Bytes record = rest;
  const std::optional<Message> found = parse_record(rest);
  if (!found) record.fail("expected a message");
  const std::uint8_t* const data = found->payload.here();
  bytes.assign(data, data + found->payload.remaining());
}

/// The uncompressed records of a chunk; the last ones are kept.
const std::vector<std::uint8_t>& ChunkedLog::load(std::uint64_t chunk) {
  if (loaded_ == chunk) return records_;
  loaded_ = 0;
  Chunk& header = chunks_.at(chunk);
  file_.read(header.content, header.compressed_size, "a chunk", compressed_);
  if (header.compression.empty()) {
    records_.swap(compressed_);
    if (records_.size() != header.uncompressed_size) {
      fail_at_byte(path_, chunk,
                   "expected a chunk of " + std::to_string(header.uncompressed_size) +
                       " bytes, found " + std::to_string(records_.size()));
    }
  } else {
    const std::string obstacle =
        decompress(header.compression, compressed_, header.uncompressed_size, records_);
    if (!obstacle.empty()) fail_at_byte(path_, header.content, "compressed chunk: " + obstacle);
  }
  if (has_crc32() && header.uncompressed_crc != 0 &&
      header.uncompressed_crc != crc32(records_.data(), records_.size())) {
    fail_at_byte(path_, header.content,
                 "expected the checksum of the chunk, found that of other bytes");
  }
  header.uncompressed_crc = 0;
  loaded_ = chunk;
  chunk_place_ = path_.string() + ": chunk at byte " + std::to_string(chunk);
  return records_;
}

}  // namespace dynains
