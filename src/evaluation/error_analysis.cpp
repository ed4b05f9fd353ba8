#include "dynains/evaluation/error_analysis.hpp"

#include "detail/range_gate.hpp"

namespace dynains::evaluation {

ErrorAnalysis::ErrorAnalysis(const Settings& settings) : settings_(settings) {
  detail::RangeGate(settings.min_range, settings.max_range);
}

void ErrorAnalysis::add(const LabelledScan& scan) {
  const detail::RangeGate gate(settings_.min_range, settings_.max_range);
  has_causes_ = has_causes_ || !scan.causes.empty();
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Truth truth = settings_.truth(scan.truth[i]);
    if (truth == Truth::kIgnored || !gate.passes(scan.xyz + i * scan.stride)) continue;
    const bool is_kept = !scan.in_map.empty() && (scan.in_map[i] & 1U) != 0;
    ClassErrors& of_class = classes_[semantic_class(scan.truth[i])];
    ++of_class.points;
    of_class.removed += !is_kept;

    if (scan.causes.empty()) continue;
    CauseErrors& cause = causes_[scan.causes[i] < kCauseCount ? scan.causes[i] : 0];
    if (is_kept == (truth == Truth::kStatic)) {
      ++cause.right;
    } else {
      ++(is_kept ? cause.missed_dynamic : cause.lost_static);
    }
  }
}

}  // namespace dynains::evaluation
