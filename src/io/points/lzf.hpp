// Decoder of the LZF compression that PCD files use.
#pragma once

#include <algorithm>
#include <cstddef>

#include "dynains/points.hpp"

namespace dynains {

/// Largest expansion of a stream: 3 bytes copy at most 264.
inline constexpr unsigned kLzfMaxExpansion = 88;

/// Fills `target` from `source`; false unless the stream is valid and fills it exactly. Never reads
/// or writes outside of the two.
///
/// A control byte c < 32 is followed by c + 1 literal bytes. Another control byte copies
/// (c >> 5) + 2 bytes of earlier output; if c >> 5 is 7, the next byte is added to that number. The
/// distance back is ((c & 31) << 8) + the last byte + 1.
inline bool decode_lzf(Span<const char> source, Span<char> target) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(source[i]); };
  std::size_t in = 0;
  std::size_t out = 0;
  while (in < source.size()) {
    const std::size_t control = byte(in++);
    if (control < 32) {
      const std::size_t count = control + 1;
      if (count > source.size() - in || count > target.size() - out) return false;
      std::copy_n(source.data() + in, count, target.data() + out);
      in += count;
      out += count;
      continue;
    }
    std::size_t count = control >> 5;
    if (count == 7) {
      if (in == source.size()) return false;
      count += byte(in++);
    }
    count += 2;
    if (in == source.size()) return false;
    const std::size_t distance = ((control & 31) << 8) + byte(in++) + 1;
    if (distance > out || count > target.size() - out) return false;
    // Source and target overlap if distance < count: copied byte by byte.
    for (std::size_t i = 0; i < count; ++i, ++out) target[out] = target[out - distance];
  }
  return out == target.size();
}

}  // namespace dynains
