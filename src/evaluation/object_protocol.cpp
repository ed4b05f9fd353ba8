#include "dynains/evaluation/object_protocol.hpp"

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "detail/range_gate.hpp"
#include "dynains/errors.hpp"

namespace dynains::evaluation {
namespace {

/// People, walking or riding: they may stand for a while, and count as neither.
bool is_person(std::uint16_t id) { return id >= 30 && id <= 32; }

}  // namespace

ObjectProtocol::ObjectProtocol(const Settings& settings, std::size_t estimates)
    : settings_(settings), estimates_(estimates) {
  detail::RangeGate(settings.min_range, settings.max_range);
  if (estimates > kMaxEstimates) {
    throw ConfigError("ObjectProtocol evaluates at most " + std::to_string(kMaxEstimates) +
                      " estimates at once");
  }
}

void ObjectProtocol::add(const LabelledScan& scan) {
  const detail::RangeGate gate(settings_.min_range, settings_.max_range);
  // Consecutive points mostly have one label.
  std::optional<std::uint32_t> last_label;
  Counts* counts = nullptr;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const std::uint32_t label = scan.truth[i];
    if (last_label != label) {
      last_label = label;
      const bool judged =
          settings_.truth(label) != Truth::kIgnored && !is_ground_class(semantic_class(label));
      counts = judged ? &by_label_[label] : nullptr;
    }
    if (counts == nullptr || !gate.passes(scan.xyz + i * scan.stride)) continue;
    ++counts->points;
    const unsigned in_map = scan.in_map.empty() ? 0U : scan.in_map[i];
    for (std::size_t e = 0; e < estimates_; ++e) counts->kept[e] += in_map >> e & 1U;
  }
}

bool ObjectProtocol::is_right(Truth truth, const Counts& counts, std::size_t estimate) const {
  const auto points = static_cast<double>(counts.points);
  const auto kept = static_cast<double>(counts.kept.at(estimate));
  return truth == Truth::kStatic ? kept >= kKept * points : points - kept >= kRemoved * points;
}

std::vector<ClassScore> ObjectProtocol::by_class(std::size_t estimate) const {
  std::map<std::pair<Truth, std::uint16_t>, ClassScore> classes;
  for (const auto& [label, counts] : by_label_) {
    if (counts.points == 0) continue;
    const Truth truth = settings_.truth(label);
    ClassScore& of_class = classes[{truth, semantic_class(label)}];
    of_class.id = semantic_class(label);
    of_class.truth = truth;
    of_class.points += counts.points;
    of_class.points_kept += counts.kept.at(estimate);
    if (semantic_instance(label) == 0 || counts.points < kMinPoints) continue;
    ++of_class.objects;
    of_class.right += is_right(truth, counts, estimate);
  }
  std::vector<ClassScore> result;
  result.reserve(classes.size());
  for (const auto& one : classes) result.push_back(one.second);
  return result;
}

ObjectScore ObjectProtocol::score(std::size_t estimate) const {
  ObjectScore score;
  for (const ClassScore& one : by_class(estimate)) {
    if (one.truth == Truth::kDynamic) {
      score.dynamic_total += one.objects;
      score.dynamic_removed += one.right;
    } else if (!is_person(one.id)) {
      score.static_total += one.objects;
      score.static_kept += one.right;
    }
  }
  return score;
}

ObjectScore ObjectProtocol::identity() const {
  ObjectScore result = oracle();
  result.dynamic_removed = 0;
  return result;
}

ObjectScore ObjectProtocol::oracle() const {
  const ObjectScore any = score(0);
  return {any.static_total, any.static_total, any.dynamic_total, any.dynamic_total};
}

}  // namespace dynains::evaluation
