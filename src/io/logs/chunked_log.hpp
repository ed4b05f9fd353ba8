// Logs that are records in a file, most of them in compressed chunks: MCAP and bags of ROS 1.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "../byte_reader.hpp"
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
  MessageStamp read(const LogMessage& message, std::vector<std::uint8_t>& bytes) override;
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
  /// Reads a record of the file for the index. False at the end of the records.
  virtual bool take_record(std::uint64_t position, std::uint64_t size) = 0;
  /// Takes the next record out of a block of records. Gives the message, if it is one; adds the
  /// channel, if it defines one.
  virtual std::optional<Message> parse_record(Bytes& records) = 0;
  /// Whether nothing is missing behind the last record.
  virtual bool is_complete() const = 0;

  /// Reads all records of the file, which begins with `magic`. Throws IoError with `expectation`
  /// for another begin.
  void read_index(const std::string& magic, const std::string& expectation);

  // For take_record().
  /// Begins a chunk, named by the byte of its record. Throws for sizes that cannot be.
  void add_chunk(std::uint64_t position, Chunk header);
  /// Ends the index of the last chunk: another record follows.
  void finish_chunk();
  /// A message of the last chunk, by its index.
  void add_indexed(std::uint32_t channel, std::uint64_t time, std::uint64_t offset);
  void add_message(std::uint32_t channel, std::uint64_t time, std::uint64_t position) {
    entries_.push_back({time, position, 0, channel});
  }
  void add_channel(std::uint32_t id, LogTopic channel) { channels_[id] = std::move(channel); }

  /// Bytes from which the fields before the data of a record are read: names are short.
  static constexpr std::uint64_t kMaxHead = 4096;

  ByteReader file_;

 private:
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

  void count_record(std::uint64_t block);
  void drop_index_of_last_chunk();
  void read_chunk_records(std::uint64_t chunk, bool with_messages);
  void find_missing_channels();
  void make_messages();
  const std::vector<std::uint8_t>& load(std::uint64_t chunk);
  LoadedChunk& make_room(std::uint64_t size);
  void decompress_to(std::uint64_t chunk, std::vector<std::uint8_t>& records);

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
