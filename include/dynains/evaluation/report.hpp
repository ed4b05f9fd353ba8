// An evaluation as table, JSON and CSV.
#pragma once

#include <string>

#include "dynains/evaluation/evaluate.hpp"

namespace dynains::evaluation {

/// Settings and one aligned line per row; ends with a newline. "-": a percentage of zero points.
std::string to_table(const Evaluation& evaluation);

/// The error analysis as tables: classes, instances (the worst `max_instances` static and dynamic
/// ones), range rings and, if given, causes. Empty without an analysis.
std::string errors_to_table(const Evaluation& evaluation, std::size_t max_instances = 20);

/// Settings, rows with counts, and error analysis. A percentage of zero points is null.
std::string to_json(const Evaluation& evaluation);

/// A header and a line per row. A percentage of zero points is an empty field.
std::string to_csv(const Evaluation& evaluation);

}  // namespace dynains::evaluation
