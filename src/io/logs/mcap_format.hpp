// Constants of the MCAP file format, version 0.
#pragma once

#include <cstdint>
#include <string>

namespace dynains::mcap {

/// First and last bytes of a file.
inline const std::string kMagic("\x89MCAP0\r\n", 8);

/// Records from this opcode on are private to their writers.
inline constexpr std::uint8_t kFirstPrivate = 0x80;

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
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kDataEnd = 0x0F
};

}  // namespace dynains::mcap
