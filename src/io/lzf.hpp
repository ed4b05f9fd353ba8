// Decoder of the LZF compression that PCD files use.
#pragma once

#include <vector>

#include "dynains/points.hpp"

namespace dynains {

/// No stream expands more than this: 3 bytes copy at most 264.
inline constexpr unsigned kLzfMaxExpansion = 88;

/// Fills `target` from `source`; false unless the stream is sound and fills it exactly. Never
/// reads or writes outside of the two.
///
/// A control byte c < 32 is followed by c + 1 bytes as they are. Otherwise a run of
/// (c >> 5) + 2 bytes is copied from earlier output, and a value of 7 for c >> 5 is increased by
/// the next byte; the distance is ((c & 31) << 8) + the last byte + 1.
bool decode_lzf(Span<const char> source, Span<char> target);

}  // namespace dynains
