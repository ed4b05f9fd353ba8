// Evaluation by both protocols and the error analysis; its output as table, JSON and CSV.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "dynains/evaluation/config.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"

namespace dynains::evaluation {

/// A map of unlabelled points, evaluated as an additional row.
struct MapEstimate {
  std::string name;
  Span<const Eigen::Vector3d> points_world;  ///< m, in the world frame of the poses
};

/// Scores of one estimate, map or reference.
struct EvaluationRow {
  std::string name;
  Score voxels;                     ///< ERASOR (Lim et al., RA-L 2021): voxels of the raw map
  Score points;                     ///< KTH (Zhang et al., ITSC 2023): measured points
  std::optional<Score> objects;     ///< static objects without people; empty for maps
  std::vector<ClassScore> classes;  ///< of estimates only; static classes first, by id
  /// Maps only: number of points without a measured point nearby,
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
    return rows.size() > kFirstEstimate && rows[kFirstEstimate].objects ? &rows[kFirstEstimate]
                                                                        : nullptr;
  }
};

/// Evaluates estimates and maps, in several threads. Reads `source` twice, in the caller's thread.
/// `estimates`: name of the estimate of each bit of LabelledScan::in_map. Throws ConfigError for
/// settings out of bounds or more than kMaxEstimates estimates, std::invalid_argument for a scan
/// with spans of different lengths or a stride below 3, and the exceptions of `source`.
Evaluation evaluate(const ScanSource& source, const std::vector<std::string>& estimates,
                    const std::vector<MapEstimate>& maps, const EvaluationConfig& config = {});

/// Field of a CSV file (RFC 4180), quoted if it contains a comma, a quote or a line break.
std::string csv_field(const std::string& text);

/// Settings, and one aligned line per row. Ends with a newline. A percentage of zero points is "-".
std::string to_table(const Evaluation& evaluation);

/// Tables of the error analysis: classes and, if available, causes. Empty without an analysis.
std::string errors_to_table(const Evaluation& evaluation);

/// Settings, rows with counts, and error analysis. A percentage of zero points is null.
std::string to_json(const Evaluation& evaluation);

/// A header and a line per row. A percentage of zero points is an empty field.
std::string to_csv(const Evaluation& evaluation);

}  // namespace dynains::evaluation
