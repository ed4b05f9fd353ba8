// Decoder of the LZF compression that PCD files use.
#pragma once

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
bool decode_lzf(Span<const char> source, Span<char> target);

}  // namespace dynains
