// The verdict on a scan by runs of points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/verdict.hpp"
#include "verdict_arrays.hpp"

namespace dynains::program {

/// Runs of consecutive points with one label, cause and instance: a fraction of the bytes.
struct VerdictRuns {
  std::vector<std::uint32_t> ends;  ///< index behind the last point of the run
  std::vector<std::uint32_t> instances;
  std::vector<PointLabel> labels;
  std::vector<Cause> causes;

  void assign(const VerdictArrays& verdict);
  /// Whether the arrays fit together. The members below need it.
  bool is_valid() const;
  std::size_t points() const { return ends.empty() ? 0 : ends.back(); }
  /// Calls `visit(run, first_point, count)` for each run.
  template <class Visit>
  void for_each(Visit&& visit) const {
    std::size_t first = 0;
    for (std::size_t run = 0; run < ends.size(); ++run) {
      visit(run, first, ends[run] - first);
      first = ends[run];
    }
  }
  /// Writes labels, causes and instances of all points.
  void expand(VerdictArrays& verdict) const;
};

}  // namespace dynains::program
