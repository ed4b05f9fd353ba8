// Output of an evaluation as table, JSON and CSV.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "dynains/evaluation/evaluate.hpp"

namespace dynains::evaluation {

/// Table with aligned columns: the first is left-aligned, the others right-aligned.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : rows_{std::move(header)} {}

  /// Adds a row. Throws std::invalid_argument if it has more cells than the header.
  void add(std::vector<std::string> row);

  /// One line per row, each with a newline.
  std::string to_string() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// Field of a CSV file (RFC 4180), quoted if it contains a comma, a quote or a line break.
std::string csv_field(const std::string& text);

/// `value` with a fixed number of decimals; `missing` if it is not finite.
std::string format_number(double value, int decimals, const char* missing = "-");

/// Settings, and one aligned line per row. Ends with a newline. A percentage of zero points is "-".
std::string to_table(const Evaluation& evaluation);

/// Tables of the error analysis: classes and, if available, causes. Empty without an analysis.
std::string errors_to_table(const Evaluation& evaluation);

/// Settings, rows with counts, and error analysis. A percentage of zero points is null.
std::string to_json(const Evaluation& evaluation);

/// A header and a line per row. A percentage of zero points is an empty field.
std::string to_csv(const Evaluation& evaluation);

}  // namespace dynains::evaluation
