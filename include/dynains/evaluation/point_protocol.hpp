// SA, DA, AA and HA of KTH's DynamicMap_Benchmark (Zhang et al., ITSC 2023), scan by scan.
#pragma once

#include <cstddef>
#include <vector>

#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"

namespace dynains::evaluation {

/// Counts the correctly classified points of each estimate (LabelledScan::in_map): static points in
/// its map and dynamic points not in its map.
class PointProtocol {
 public:
  struct Settings {
    double min_range = 2.7;  ///< m, planar
    double max_range = 50;   ///< m, planar; 0 = no limit
    TruthClasses truth;
  };

  /// `estimates`: number of estimates. Throws ConfigError for negative ranges, min_range above
  /// max_range, or more than kMaxEstimates estimates.
  PointProtocol(const Settings& settings, std::size_t estimates);

  void add(const LabelledScan& scan);

  const PointScore& score(std::size_t estimate) const { return scores_.at(estimate); }

  /// Scores of the references: no point removed, and exactly the dynamic points removed.
  PointScore identity() const;
  PointScore oracle() const;

 private:
  Settings settings_;
  PointScore totals_;
  std::vector<PointScore> scores_;
};

}  // namespace dynains::evaluation
