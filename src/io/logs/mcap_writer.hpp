// Writer of MCAP files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "../byte_reader.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/points.hpp"
#include "log_file.hpp"

namespace dynains {

/// The file format, version 0.
namespace mcap {

/// First and last bytes of a file.
inline const std::string kMagic("\x89MCAP0\r\n", 8);

/// First byte of a record, in the order of the specification, from 1 to 15. Records from 0x80 on
/// are private to their writers.
enum Opcode : std::uint8_t {
  kNone,
  kHeader,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd
};

}  // namespace mcap

/// Writes chunks of some megabytes with their index, and a summary. The file appears whole, at
/// `commit()`, or not at all. All members throw IoError.
class McapWriter {
 public:
  enum class Compression : std::uint8_t { kNone, kZstd };

  /// `profile`: "ros1" or "ros2". `compression`: of chunks; none if this build lacks it.
  explicit McapWriter(const std::filesystem::path& path, const std::string& profile = "ros2",
                      Compression compression = Compression::kNone);

  /// At most 65,535 times.
  std::uint16_t add_channel(const LogTopic& topic);
  /// `time`: ns, when the message was recorded.
  void write(std::uint16_t channel, std::uint64_t time, const MessageStamp& stamp,
             Span<const char> message);
  void write(std::uint16_t channel, std::uint64_t time, const std::string& message) {
    write(channel, time, {time, 0}, message);
  }
  /// Copies a record that belongs to no channel. `index` is what its entry in the summary has
  /// behind its place; without `index_opcode`, it has none.
  void copy_record(ByteReader& source, std::uint64_t position, std::uint64_t size,
                   std::optional<mcap::Opcode> index_opcode, const std::string& index);
  void commit();

 private:
  struct Entry {
    std::uint64_t time;
    std::uint64_t offset;
  };
  std::uint16_t add_schema(const LogSchema& schema);
  void define(const std::string& record);
  void finish_chunk();
  void append(const std::string& bytes);
  std::string summary() const;

  AtomicFile file_;
  Compression compression_;
  std::uint64_t position_ = 0;
  std::string definitions_;                       ///< records of schemas and channels
  std::map<std::string, std::uint16_t> schemas_;  ///< id by content
  std::string records_;                           ///< of the chunk at work
  std::map<std::uint16_t, std::vector<Entry>> index_;
  std::uint64_t first_time_ = 0;  ///< of the chunk at work
  std::uint64_t last_time_ = 0;   ///< of the chunk at work
  std::uint64_t begin_time_ = 0;  ///< of the chunks before
  std::uint64_t end_time_ = 0;    ///< of the chunks before
  std::uint32_t chunk_count_ = 0;
  std::string chunk_indexes_;                      ///< records
  std::map<std::uint16_t, std::uint64_t> counts_;  ///< messages by channel
  std::string other_indexes_;                      ///< records, of attachments and metadata
  std::uint32_t attachments_ = 0;
  std::uint32_t metadata_ = 0;
};

}  // namespace dynains
