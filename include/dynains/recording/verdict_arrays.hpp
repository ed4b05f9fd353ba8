// A copy of the verdict on one scan.
#pragma once

#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

struct VerdictArrays {
  std::vector<PointLabel> labels;
  std::vector<Cause> causes;
  std::vector<std::uint32_t> instances;
  std::vector<float> beliefs;  ///< may be empty

  /// Copies the arrays of a verdict.
  void take(const ScanVerdict& verdict, bool with_beliefs) {
    labels.assign(verdict.labels.begin(), verdict.labels.end());
    causes.assign(verdict.causes.begin(), verdict.causes.end());
    instances.assign(verdict.instances.begin(), verdict.instances.end());
    beliefs.clear();
    if (with_beliefs) beliefs.assign(verdict.beliefs.begin(), verdict.beliefs.end());
  }

  /// The verdict on a scan whose spans refer to these arrays; valid as long as they are unchanged.
  ScanVerdict verdict(ScanVerdict scan) const {
    scan.labels = labels;
    scan.instances = instances;
    scan.beliefs = beliefs;
    scan.causes = causes;
    return scan;
  }
};

}  // namespace dynains
