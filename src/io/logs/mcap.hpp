// Reader of MCAP files (mcap.dev, specification of version 0).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "chunked_log.hpp"

namespace dynains {

class McapFile final : public ChunkedLog {
 public:
  explicit McapFile(const std::filesystem::path& path);
  void copy_others(McapWriter& writer) override;

 private:
  std::optional<std::uint64_t> record_size(std::uint64_t position) override;
  bool take_record(std::uint64_t position, std::uint64_t size) override;
  std::optional<Message> parse_record(Bytes& records) override;
  bool is_complete() const override { return has_footer_; }

  void take_chunk(std::uint64_t position, std::uint64_t size);
  void take_message_index(std::uint64_t position, std::uint64_t size);
  void take_definition(std::uint8_t opcode, Bytes fields);
  void take_header(std::uint64_t position, std::uint64_t size);

  std::map<std::uint16_t, std::shared_ptr<const LogSchema>> schemas_;  ///< by id
  std::vector<std::uint64_t> others_;  ///< positions of records that belong to no channel
  bool has_footer_ = false;
};

}  // namespace dynains
