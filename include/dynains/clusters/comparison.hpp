// Which clusters of a window are compared.
#pragma once

#include <array>

namespace dynains {

/// Which clusters of a window are compared.
enum class Comparison {
  kEnds,       ///< with points in both the oldest and the newest scan of the window (Eq. 11)
  kAnyBefore,  ///< with points in the newest scan and in any other
};

constexpr std::array<const char*, 2> value_names(Comparison) { return {"ends", "any_before"}; }

}  // namespace dynains
