// Settings of an evaluation.
#pragma once

#include <string>

#include "dynains/errors.hpp"
#include "dynains/evaluation/truth.hpp"
#include "dynains/parameters.hpp"

namespace dynains::evaluation {

/// Settings of an evaluation. visit() gives their meaning. The defaults follow the published
/// protocols, except that unlabeled points are ignored; the published tables count them as static.
struct EvaluationConfig {
  double voxel = 0.2;
  double min_range = 2.7;
  double max_range = 0.0;
  double point_max_range = 50.0;
  double point_radius = 0.05;
  TruthClasses truth;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"voxel", self.voxel, closed(0.001, 100.0), "m",
                      "edge of the voxels of PR, RR and F1 (ERASOR)"});
    visitor(Parameter{"min_range", self.min_range, closed(0.0, 1000.0), "m",
                      "points at a smaller planar range are not judged (ERASOR)"});
    visitor(Parameter{"max_range", self.max_range, closed(0.0, 10000.0), "m",
                      "points at a larger planar range are not judged by PR and RR; 0 = no limit"});
    visitor(Parameter{"point_max_range", self.point_max_range, closed(0.0, 10000.0), "m",
                      "points at a larger planar range are not judged by SA and DA (KTH) and by "
                      "the error analysis; 0 = no limit"});
    visitor(Parameter{"point_radius", self.point_radius, closed(0.0001, 10.0), "m",
                      "largest distance to a map point for a point to be in a map file (KTH)"});
  }
  /// Throws ConfigError for a field out of bounds or ranges that are crossed.
  void validate() const {
    validate_parameters("EvaluationConfig", *this);
    for (const double most : {max_range, point_max_range}) {
      if (most == 0.0 || most >= min_range) continue;
      throw ConfigError("evaluation ranges [min_range, max_range] = [" + std::to_string(min_range) +
                        ", " + std::to_string(most) + "] are crossed (0 = no limit)");
    }
  }
};

}  // namespace dynains::evaluation
