// Output of an evaluation as table, JSON and CSV.
#pragma once

#include <string>

#include "dynains/evaluation/evaluate.hpp"

namespace dynains::evaluation {

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
