// Compressed blocks of logs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace dynains {

/// Decompresses all of `input` into `output`, which ends with exactly `size` bytes. `method` is
/// "lz4" (frame format), "zstd" or "bz2". Memory grows with the bytes that are really there, not
/// with `size`. Returns an empty text, or the reason why that is not possible.
std::string decompress(const std::string& method, const std::vector<std::uint8_t>& input,
                       std::uint64_t size, std::vector<std::uint8_t>& output);

/// CRC-32 as in zlib and PNG.
std::uint32_t crc32(const std::uint8_t* data, std::size_t size);

}  // namespace dynains
