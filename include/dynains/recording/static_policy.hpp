// The choice of static objects in the second pass of a run.
#pragma once

#include <array>
#include <cstdint>

namespace dynains {

/// Which objects that stood for a part of the recording are static.
enum class StaticPolicy : std::uint8_t {
  kAlways,  ///< nothing that came or went
  kLast     ///< what stands at the last look, in the scans since it stands
};

/// Names as in options.
constexpr std::array<const char*, 2> value_names(StaticPolicy) { return {"always", "last"}; }

}  // namespace dynains
