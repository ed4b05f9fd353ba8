// Writer of MCAP files with messages of ROS 2.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dynains/io/atomic_file.hpp"
#include "log_writer.hpp"
#include "mcap_format.hpp"
#include "raw_file.hpp"

namespace dynains {

/// Writes chunks of some megabytes with their index, without compression, and a summary.
class McapWriter final : public LogWriter {
 public:
  explicit McapWriter(const std::filesystem::path& path);
  /// For a copy, with the record `header` of the other file.
  McapWriter(const std::filesystem::path& path, const std::string& header);

  MessageEncoding encoding() const override { return MessageEncoding::kCdr; }
  std::uint16_t add_channel(const std::string& topic, const MessageType& type) override;
  void write(std::uint16_t channel, std::uint64_t time, const std::string& message) override;
  void commit() override;

  // For copies, which keep ids, times, chunks and compression.
  struct MessageHead {
    std::uint16_t channel = 0;
    std::uint32_t sequence = 0;
    std::uint64_t log_time = 0, publish_time = 0;  ///< ns
  };
  /// Adds the record of a schema or channel to the chunk at work.
  void define(const std::string& record);
  void write(const MessageHead& head, const char* data, std::size_t size);
  void finish_chunk(const std::string& compression);
  /// Copies a record outside of chunks. `index` is what its entry in the summary has behind its
  /// place; without opcode, it has none.
  void copy_record(RawFile& source, std::uint64_t position, std::uint64_t size,
                   std::optional<mcap::Opcode> index_opcode, const std::string& index);

 private:
  struct Entry {
    std::uint64_t time;
    std::uint64_t offset;
  };
  struct ChunkPlace {
    std::uint64_t begin_time, end_time;
    std::uint64_t position, size, compressed_size, records_size;
    std::string compression;
    std::map<std::uint16_t, std::uint64_t> indexes;  ///< position by channel
    std::uint64_t indexes_size;
  };

  void append(const std::string& bytes);
  std::string summary() const;

  AtomicFile file_;
  std::uint64_t position_ = 0;
  std::string definitions_;        ///< records of schemas and channels
  std::set<std::string> defined_;  ///< the same, each once
  std::string records_;            ///< of the chunk at work
  std::map<std::uint16_t, std::vector<Entry>> index_;
  std::uint64_t first_time_ = 0;  ///< of the chunk at work
  std::uint64_t last_time_ = 0;   ///< of the chunk at work
  std::vector<ChunkPlace> chunks_;
  std::map<std::uint16_t, std::uint64_t> counts_;  ///< messages by channel
  std::string other_indexes_;                      ///< records, of attachments and metadata
  std::uint32_t attachments_ = 0;
  std::uint32_t metadata_ = 0;
};

}  // namespace dynains
