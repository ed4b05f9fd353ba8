// The choice of static objects in the second pass of a run.
#pragma once

#include <array>
#include <cstdint>

namespace dynains {

/// Whether objects that were static for a part of the recording stay on the map.
enum class StaticPolicy : std::uint8_t {
  kAlways,  ///< none that came or left
  kLast     ///< those there at the end, in the scans since they came
};

/// Names as in options.
constexpr std::array<const char*, 2> value_names(StaticPolicy) { return {"always", "last"}; }

}  // namespace dynains
