// Point-wise errors of an estimate, by class and cause.
#pragma once

#include <array>
#include <cstdint>
#include <map>

#include "dynains/evaluation/causes.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"

namespace dynains::evaluation {

/// Counts the errors of estimate 0.
class ErrorAnalysis {
 public:
  struct Settings {
    double min_range = 2.7;  ///< m, planar
    double max_range = 50;   ///< m, planar; 0 = no limit
    TruthClasses truth;
  };

  struct ClassErrors {
    std::uint64_t points = 0;
    std::uint64_t removed = 0;
    double removed_percent() const { return percent(removed, points); }
  };

  /// Numbers of wrong and right verdicts with one cause.
  struct CauseErrors {
    std::uint64_t missed_dynamic = 0;
    std::uint64_t lost_static = 0;
    std::uint64_t right = 0;
  };

  /// Throws ConfigError for settings out of bounds.
  explicit ErrorAnalysis(const Settings& settings);

  /// Counts the errors of one scan.
  void add(const LabelledScan& scan);

  /// By class of SemanticKITTI.
  const std::map<std::uint16_t, ClassErrors>& by_class() const { return classes_; }
  const std::array<CauseErrors, kCauseCount>& by_cause() const { return causes_; }
  bool has_causes() const { return has_causes_; }

 private:
  Settings settings_;
  std::map<std::uint16_t, ClassErrors> classes_;
  std::array<CauseErrors, kCauseCount> causes_{};
  bool has_causes_ = false;
};

}  // namespace dynains::evaluation
