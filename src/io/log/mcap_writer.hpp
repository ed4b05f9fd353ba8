// Writer of MCAP files with messages of ROS 2.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "dynains/io/atomic_file.hpp"
#include "log_writer.hpp"

namespace dynains {

/// Writes chunks of some megabytes with their index, without compression, and a summary.
class McapWriter final : public LogWriter {
 public:
  explicit McapWriter(const std::filesystem::path& path);

  MessageEncoding encoding() const override { return MessageEncoding::kCdr; }
  std::uint16_t add_channel(const std::string& topic, const MessageType& type) override;
  void write(std::uint16_t channel, std::uint64_t time, const std::string& message) override;
  void commit() override;

 private:
  struct Entry {
    std::uint64_t time;
    std::uint64_t offset;
  };
  struct ChunkPlace {
    std::uint64_t begin_time, end_time;
    std::uint64_t position, size, records_size;
    std::map<std::uint16_t, std::uint64_t> indexes;  ///< position by channel
    std::uint64_t indexes_size;
  };

  void append(const std::string& bytes);
  void finish_chunk();
  std::string summary() const;

  AtomicFile file_;
  std::uint64_t position_ = 0;
  std::string definitions_;  ///< records of schemas and channels
  std::string records_;      ///< of the chunk at work
  std::map<std::uint16_t, std::vector<Entry>> index_;
  std::uint64_t first_time_ = 0;  ///< of the chunk at work
  std::uint64_t last_time_ = 0;
  std::vector<ChunkPlace> chunks_;
  std::vector<std::uint64_t> counts_;  ///< messages by channel
};

}  // namespace dynains
