// Compression of blocks of logs.
#pragma once

#include <string>

namespace dynains {

/// Compresses `bytes` so that decompress() reads them. `method` is "lz4" (frame format, as rosbag
/// accepts it), "zstd", "bz2", or empty for none. Throws IoError if this build lacks the library.
std::string compress(const std::string& method, std::string bytes);

}  // namespace dynains
