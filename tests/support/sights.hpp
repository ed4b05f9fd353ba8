// What a reference saw, written down sample by sample.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/beam_test.hpp"

namespace dynains::test {

enum class Sight : std::uint8_t { kNothing, kFree, kHit };

inline detail::Sights sights_of(const std::vector<Sight>& seen) {
  detail::Sights sights;
  sights.resize(seen.size());
  const detail::Sights::Bytes bytes = sights.bytes();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto set = [i](std::uint8_t* to, bool value) {
      const unsigned others = i % 8 == 0 ? 0U : to[i / 8];
      to[i / 8] = static_cast<std::uint8_t>(others | (value ? 1U : 0U) << i % 8);
    };
    set(bytes.free, seen[i] == Sight::kFree);
    set(bytes.hit, seen[i] == Sight::kHit);
  }
  return sights;
}

}  // namespace dynains::test
