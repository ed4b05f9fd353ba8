// Text in aligned columns.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace dynains::evaluation {

/// Table with aligned columns: the first `left_columns` are left-aligned, the others right-aligned.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header, std::size_t left_columns = 1);

  /// Adds a row. Throws std::invalid_argument if it has more cells than the header.
  void add(std::vector<std::string> row);

  /// One line per row, each with a newline.
  std::string to_string() const;

 private:
  std::size_t left_columns_;
  std::vector<std::vector<std::string>> rows_;
};

/// Field of a CSV file (RFC 4180), quoted if it contains a comma, a quote or a line break.
std::string csv_field(const std::string& text);

/// `value` with a fixed number of decimals; `missing` if it is not finite.
std::string format_number(double value, int decimals, const char* missing = "-");

}  // namespace dynains::evaluation
