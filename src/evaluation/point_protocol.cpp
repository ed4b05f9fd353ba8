#include "dynains/evaluation/point_protocol.hpp"

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
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Truth truth = settings_.truth(scan.truth[i]);
    if (truth == Truth::kIgnored || !gate.passes(scan.xyz + i * scan.stride)) continue;
    const unsigned in_map = scan.in_map.empty() ? 0U : scan.in_map[i];
    (truth == Truth::kStatic ? totals_.static_total : totals_.dynamic_total) += 1;
    for (std::size_t e = 0; e < scores_.size(); ++e) {
      const bool kept = (in_map >> e & 1U) != 0;
      if (truth == Truth::kStatic) {
        scores_[e].static_kept += kept;
      } else {
        scores_[e].dynamic_removed += !kept;
      }
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
