// Curves over a common axis as an SVG picture.
#pragma once

#include <string>
#include <vector>

namespace dynains::program {

/// Curves in percent over labelled, equally spaced abscissas.
class LineChart {
 public:
  LineChart(std::string x_title, std::vector<std::string> curves);

  /// One value per curve, %; a value that is not finite leaves a gap.
  void add(const std::string& x_label, const std::vector<double>& values);

  std::string to_svg() const;

 private:
  std::string x_title_;
  std::vector<std::string> curves_;
  std::vector<std::string> x_labels_;
  std::vector<std::vector<double>> values_;  // per abscissa, per curve
};

}  // namespace dynains::program
