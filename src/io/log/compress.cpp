#include "compress.hpp"

#include <cstddef>

#include "dynains/errors.hpp"

#if defined(DYNAINS_HAS_BZ2)
#include <bzlib.h>
#endif
#if defined(DYNAINS_HAS_LZ4)
#include <lz4frame.h>
#endif
#if defined(DYNAINS_HAS_ZSTD)
#include <zstd.h>
#endif

namespace dynains {
namespace {

[[noreturn]] void fail_to_compress(const std::string& method, const std::string& reason) {
  throw IoError("a chunk of a log cannot be compressed by " + method + ": " + reason);
}

#if defined(DYNAINS_HAS_LZ4)
/// rosbag accepts independent blocks with a checksum of the content alone.
std::string compress_lz4(const std::string& bytes) {
  LZ4F_preferences_t preferences{};
  preferences.frameInfo.blockMode = LZ4F_blockIndependent;
  preferences.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
  std::string result(LZ4F_compressFrameBound(bytes.size(), &preferences), '\0');
  const std::size_t size =
      LZ4F_compressFrame(result.data(), result.size(), bytes.data(), bytes.size(), &preferences);
  if (LZ4F_isError(size) != 0) fail_to_compress("lz4", LZ4F_getErrorName(size));
  result.resize(size);
  return result;
}
#endif

#if defined(DYNAINS_HAS_ZSTD)
std::string compress_zstd(const std::string& bytes) {
  constexpr int kLevel = 3;  // the default of the library
  std::string result(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(result.data(), result.size(), bytes.data(), bytes.size(), kLevel);
  if (ZSTD_isError(size) != 0) fail_to_compress("zstd", ZSTD_getErrorName(size));
  result.resize(size);
  return result;
}
#endif

#if defined(DYNAINS_HAS_BZ2)
std::string compress_bz2(std::string bytes) {
  constexpr int kBlockSize = 9;  // 100 kB, as rosbag
  // The library has no const, and counts in 32 bits; chunks are smaller.
  std::string result(bytes.size() + bytes.size() / 100 + 600, '\0');
  auto size = static_cast<unsigned>(result.size());
  const int error = BZ2_bzBuffToBuffCompress(result.data(), &size, bytes.data(),
                                             static_cast<unsigned>(bytes.size()), kBlockSize, 0, 0);
  if (error != BZ_OK) fail_to_compress("bz2", "error " + std::to_string(error));
  result.resize(size);
  return result;
}
#endif

}  // namespace

std::string compress(const std::string& method, std::string bytes) {
  if (method.empty()) return bytes;
#if defined(DYNAINS_HAS_LZ4)
  if (method == "lz4") return compress_lz4(bytes);
#endif
#if defined(DYNAINS_HAS_ZSTD)
  if (method == "zstd") return compress_zstd(bytes);
#endif
#if defined(DYNAINS_HAS_BZ2)
  if (method == "bz2") return compress_bz2(std::move(bytes));
#endif
  fail_to_compress(method, "this build has no library for it");
}

}  // namespace dynains
