#include "chart.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include "dynains/evaluation/text_table.hpp"
#include "gnuplot.hpp"

namespace dynains::program {
namespace {

bool is_number(const std::string& text) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc{} && stop == end;
}

}  // namespace

Chart::Chart(std::string x_title, std::vector<std::string> curves)
    : x_title_(std::move(x_title)), curves_(std::move(curves)) {}

void Chart::add(const std::string& x, const std::vector<double>& values) {
  x_.push_back(x);
  values_.push_back(values);
}

std::string Chart::script() const {
  std::string text =
      "set terminal svg size 640,400 noenhanced font \"sans,12\" background \"white\"\n"
      "set datafile missing \"-\"\n"
      "set key outside top center horizontal\n"
      "set grid lt 1 lc rgb \"#dddddd\"\nset border 3\nset tics nomirror\nset yrange [:100]\n";
  text += "set xlabel " + gnuplot_text(x_title_) + "\nset ylabel \"%\"\n$data << END\n";
  const bool has_numbers = std::all_of(x_.begin(), x_.end(), is_number);
  for (std::size_t i = 0; i < x_.size(); ++i) {
    text += has_numbers ? x_[i] : gnuplot_text(x_[i]);
    for (const double value : values_[i]) {
      text += ' ' + evaluation::format_number(value, 6, "-");
    }
    text += '\n';
  }
  text += "END\n";
  for (std::size_t c = 0; c < curves_.size(); ++c) {
    const std::string column = std::to_string(c + 2);
    text += (c == 0 ? "plot $data" : ", \\\n  $data");
    text += " using " + (has_numbers ? "1:" + column : "0:" + column + ":xtic(1)") +
            " with linespoints lw 2 pt 7 ps 0.5 title " + gnuplot_text(curves_[c]);
  }
  return text + '\n';
}

}  // namespace dynains::program
