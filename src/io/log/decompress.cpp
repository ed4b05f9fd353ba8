#include "decompress.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>

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

/// Result of one call of a library: bytes read from the input and written to the output.
struct Step {
  std::size_t taken = 0;
  std::size_t made = 0;
  bool is_end = false;
  std::string error;
};

/// A part of the input, and the room for output.
struct Room {
  const std::uint8_t* input = nullptr;
  std::size_t input_size = 0;
  std::uint8_t* output = nullptr;
  std::size_t output_size = 0;
};

/// Calls `step(room)` until the end or an error, and grows the output as needed.
template <class Decoder>
std::string run(Decoder&& step, const std::vector<std::uint8_t>& input, std::uint64_t size,
                std::vector<std::uint8_t>& output) {
  constexpr std::uint64_t kRoom = std::uint64_t{1} << 20;  // bytes
  std::size_t taken = 0;
  std::size_t made = 0;
  Step last;
  while (last.error.empty() && !last.is_end) {
    if (made == output.size() && made < size) {
      const std::uint64_t wanted = std::max<std::uint64_t>(2 * made, made + kRoom);
      output.resize(static_cast<std::size_t>(std::min(wanted, size)));
    }
    last = step(Room{input.data() + taken, input.size() - taken, output.data() + made,
                     output.size() - made});
    taken += last.taken;
    made += last.made;
    if (last.error.empty() && !last.is_end && last.taken == 0 && last.made == 0) {
      last.error = taken == input.size() ? "the block ends early" : "more bytes than announced";
    }
  }
  output.resize(made);
  if (!last.error.empty()) return last.error;
  if (made == size) return {};
  return "expected " + std::to_string(size) + " bytes, found " + std::to_string(made);
}

#if defined(DYNAINS_HAS_LZ4)
std::string decompress_lz4(const std::vector<std::uint8_t>& input, std::uint64_t size,
                           std::vector<std::uint8_t>& output) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) {
    return "lz4 cannot be initialised";
  }
  const auto step = [&](const Room& room) {
    Step result{room.input_size, room.output_size, false, {}};
    const std::size_t hint =
        LZ4F_decompress(context, room.output, &result.made, room.input, &result.taken, nullptr);
    result.is_end = hint == 0;
    if (LZ4F_isError(hint) != 0) result.error = LZ4F_getErrorName(hint);
    return result;
  };
  const std::string error = run(step, input, size, output);
  LZ4F_freeDecompressionContext(context);
  return error;
}
#endif

#if defined(DYNAINS_HAS_ZSTD)
std::string decompress_zstd(const std::vector<std::uint8_t>& input, std::uint64_t size,
                            std::vector<std::uint8_t>& output) {
  ZSTD_DStream* const stream = ZSTD_createDStream();
  if (stream == nullptr) return "zstd cannot be initialised";
  const auto step = [&](const Room& room) {
    ZSTD_inBuffer in{room.input, room.input_size, 0};
    ZSTD_outBuffer out{room.output, room.output_size, 0};
    const std::size_t hint = ZSTD_decompressStream(stream, &out, &in);
    const bool is_end = hint == 0 && in.pos == in.size;
    return Step{in.pos, out.pos, is_end,
                ZSTD_isError(hint) != 0 ? ZSTD_getErrorName(hint) : std::string()};
  };
  const std::string error = run(step, input, size, output);
  ZSTD_freeDStream(stream);
  return error;
}
#endif

#if defined(DYNAINS_HAS_BZ2)
std::string decompress_bz2(const std::vector<std::uint8_t>& input, std::uint64_t size,
                           std::vector<std::uint8_t>& output) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return "bz2 cannot be initialised";
  const auto step = [&](const Room& room) {
    // The library has no const, and counts in 32 bits; chunks are smaller.
    stream.next_in = reinterpret_cast<char*>(const_cast<std::uint8_t*>(room.input));
    stream.avail_in = static_cast<unsigned>(room.input_size);
    stream.next_out = reinterpret_cast<char*>(room.output);
    stream.avail_out = static_cast<unsigned>(room.output_size);
    const int result = BZ2_bzDecompress(&stream);
    Step made{room.input_size - stream.avail_in,
              room.output_size - stream.avail_out,
              result == BZ_STREAM_END,
              {}};
    if (result != BZ_OK && result != BZ_STREAM_END) made.error = "no valid bz2 data";
    return made;
  };
  const std::string error = run(step, input, size, output);
  BZ2_bzDecompressEnd(&stream);
  return error;
}
#endif

}  // namespace

std::uint64_t most_decompressed(std::uint64_t compressed) {
  constexpr std::uint64_t kSmall = std::uint64_t{1} << 24U;
  constexpr std::uint64_t kLargest = std::uint64_t{1} << 28U;
  return std::clamp(std::min(compressed, kLargest) * kLargestRatio, kSmall, kLargest);
}

std::string decompress(const std::string& method,
                       [[maybe_unused]] const std::vector<std::uint8_t>& input,
                       [[maybe_unused]] std::uint64_t size, std::vector<std::uint8_t>& output) {
  output.clear();
#if defined(DYNAINS_HAS_LZ4)
  if (method == "lz4") return decompress_lz4(input, size, output);
#endif
#if defined(DYNAINS_HAS_ZSTD)
  if (method == "zstd") return decompress_zstd(input, size, output);
#endif
#if defined(DYNAINS_HAS_BZ2)
  if (method == "bz2") return decompress_bz2(input, size, output);
#endif
  for (const std::string known : {"lz4", "zstd", "bz2"}) {
    if (method == known) return "this build has no " + known + " (Debian: lib" + known + "-dev)";
  }
  return "expected lz4, zstd, bz2 or none, found \"" + method + '"';
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
  if (size == ZSTD_CONTENTSIZE_UNKNOWN) return "expected a frame of zstd that tells its size";
  const std::uint64_t most = most_decompressed(bytes.size());
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
