// SA, DA, AA and HA after KTH's DynamicMap_Benchmark (Zhang et al., ITSC 2023), streaming.
#pragma once

#include <cstddef>
#include <vector>

#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"

namespace dynains::evaluation {

/// Counts correct points of each estimate (LabelledScan::in_map): static points in its map, dynamic
/// points not in its map.
class PointProtocol {
 public:
  struct Settings {
    double min_range = 2.7;  ///< m, planar
    double max_range = 50;   ///< m, planar; 0 = no limit
    TruthClasses truth;
  };

  /// Throws ConfigError for ranges that are negative or crossed, or more than kMaxEstimates.
  PointProtocol(const Settings& settings, std::size_t estimates);

  void add(const LabelledScan& scan);

  const PointScore& score(std::size_t estimate) const { return scores_.at(estimate); }

  /// Reference rows: nothing removed, and exactly the dynamic points removed.
  PointScore identity() const;
  PointScore oracle() const;

 private:
  Settings settings_;
  PointScore totals_;
  std::vector<PointScore> scores_;
};

}  // namespace dynains::evaluation
