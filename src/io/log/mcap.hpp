// Reader of MCAP files (mcap.dev, specification of version 0).
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "chunked_log.hpp"

namespace dynains {

class McapWriter;

class McapFile final : public ChunkedLog {
 public:
  explicit McapFile(const std::filesystem::path& path);
  void copy(const std::filesystem::path& target, MessageEditor& editor) override;

 private:
  std::optional<std::uint64_t> record_size(std::uint64_t position) override;
  bool take_record(std::uint64_t position, std::uint64_t size) override;
  std::optional<Message> parse_record(Bytes& records) override;
  bool is_complete() const override { return has_footer_; }

  void take_chunk(std::uint64_t position, std::uint64_t size);
  void take_message_index(std::uint64_t position, std::uint64_t size);
  void take_definition(std::uint8_t opcode, Bytes fields);
  void copy_record(std::uint64_t position, std::uint64_t size, MessageEditor& editor,
                   McapWriter& writer);

  std::map<std::uint16_t, std::string> schemas_;  ///< type by id
  bool has_footer_ = false;
};

}  // namespace dynains
