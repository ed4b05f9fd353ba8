// Constants of the MCAP file format, version 0.
#pragma once

#include <cstdint>
#include <string>

namespace dynains::mcap {

/// First and last bytes of a file.
inline const std::string kMagic("\x89MCAP0\r\n", 8);

/// First byte of a record.
enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kDataEnd = 0x0F
};

}  // namespace dynains::mcap
