#include "dynains/evaluation/point_protocol.hpp"

#include <array>
#include <string>

#include "detail/range_gate.hpp"
#include "dynains/errors.hpp"

namespace dynains::evaluation {

PointProtocol::PointProtocol(const Settings& settings, std::size_t estimates)
    : settings_(settings), scores_(estimates) {
  detail::RangeGate(settings.min_range, settings.max_range);
  if (estimates > kMaxEstimates) {
    throw ConfigError("PointProtocol evaluates at most " + std::to_string(kMaxEstimates) +
                      " estimates at once");
  }
}

void PointProtocol::add(const LabelledScan& scan) {
  const detail::RangeGate gate(settings_.min_range, settings_.max_range);
  // Numbers of points by truth and LabelledScan::in_map.
  std::array<std::array<std::uint32_t, 256>, 3> counts{};
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const auto truth = static_cast<std::size_t>(settings_.truth(scan.truth[i]));
    counts[truth][scan.in_map.empty() ? 0 : scan.in_map[i]] +=
        gate.passes(scan.xyz + i * scan.stride);
  }
  for (std::size_t in_map = 0; in_map < 256; ++in_map) {
    const std::uint32_t of_static = counts[static_cast<std::size_t>(Truth::kStatic)][in_map];
    const std::uint32_t of_dynamic = counts[static_cast<std::size_t>(Truth::kDynamic)][in_map];
    totals_.static_total += of_static;
    totals_.dynamic_total += of_dynamic;
    for (std::size_t e = 0; e < scores_.size(); ++e) {
      const bool kept = (in_map >> e & 1U) != 0;
      if (kept) scores_[e].static_kept += of_static;
      if (!kept) scores_[e].dynamic_removed += of_dynamic;
    }
  }
  for (PointScore& score : scores_) {
    score.static_total = totals_.static_total;
    score.dynamic_total = totals_.dynamic_total;
  }
}

PointScore PointProtocol::identity() const {
  return {totals_.static_total, totals_.static_total, totals_.dynamic_total, 0};
}

PointScore PointProtocol::oracle() const {
  return {totals_.static_total, totals_.static_total, totals_.dynamic_total, totals_.dynamic_total};
}

}  // namespace dynains::evaluation
