// Both protocols and the error analysis in one call.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "dynains/evaluation/error_analysis.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"
#include "dynains/parameters.hpp"

namespace dynains::evaluation {

/// Settings of an evaluation. Defaults are those of the published protocols, with one exception:
/// the published tables count unlabeled points as static.
struct EvaluationConfig {
  double voxel = 0.2;
  double min_range = 2.7;
  double max_range = 0.0;
  double point_max_range = 50.0;
  double point_radius = 0.05;
  double ring_width = 10.0;
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
                      "the same for SA and DA (KTH) and for the error analysis; 0 = no limit"});
    visitor(Parameter{"point_radius", self.point_radius, closed(0.0001, 10.0), "m",
                      "a point is in a map file if a map point is that near (KTH)"});
    visitor(Parameter{"ring_width", self.ring_width, closed(0.1, 10000.0), "m",
                      "width of the range rings of the error analysis"});
  }
  void validate() const { validate_parameters("EvaluationConfig", *this); }
};

/// A finished map, evaluated as one more row.
struct MapEstimate {
  std::string name;
  Span<const Eigen::Vector3d> points_world;  ///< m, in the world frame of the poses
};

/// One line of the table.
struct EvaluationRow {
  std::string name;
  VoxelScore voxels;
  PointScore points;
  /// Map files only: points without a measured point nearby, and all points.
  std::optional<std::uint64_t> foreign_points;
  std::optional<std::uint64_t> map_points;
};

struct Evaluation {
  EvaluationConfig config;
  std::size_t scans = 0;
  std::uint64_t points = 0;
  /// "identity" (nothing removed), "oracle" (exactly the dynamic points removed), the estimates,
  /// the maps.
  std::vector<EvaluationRow> rows;
  /// Errors of estimate 0; empty without estimates.
  std::optional<ErrorAnalysis> errors;
};

/// Reads `source` twice. `estimates`: names of the bits of LabelledScan::in_map.
/// Throws ConfigError for settings out of bounds, std::invalid_argument for a scan with spans of
/// different lengths or a stride below 3, and exceptions of `source`.
Evaluation evaluate(const ScanSource& source, const std::vector<std::string>& estimates,
                    const std::vector<MapEstimate>& maps, const EvaluationConfig& config = {});

}  // namespace dynains::evaluation
