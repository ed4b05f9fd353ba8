// Scores by points and objects, and errors by class and cause, scan by scan.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dynains/evaluation/config.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"
#include "evaluation/voxels.hpp"

namespace dynains::evaluation {

/// Counts the points with each label that each estimate keeps (LabelledScan::in_map), as KTH's
/// DynamicMap_Benchmark (Zhang et al., ITSC 2023) does by class.
class PointProtocol {
 public:
  PointProtocol(const EvaluationConfig& config, std::size_t estimates)
      : config_(config), estimates_(estimates) {}

  void add(const LabelledScan& scan) {
    const detail::RangeGate gate(config_.min_range, config_.point_max_range);
    if (!scan.causes.empty()) causes_.resize(kCauseCount);
    // Consecutive points mostly have one label.
    std::optional<std::uint32_t> last_label;
    Truth truth = Truth::kIgnored;
    Counts* counts = nullptr;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const std::uint32_t label = scan.truth[i];
      if (last_label != label) {
        last_label = label;
        truth = config_.truth(label);
        counts = truth == Truth::kIgnored ? nullptr : &by_label_[label];
      }
      if (counts == nullptr || !gate.passes(scan, i)) continue;
      ++counts->points;
      const unsigned in_map = scan.in_map.empty() ? 0U : scan.in_map[i];
      for (std::size_t e = 0; e < estimates_; ++e) counts->kept[e] += in_map >> e & 1U;
      if (scan.causes.empty()) continue;
      CauseErrors& cause = causes_[scan.causes[i] < kCauseCount ? scan.causes[i] : 0];
      const bool is_kept = (in_map & 1U) != 0;
      const bool is_missed = is_kept && truth == Truth::kDynamic;
      const bool is_lost = !is_kept && truth == Truth::kStatic;
      ++(is_missed ? cause.missed_dynamic : is_lost ? cause.lost_static : cause.right);
    }
  }

  /// Scores of a Row.
  Score points(std::size_t row) const {
    Score score;
    for (const ClassScore& one : by_class(row)) score.add(one.truth, one.points, one.points_kept);
    return score;
  }
  Score objects(std::size_t row) const {
    Score score;
    for (const ClassScore& one : by_class(row)) {
      const bool is_static = one.truth == Truth::kStatic;
      if (is_ground_class(one.id) || (is_static && is_person(one.id))) continue;
      score.add(one.truth, one.objects, is_static ? one.right : one.objects - one.right);
    }
    return score;
  }
  /// Static classes first, each ordered by id.
  std::vector<ClassScore> by_class(std::size_t row) const {
    std::map<std::pair<Truth, std::uint16_t>, ClassScore> classes;
    for (const auto& [label, counts] : by_label_) {
      if (counts.points == 0) continue;
      const Truth truth = config_.truth(label);
      const std::uint64_t points_kept = kept(counts, truth, row);
      ClassScore& of_class = classes[{truth, semantic_class(label)}];
      of_class.id = semantic_class(label);
      of_class.truth = truth;
      of_class.points += counts.points;
      of_class.points_kept += points_kept;
      if (semantic_instance(label) == 0 || counts.points < ObjectLimits::kMinPoints) continue;
      ++of_class.objects;
      of_class.right += is_right(truth, counts.points, points_kept);
    }
    std::vector<ClassScore> result;
    result.reserve(classes.size());
    for (const auto& one : classes) result.push_back(one.second);
    return result;
  }

  /// Verdicts of estimate 0 by cause; empty if no scan has causes.
  const std::vector<CauseErrors>& by_cause() const { return causes_; }

 private:
  /// People, walking or riding: they may stand for a while, and count as neither.
  static bool is_person(std::uint16_t id) { return id >= 30 && id <= 32; }

  static bool is_right(Truth truth, std::uint64_t points, std::uint64_t kept) {
    const auto all = static_cast<double>(points);
    return truth == Truth::kStatic
               ? static_cast<double>(kept) >= ObjectLimits::kKept * all
               : static_cast<double>(points - kept) >= ObjectLimits::kRemoved * all;
  }

  struct Counts {
    std::uint64_t points = 0;
    std::array<std::uint64_t, kMaxEstimates> kept{};
  };
  std::uint64_t kept(const Counts& counts, Truth truth, std::size_t row) const {
    if (row == kIdentity) return counts.points;
    if (row == kOracle) return truth == Truth::kStatic ? counts.points : 0;
    return counts.kept.at(row - kFirstEstimate);
  }

  EvaluationConfig config_;
  std::size_t estimates_;
  std::unordered_map<std::uint32_t, Counts> by_label_;
  std::vector<CauseErrors> causes_;
};

}  // namespace dynains::evaluation
