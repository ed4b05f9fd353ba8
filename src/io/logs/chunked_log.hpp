// Logs that are records in a file, most of them in compressed chunks: MCAP and bags of ROS 1.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "decompress.hpp"
#include "log_file.hpp"

namespace dynains {

/// The part that both formats have in common. A chunk is followed by an index of its messages. A
/// chunk without index, and the last chunk of a file that ends early, is decompressed for its
/// messages. So a file is read in the same way whether its summary was written or not.
///
/// Memory is bounded by the size of the file: 100 bytes of index for each byte, and 256 MiB of
/// uncompressed chunks, of which each is at most max_decompressed() of its size. Work, too: 1,000
/// decompressed bytes for each byte of the file and of messages that are read.
class ChunkedLog : public LogFile {
 public:
  MessageStamp read(const LogMessage& message, std::vector<std::uint8_t>& bytes) override {
    const auto chunk = chunks_.find(message.block);
    const bool is_lone = chunk == chunks_.end();
    if (is_lone) {
      file_.read_at(message.block, record_size(message.block).value_or(0), "a message",
                    compressed_);
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
    delivered_ += bytes.size();
    return found->stamp;
  }
  void release() override {
    loaded_.clear();
    compressed_ = {};
  }

 protected:
  /// The part of the header of a chunk that reading needs.
  struct Chunk {
    std::uint64_t content = 0;  ///< byte of the compressed records
    std::uint64_t compressed_size = 0;
    std::uint64_t uncompressed_size = 0;
    std::uint32_t uncompressed_crc = 0;  ///< 0: not given, or compared already
    std::string compression;             ///< empty: none
    bool has_index = false;
    std::uint64_t decompression = 0;  ///< number of the last one
  };
  struct Message {
    std::uint32_t channel = 0;
    std::uint64_t time = 0;  ///< ns
    MessageStamp stamp;
    Bytes payload;
  };

  explicit ChunkedLog(const std::filesystem::path& path) : LogFile(path), file_(path) {}

  /// Bytes of the record at `position` of the file; nothing if the file ends before its end.
  virtual std::optional<std::uint64_t> record_size(std::uint64_t position) = 0;
  /// Reads a record of the file for the index. False at the end of the records. `head`: its first
  /// bytes, at most kMaxHead, which are all fields before its data: names are short.
  virtual bool take_record(std::uint64_t position, std::uint64_t size, Bytes head) = 0;
  /// Takes the next record out of a block of records. Gives the message, if it is one; adds the
  /// channel, if it defines one.
  virtual std::optional<Message> parse_record(Bytes& records) = 0;
  /// Whether nothing is missing behind the last record.
  virtual bool is_complete() const = 0;

  /// Reads all records of the file, which begins with `magic`. Throws IoError with `expectation`
  /// for another begin.
  void read_index(const std::string& magic, const std::string& expectation) {
    const FilePart begin(file_, 0, std::min<std::uint64_t>(file_.size(), magic.size()),
                         "magic bytes");
    if (!begin.fields.begins_with(magic)) begin.fields.fail(expectation);
    std::uint64_t position = magic.size();
    bool goes_on = true;
    while (goes_on && position < file_.size()) {
      const std::optional<std::uint64_t> size = record_size(position);
      if (!size) break;
      const FilePart head(file_, position, std::min(*size, kMaxHead), "a record");
      goes_on = take_record(position, *size, head.fields);
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

  // For take_record().
  /// Begins a chunk, named by the byte of its record. Throws for sizes that cannot be.
  void add_chunk(std::uint64_t position, Chunk header) {
    const auto check = [&](std::uint64_t size, std::uint64_t most) {
      if (size <= most) return;
      fail_at_byte(path_, position,
                   "expected a chunk of at most " + std::to_string(most) +
                       " bytes, found the size " + std::to_string(size));
    };
    check(header.compressed_size, file_.size() - header.content);
    check(header.uncompressed_size, max_decompressed(header.compressed_size));
    chunks_[position] = std::move(header);
    last_chunk_ = position;
    first_of_last_ = entries_.size();
  }
  /// Ends the index of the last chunk: another record follows.
  void finish_chunk() {
    const std::uint64_t chunk = std::exchange(last_chunk_, 0);
    if (chunk != 0 && !chunks_[chunk].has_index) read_chunk_records(chunk, true);
  }
  /// A message of the last chunk, by its index.
  void add_indexed(std::uint32_t channel, std::uint64_t time, std::uint64_t offset) {
    if (last_chunk_ == 0) return;
    chunks_[last_chunk_].has_index = true;
    count_record(last_chunk_);
    entries_.push_back({time, last_chunk_, offset, channel});
  }
  void add_message(std::uint32_t channel, std::uint64_t time, std::uint64_t position) {
    entries_.push_back({time, position, 0, channel});
  }
  void add_channel(std::uint32_t id, LogTopic channel) { channels_[id] = std::move(channel); }

  static constexpr std::uint64_t kMaxHead = 4096;  ///< bytes

  ByteReader file_;

 private:
  static constexpr std::size_t kMaxChunks = 16;  ///< that are kept if their messages alternate

  /// A message before all channels are known.
  struct Entry {
    std::uint64_t time;
    std::uint64_t block;
    std::uint64_t offset;
    std::uint32_t channel;
  };

  /// The uncompressed records of a chunk.
  struct LoadedChunk {
    std::uint64_t chunk = 0;     ///< byte of its record
    std::uint64_t last_use = 0;  ///< number of the load
    std::vector<std::uint8_t> records;
  };

  /// Records take more than a byte each, also in compressed chunks.
  void count_record(std::uint64_t block) {
    if (++records_ > file_.size()) {
      fail_at_byte(path_, block, "expected at most one record for each byte of the log");
    }
  }
  /// Some of the index may be missing at the end of a file.
  void drop_index_of_last_chunk() {
    if (last_chunk_ == 0) return;
    chunks_[last_chunk_].has_index = false;
    entries_.resize(first_of_last_);
  }
  /// Adds the channels of a chunk, and its messages if asked for.
  void read_chunk_records(std::uint64_t chunk, bool with_messages) {
    const std::vector<std::uint8_t>& records = load(chunk);
    Bytes rest(chunk_place_, 0, records.data(), records.size());
    while (rest.remaining() > 0) {
      const std::uint64_t offset = rest.position();
      const std::optional<Message> message = parse_record(rest);
      if (!with_messages) continue;
      count_record(chunk);
      if (message) entries_.push_back({message->time, chunk, offset, message->channel});
    }
  }
  /// Without a summary, channels are defined in chunks only.
  void find_missing_channels() {
    std::uint64_t last = 0;
    for (const Entry& entry : entries_) {
      if (entry.block == last || channels_.count(entry.channel) != 0) continue;
      last = entry.block;
      if (chunks_.count(entry.block) != 0) read_chunk_records(entry.block, false);
    }
  }
  void make_messages() {
    std::map<std::uint32_t, std::uint32_t> topic_of;
    for (const auto& [id, channel] : channels_) topic_of[id] = add_topic(channel);
    messages_.reserve(entries_.size());
    for (const Entry& entry : entries_) {
      const auto topic = topic_of.find(entry.channel);
      if (topic == topic_of.end()) {
        fail_at_byte(path_, entry.block,
                     "expected a message of a known channel, found channel " +
                         std::to_string(entry.channel));
      }
      messages_.push_back({entry.time, entry.block, entry.offset, topic->second, 0});
    }
    entries_ = {};
  }
  /// The uncompressed records of a chunk; the last ones are kept.
  const std::vector<std::uint8_t>& load(std::uint64_t chunk) {
    const auto is_wanted = [chunk](const LoadedChunk& loaded) { return loaded.chunk == chunk; };
    auto loaded = std::find_if(loaded_.begin(), loaded_.end(), is_wanted);
    if (loaded == loaded_.end()) {
      LoadedChunk& free = make_room(chunks_.at(chunk).uncompressed_size);
      free.chunk = 0;
      decompress_to(chunk, free.records);
      free.chunk = chunk;
      loaded = loaded_.begin() + (&free - loaded_.data());
    }
    loaded->last_use = ++loads_;
    chunk_place_ = path_.string() + ": chunk at byte " + std::to_string(chunk);
    return loaded->records;
  }
  /// A place for a chunk of `size` bytes: a new one, or that of the chunk that was not used
  /// longest.
  LoadedChunk& make_room(std::uint64_t size) {
    const auto is_older = [](const LoadedChunk& a, const LoadedChunk& b) {
      return a.last_use < b.last_use;
    };
    std::uint64_t kept = 0;
    for (const LoadedChunk& loaded : loaded_) kept += loaded.records.capacity();
    std::optional<LoadedChunk> reused;
    while (!loaded_.empty() && (kept + size > kMaxMemory || loaded_.size() >= wanted_chunks_)) {
      const auto oldest = std::min_element(loaded_.begin(), loaded_.end(), is_older);
      kept -= oldest->records.capacity();
      if (oldest->records.capacity() <= 2 * size) reused = std::move(*oldest);
      loaded_.erase(oldest);
    }
    loaded_.push_back(reused ? std::move(*reused) : LoadedChunk());
    return loaded_.back();
  }
  void decompress_to(std::uint64_t chunk, std::vector<std::uint8_t>& records) {
    Chunk& header = chunks_.at(chunk);
    ++decompressions_;
    // Chunks are decompressed again if the messages of many alternate.
    decompressed_ += header.uncompressed_size;
    if (decompressed_ > kMaxMemory + kMaxRatio * (file_.size() + delivered_)) {
      fail_at_byte(path_, chunk,
                   "expected chunks one after another, found messages that alternate");
    }
    const std::uint64_t before = std::exchange(header.decompression, decompressions_);
    if (before != 0 && decompressions_ - before <= kMaxChunks) wanted_chunks_ = kMaxChunks;
    file_.read_at(header.content, header.compressed_size, "a chunk", compressed_);
    if (header.compression.empty()) {
      records.swap(compressed_);
      if (records.size() != header.uncompressed_size) {
        fail_at_byte(path_, chunk,
                     "expected a chunk of " + std::to_string(header.uncompressed_size) +
                         " bytes, found " + std::to_string(records.size()));
      }
    } else {
      const std::string obstacle =
          decompress(header.compression, compressed_, header.uncompressed_size, records);
      if (!obstacle.empty()) fail_at_byte(path_, header.content, "compressed chunk: " + obstacle);
    }
    if (has_crc32() && header.uncompressed_crc != 0 &&
        header.uncompressed_crc != crc32(records.data(), records.size())) {
      fail_at_byte(path_, header.content,
                   "expected the checksum of the chunk, found that of other bytes");
    }
    header.uncompressed_crc = 0;
  }

  std::map<std::uint32_t, LogTopic> channels_;  ///< several may have one topic
  std::map<std::uint64_t, Chunk> chunks_;       ///< by byte of the record
  std::vector<Entry> entries_;
  // No record is at byte 0.
  std::uint64_t last_chunk_ = 0;   ///< the chunk whose index is read; 0: none
  std::size_t first_of_last_ = 0;  ///< its first entry
  std::vector<LoadedChunk> loaded_;
  std::size_t wanted_chunks_ = 1;  ///< more if the messages of chunks alternate in time
  std::uint64_t loads_ = 0;
  std::uint64_t decompressions_ = 0;
  std::uint64_t decompressed_ = 0;  ///< bytes
  std::uint64_t delivered_ = 0;     ///< bytes of messages
  std::uint64_t records_ = 0;       ///< that the index has met
  std::vector<std::uint8_t> compressed_;
  std::filesystem::path chunk_place_;  ///< path and byte of the last chunk, for errors
};

}  // namespace dynains
