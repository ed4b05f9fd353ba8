// Compressed blocks of logs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace dynains {

/// Maximum ratio of decompressed to compressed bytes.
inline constexpr std::uint64_t kMaxRatio = 1000;
/// Largest block, and memory for the blocks that are kept, bytes.
inline constexpr std::uint64_t kMaxMemory = std::uint64_t{1} << 28U;

/// Largest size, bytes, of a block that takes `compressed` bytes in a file: 1,000 times as many,
/// within 16 MiB and 256 MiB. Recorders write some megabytes.
std::uint64_t max_decompressed(std::uint64_t compressed);

/// Decompresses all of `input` into `output`, which ends with exactly `size` bytes. `method` is
/// "lz4" (frame format), "zstd" or "bz2". Returns an empty text, or the reason why that is not
/// possible: a `size` above max_decompressed() is one.
std::string decompress(const std::string& method, const std::vector<std::uint8_t>& input,
                       std::uint64_t size, std::vector<std::uint8_t>& output);

/// Replaces a whole frame of zstd by its content, as rosbag2 compresses messages, of at most
/// max_decompressed() bytes; `spare` is memory for that. Other bytes stay. Returns an empty text,
/// or the reason why that is not possible.
std::string decompress_frame(std::vector<std::uint8_t>& bytes, std::vector<std::uint8_t>& spare);

/// Whether this build has zlib, and with it crc32().
bool has_crc32();

/// CRC-32 of zlib; 0 without zlib. MCAP has 0 for a checksum that is not given.
std::uint32_t crc32(const std::uint8_t* data, std::size_t size);

}  // namespace dynains
