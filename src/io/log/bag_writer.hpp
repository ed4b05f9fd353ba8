// Writer of bags of ROS 1 (version 2.0).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "dynains/io/atomic_file.hpp"
#include "log_writer.hpp"

namespace dynains {

/// Writes chunks of some megabytes with their index, without compression.
class BagWriter final : public LogWriter {
 public:
  explicit BagWriter(const std::filesystem::path& path);

  MessageEncoding encoding() const override { return MessageEncoding::kRos1; }
  std::uint16_t add_channel(const std::string& topic, const MessageType& type) override;
  void write(std::uint16_t channel, std::uint64_t time, const std::string& message) override;
  void commit() override;

  // For copies, which keep connections, chunks and compression.
  /// Adds the record of a connection to the chunk at work.
  void define(std::uint32_t connection, const std::string& record);
  void write(std::uint32_t connection, std::uint64_t time, const char* data, std::size_t size);
  /// `compression`: "lz4", "bz2" or empty.
  void finish_chunk(const std::string& compression);

 private:
  struct Entry {
    std::uint64_t time;    ///< ns
    std::uint32_t offset;  ///< bytes from the begin of the chunk
  };
  using Index = std::map<std::uint32_t, std::vector<Entry>>;

  void append(const std::string& bytes);
  std::string file_header() const;

  AtomicFile file_;
  std::uint64_t position_ = 0;
  std::map<std::uint32_t, std::string> connections_;  ///< records
  std::string records_;                               ///< of the chunk at work
  Index index_;                                       ///< of the chunk at work
  std::string chunk_infos_;                           ///< records
  std::uint32_t chunk_count_ = 0;
  std::uint64_t index_position_ = 0;  ///< 0 until the end
};

}  // namespace dynains
