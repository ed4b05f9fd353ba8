#include "decompress.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>

#if defined(DYNAINS_HAS_BZ2)
#include <bzlib.h>
#endif
#if defined(DYNAINS_HAS_LZ4)
#include <lz4frame.h>
#endif
#if defined(DYNAINS_HAS_Z)
#include <zlib.h>
#endif
#if defined(DYNAINS_HAS_ZSTD)
#include <zstd.h>
#endif

namespace dynains {
namespace {

using Block = std::vector<std::uint8_t>;

/// Bytes that were made, or an error.
struct Decompressed {
  std::size_t size = 0;
  std::string error;
};

#if defined(DYNAINS_HAS_LZ4)
Decompressed decompress_lz4(const Block& input, Block& output) {
  Decompressed result;
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) {
    return {0, "lz4 cannot be initialised"};
  }
  std::size_t taken = 0;
  bool is_end = false;
  while (!is_end && result.error.empty()) {
    std::size_t in = input.size() - taken;
    std::size_t out = output.size() - result.size;
    const std::size_t hint = LZ4F_decompress(context, output.data() + result.size, &out,
                                             input.data() + taken, &in, nullptr);
    taken += in;
    result.size += out;
    is_end = hint == 0;
    if (LZ4F_isError(hint) != 0) result.error = LZ4F_getErrorName(hint);
    if (!is_end && in == 0 && out == 0) result.error = "the block ends early, or is longer";
  }
  LZ4F_freeDecompressionContext(context);
  return result;
}
#endif

#if defined(DYNAINS_HAS_ZSTD)
Decompressed decompress_zstd(const Block& input, Block& output) {
  const std::size_t size =
      ZSTD_decompress(output.data(), output.size(), input.data(), input.size());
  if (ZSTD_isError(size) != 0) return {0, ZSTD_getErrorName(size)};
  return {size, {}};
}
#endif

#if defined(DYNAINS_HAS_BZ2)
Decompressed decompress_bz2(const Block& input, Block& output) {
  // The library has no const, and counts in 32 bits; a longer input ends early.
  const std::size_t most = std::numeric_limits<unsigned>::max();
  auto size = static_cast<unsigned>(output.size());
  const int error =
      BZ2_bzBuffToBuffDecompress(reinterpret_cast<char*>(output.data()), &size,
                                 reinterpret_cast<char*>(const_cast<std::uint8_t*>(input.data())),
                                 static_cast<unsigned>(std::min(input.size(), most)), 0, 0);
  if (error != BZ_OK) return {0, "no valid bz2 data, or longer"};
  return {size, {}};
}
#endif

}  // namespace

std::uint64_t max_decompressed(std::uint64_t compressed) {
  constexpr std::uint64_t kSmall = std::uint64_t{1} << 24U;
  return std::clamp(std::min(compressed, kMaxMemory) * kMaxRatio, kSmall, kMaxMemory);
}

std::string decompress(const std::string& method, const Block& input, std::uint64_t size,
                       Block& output) {
  output.resize(static_cast<std::size_t>(std::min(size, max_decompressed(input.size()))));
  Decompressed result{0, "expected lz4, zstd, bz2 or none, found \"" + method + '"'};
  for (const std::string known : {"lz4", "zstd", "bz2"}) {
    if (method != known) continue;
    result.error = "this build has no " + known + " (Debian: lib" + known + "-dev)";
  }
#if defined(DYNAINS_HAS_LZ4)
  if (method == "lz4") result = decompress_lz4(input, output);
#endif
#if defined(DYNAINS_HAS_ZSTD)
  if (method == "zstd") result = decompress_zstd(input, output);
#endif
#if defined(DYNAINS_HAS_BZ2)
  if (method == "bz2") result = decompress_bz2(input, output);
#endif
  if (!result.error.empty() || result.size == size) return result.error;
  return "expected " + std::to_string(size) + " bytes, found " + std::to_string(result.size);
}

std::string decompress_frame(std::vector<std::uint8_t>& bytes, std::vector<std::uint8_t>& spare) {
  constexpr std::uint8_t kMagic[] = {0x28, 0xB5, 0x2F, 0xFD};
  if (bytes.size() < sizeof(kMagic) ||
      !std::equal(std::begin(kMagic), std::end(kMagic), bytes.begin())) {
    return {};
  }
#if defined(DYNAINS_HAS_ZSTD)
  const auto size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == ZSTD_CONTENTSIZE_ERROR) return "expected a frame of zstd";
  if (size == ZSTD_CONTENTSIZE_UNKNOWN) return "expected a frame of zstd that states its size";
  const std::uint64_t most = max_decompressed(bytes.size());
  if (size > most) {
    return "expected a frame of zstd of at most " + std::to_string(most) + " bytes, found " +
           std::to_string(size);
  }
  std::string error = decompress("zstd", bytes, size, spare);
  bytes.swap(spare);
  return error;
#else
  static_cast<void>(spare);
  return "this build has no zstd (Debian: libzstd-dev)";
#endif
}

bool has_crc32() {
#if defined(DYNAINS_HAS_Z)
  return true;
#else
  return false;
#endif
}

std::uint32_t crc32([[maybe_unused]] const std::uint8_t* data, [[maybe_unused]] std::size_t size) {
#if defined(DYNAINS_HAS_Z)
  return size == 0 ? 0 : static_cast<std::uint32_t>(::crc32_z(0, data, size));
#else
  return 0;
#endif
}

}  // namespace dynains
