// A range of scans.
#pragma once

#include <cstddef>

namespace dynains::program {

/// Which scans of a sequence take part.
struct ScanRange {
  std::size_t first;  ///< index
  std::size_t last;   ///< index, inclusive

  std::size_t size() const { return last - first + 1; }
};

}  // namespace dynains::program
