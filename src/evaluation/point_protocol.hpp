// Scores by points and objects, and errors by class and cause, scan by scan.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "dynains/evaluation/config.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"

namespace dynains::evaluation {

/// Counts the points with each label that each estimate keeps (LabelledScan::in_map), as KTH's
/// DynamicMap_Benchmark (Zhang et al., ITSC 2023) does by class.
class PointProtocol {
 public:
  PointProtocol(const EvaluationConfig& config, std::size_t estimates)
      : config_(config), estimates_(estimates) {}

  void add(const LabelledScan& scan);

  /// Scores of a Row.
  Score points(std::size_t row) const;
  Score objects(std::size_t row) const;
  /// Static classes first, each ordered by id.
  std::vector<ClassScore> by_class(std::size_t row) const;

  /// Verdicts of estimate 0 by cause; empty if no scan has causes.
  const std::vector<CauseErrors>& by_cause() const { return causes_; }

 private:
  struct Counts {
    std::uint64_t points = 0;
    std::array<std::uint64_t, kMaxEstimates> kept{};
  };
  std::uint64_t kept(const Counts& counts, Truth truth, std::size_t row) const;

  EvaluationConfig config_;
  std::size_t estimates_;
  std::unordered_map<std::uint32_t, Counts> by_label_;
  std::vector<CauseErrors> causes_;
};

}  // namespace dynains::evaluation
