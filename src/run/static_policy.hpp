// What the second pass of a run calls static.
#pragma once

#include <cstdint>

namespace dynains::program {

/// What of the things that stood for a while is static.
enum class StaticPolicy : std::uint8_t {
  kAlways,  ///< nothing that came or went
  kLast     ///< what stands at the last look, in the scans since it stands
};

}  // namespace dynains::program
