#pragma once

#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

inline constexpr std::size_t kShortPackWidth = 16;
template <class Packs>
struct ShortsOf {
  using Type = typename Packs::Short;
};

}  // namespace dynains::detail
