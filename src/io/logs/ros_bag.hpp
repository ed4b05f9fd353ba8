// Reader of bags of ROS 1 (wiki.ros.org/Bags/Format/2.0).
#pragma once

#include <cstdint>

#include "chunked_log.hpp"

namespace dynains {

class RosBag final : public ChunkedLog {
 public:
  explicit RosBag(const std::filesystem::path& path);

 private:
  std::optional<std::uint64_t> record_size(std::uint64_t position) override;
  bool take_record(std::uint64_t position, std::uint64_t size) override;
  std::optional<Message> parse_record(Bytes& records) override;
  /// A recorder writes the place of the index, and the number of chunks, when it closes the bag.
  bool is_complete() const override { return has_index_ && chunk_infos_ == announced_chunks_; }

  void take_bag_header(std::uint64_t position, const Bytes& header);
  void take_chunk(std::uint64_t position, const Bytes& header, Bytes& rest);
  void take_index(std::uint64_t position, std::uint64_t size);
  void take_connection(const Bytes& header, Bytes content);

  bool has_index_ = false;
  std::uint32_t announced_chunks_ = 0;
  std::uint32_t chunk_infos_ = 0;
};

}  // namespace dynains
