// Evaluation by both protocols and the error analysis.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"
#include "dynains/evaluation/voxel_protocol.hpp"
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
  /// Throws ConfigError for a field out of bounds.
  void validate() const { validate_parameters("EvaluationConfig", *this); }
};

/// A map of unlabelled points, evaluated as an additional row.
struct MapEstimate {
  std::string name;
  Span<const Eigen::Vector3d> points_world;  ///< m, in the world frame of the poses
};

/// Scores of one estimate, map or reference.
struct EvaluationRow {
  std::string name;
  VoxelScore voxels;
  PointScore points;
  std::optional<ObjectScore> objects;  ///< not of maps
  std::vector<ClassScore> classes;     ///< of estimates only; static ones first, by id
  /// Maps only: number of points without a measured point nearby (MapProtocol::foreign_points()),
  /// and number of all points.
  std::optional<std::uint64_t> foreign_points;
  std::optional<std::uint64_t> map_points;
};

struct Evaluation {
  EvaluationConfig config;
  std::size_t scans = 0;
  std::uint64_t points = 0;
  /// "identity" (no point removed), "oracle" (exactly the dynamic points removed), the estimates
  /// and the maps, in this order.
  std::vector<EvaluationRow> rows;
  /// Verdicts of estimate 0 by cause; empty if no scan has causes.
  std::vector<CauseErrors> causes;

  /// Row of estimate 0; null without estimates.
  const EvaluationRow* first_estimate() const {
    constexpr std::size_t first = VoxelProtocol::kFirstEstimate;
    return rows.size() > first && rows[first].objects ? &rows[first] : nullptr;
  }
};

/// Evaluates estimates and maps, in several threads. Reads `source` twice, in the caller's thread.
/// `estimates`: name of the estimate of each bit of LabelledScan::in_map. Throws ConfigError for
/// settings out of bounds, std::invalid_argument for a scan with spans of different lengths or a
/// stride below 3, and the exceptions of `source`.
Evaluation evaluate(const ScanSource& source, const std::vector<std::string>& estimates,
                    const std::vector<MapEstimate>& maps, const EvaluationConfig& config = {});

}  // namespace dynains::evaluation
