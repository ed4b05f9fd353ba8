// Curves over a common axis, as a script for gnuplot.
#pragma once

#include <string>
#include <vector>

namespace dynains::program {

/// Curves in percent. If all values of the axis are numbers, they have their places; otherwise they
/// are texts at equal distances.
class Chart {
 public:
  Chart(std::string x_title, std::vector<std::string> curves);

  /// One value per curve, %; a value that is not finite leaves a gap.
  void add(const std::string& x, const std::vector<double>& values);

  /// With the data; writes an SVG picture to its standard output.
  std::string script() const;

 private:
  std::string x_title_;
  std::vector<std::string> curves_;
  std::vector<std::string> x_;
  std::vector<std::vector<double>> values_;  // per x, per curve
};

}  // namespace dynains::program
