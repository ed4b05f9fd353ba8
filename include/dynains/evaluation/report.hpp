// An evaluation as text for people (table), programs (JSON) and spreadsheets (CSV).
#pragma once

#include <string>

#include "dynains/evaluation/evaluate.hpp"

namespace dynains::evaluation {

/// Settings and one line per row, aligned; ends with a newline. "-" stands for a share of nothing.
std::string to_table(const Evaluation& evaluation);

/// The error analysis as tables: classes, instances (the worst `max_instances` of either truth),
/// range rings and, as far as known, causes. Empty without an analysis.
std::string errors_to_table(const Evaluation& evaluation, std::size_t max_instances = 20);

/// Everything: settings, rows with counts, error analysis. A share of nothing is null.
std::string to_json(const Evaluation& evaluation);

/// A header and a line per row; a share of nothing is an empty field.
std::string to_csv(const Evaluation& evaluation);

}  // namespace dynains::evaluation
