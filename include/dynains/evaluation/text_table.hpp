// Text in aligned columns.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace dynains::evaluation {

/// The first column is left-aligned, the others right-aligned; widths follow the contents.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header);

  /// Throws std::invalid_argument for more cells than the header has.
  void add(std::vector<std::string> row);

  /// One line per row, each with a newline.
  std::string to_string() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// Fixed number of decimals; `missing` for a value that is not finite.
std::string format_number(double value, int decimals, const char* missing = "-");

}  // namespace dynains::evaluation
