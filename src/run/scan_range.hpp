// Which scans of a recording take part.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "dynains/io/recording.hpp"
#include "dynains/parameters.hpp"
#include "run/settings/parameter_values.hpp"

namespace dynains::run {

/// Scan numbers, both inclusive; an empty end is that of the recording.
struct ScanWindow {
  std::optional<std::size_t> start;
  std::optional<std::size_t> end;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(TextParameter{"start", self.start, &read_number<std::size_t>, "N",
                          "number of the first scan"});
    visitor(TextParameter{"end", self.end, &read_number<std::size_t>, "N",
                          "number of the last scan (inclusive)"});
  }
};

struct ScanRange {
  std::size_t first;  ///< index
  std::size_t last;   ///< index, inclusive

  std::size_t size() const { return last - first + 1; }
  /// The first, middle and last one.
  std::array<std::size_t, 3> sample() const { return {first, first + size() / 2, last}; }
};

/// All scans of a recording, which has some.
inline ScanRange whole_of(const Recording& recording) { return {0, recording.size() - 1}; }

}  // namespace dynains::run
