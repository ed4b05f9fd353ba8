#include "line_chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <utility>

#include "dynains/evaluation/text_table.hpp"

namespace dynains::program {
namespace {

using evaluation::format_number;

constexpr double kWidth = 640, kHeight = 400, kLeft = 60, kRight = 20, kTop = 40, kBottom = 50;
constexpr std::array<const char*, 4> kColours = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd"};

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '&') {
      result += "&amp;";
    } else {
      result += c;
    }
  }
  return result;
}

void write_text(std::ostream& svg, double x, double y, const char* anchor,
                const std::string& text) {
  svg << "<text x=\"" << format_number(x, 1) << "\" y=\"" << format_number(y, 1)
      << "\" text-anchor=\"" << anchor << "\">" << escaped(text) << "</text>\n";
}

}  // namespace

LineChart::LineChart(std::string x_title, std::vector<std::string> curves)
    : x_title_(std::move(x_title)), curves_(std::move(curves)) {}

void LineChart::add(const std::string& x_label, const std::vector<double>& values) {
  x_labels_.push_back(x_label);
  values_.push_back(values);
}

std::string LineChart::to_svg() const {
  double lowest = 100;
  for (const auto& values : values_) {
    for (const double value : values) {
      if (std::isfinite(value)) lowest = std::min(lowest, value);
    }
  }
  const double bottom = std::clamp(std::floor((lowest - 1) / 10) * 10, 0.0, 90.0);
  const double steps = values_.size() > 1 ? static_cast<double>(values_.size() - 1) : 1;
  const auto x_of = [&](std::size_t i) {
    return kLeft + (kWidth - kLeft - kRight) * static_cast<double>(i) / steps;
  };
  const auto y_of = [&](double value) {
    return kTop + (kHeight - kTop - kBottom) * (100 - value) / (100 - bottom);
  };

  std::ostringstream svg;
  svg << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << kWidth << "\" height=\"" << kHeight
      << "\" font-family=\"sans-serif\" font-size=\"12\">\n"
      << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  const double grid = (100 - bottom) / 5;
  for (int line = 0; line <= 5; ++line) {
    const double value = bottom + grid * line;
    const std::string y = format_number(y_of(value), 1);
    svg << "<line x1=\"" << kLeft << "\" x2=\"" << kWidth - kRight << "\" y1=\"" << y << "\" y2=\""
        << y << "\" stroke=\"#ddd\"/>\n";
    write_text(svg, kLeft - 8, y_of(value) + 4, "end", format_number(value, 0));
  }
  for (std::size_t i = 0; i < x_labels_.size(); ++i) {
    write_text(svg, x_of(i), kHeight - kBottom + 18, "middle", x_labels_[i]);
  }
  write_text(svg, (kLeft + kWidth - kRight) / 2, kHeight - 10, "middle", x_title_);
  for (std::size_t c = 0; c < curves_.size(); ++c) {
    const char* colour = kColours[c % kColours.size()];
    std::string path;
    bool drawing = false;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      const double value = values_[i][c];
      if (std::isfinite(value)) {
        path += (drawing ? " L" : " M") + format_number(x_of(i), 1) + ' ' +
                format_number(y_of(value), 1);
      }
      drawing = std::isfinite(value);
    }
    svg << "<path d=\"" << path << "\" fill=\"none\" stroke-width=\"2\" stroke=\"" << colour
        << "\"/>\n<g fill=\"" << colour << "\">\n";
    write_text(svg, kLeft + 20 + 100 * static_cast<double>(c), 22, "start", curves_[c]);
    svg << "</g>\n";
  }
  svg << "</svg>\n";
  return svg.str();
}

}  // namespace dynains::program
