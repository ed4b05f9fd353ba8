#include "figure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iomanip>
#include <sstream>
#include <utility>

#include "dynains/io/atomic_file.hpp"
#include "gnuplot.hpp"

namespace dynains::program {
namespace {

std::uint32_t code_of(Colour colour) {
  return static_cast<std::uint32_t>(colour.r) << 16U | static_cast<std::uint32_t>(colour.g) << 8U |
         colour.b;
}

std::string text_of(Colour colour) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "#%06x", static_cast<unsigned>(code_of(colour)));
  return text.data();
}

/// The largest of 1, 2, 5, 10, 20, ... that is at most a quarter of `width`.
double bar_length(double width) {
  const double power = std::pow(10.0, std::floor(std::log10(0.25 * width)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= 0.25 * width) return factor * power;
  }
  return power;
}

std::string axis_title(char axis, double origin) {
  std::ostringstream text;
  text << axis;
  if (origin != 0.0)
    text << std::fixed << std::setprecision(0) << (origin < 0.0 ? " + " : " - ")
         << std::abs(origin);
  text << " (m)";
  return text.str();
}

/// Axes and a scale bar below the picture.
std::string axes_of(const Figure& figure) {
  if (!figure.is_from_above) return "unset border\nunset tics\n";
  const double bar = bar_length(figure.high_x - figure.low_x);
  std::ostringstream text;
  text << "set xlabel \"" << axis_title('x', figure.origin_x) << "\"\nset ylabel \""
       << axis_title('y', figure.origin_y) << "\"\nset tics out nomirror\n"
       << "set arrow from first " << figure.high_x - bar << ", screen 0.02 to first "
       << figure.high_x << ", screen 0.02 nohead lw 4 lc rgb \"black\"\n"
       << "set label \"" << bar << " m\" at first " << figure.high_x - 0.5 * bar
       << ", screen 0.02 center offset 0, 0.8\n";
  return text.str();
}

std::string script_of(const Figure& figure, const std::string& name) {
  constexpr int kLeft = 80, kRight = 20, kBelow = 70, kAbove = 40;  // pixels
  constexpr int kLeastWidth = 640;                                  // pixels, for the legend
  const int width = std::max(figure.width + kLeft + kRight, kLeastWidth);
  const int height = figure.height + kBelow + kAbove;
  const auto share = [](int part, int whole) { return static_cast<double>(part) / whole; };
  std::ostringstream text;
  text << "set terminal pngcairo size " << width << ',' << height
       << " noenhanced font \"sans,11\" background \"white\"\n"
       << "set lmargin at screen " << share(kLeft, width) << "\nset rmargin at screen "
       << share(kLeft + figure.width, width) << "\nset bmargin at screen " << share(kBelow, height)
       << "\nset tmargin at screen " << share(kBelow + figure.height, height) << "\nset xrange ["
       << figure.low_x << ':' << figure.high_x << "]\nset yrange [" << figure.low_y << ':'
       << figure.high_y << "]\nset key at screen 0.5, screen " << 1.0 - 0.5 * share(kAbove, height)
       << " center center horizontal samplen 1\n"
       << axes_of(figure) << "plot ";
  // Sizes of dots in the unit of the terminal: plain dots fill a cell, others are larger.
  constexpr double kPlain = 0.25, kLarge = 0.5;
  std::size_t skipped = 0;
  for (std::size_t layer = 0; layer < figure.layers.size(); ++layer) {
    const std::size_t count = figure.layers[layer].size();
    if (count == 0) continue;
    text << '"' << name << ".dat\" binary record=" << count << " skip=" << skipped
         << " format=\"%float%float%uint32\" using 1:2:3 with points pt 5 ps "
         << (layer == 0 ? kPlain : kLarge) << " lc rgb variable notitle, \\\n  ";
    skipped += 12 * count;
  }
  const std::vector<Figure::LegendEntry>& legend = figure.legend;
  for (std::size_t i = 0; i < legend.size(); ++i) {
    text << "keyentry with points pt 5 ps 1 lc rgb \"" << text_of(legend[i].colour) << "\" title "
         << gnuplot_text(legend[i].name) << (i + 1 < legend.size() ? ", \\\n  " : "\n");
  }
  return text.str();
}

void write_file(const std::filesystem::path& path, const std::string& bytes) {
  AtomicFile file(path);
  file.stream() << bytes;
  file.commit();
}

}  // namespace

DotGrid::DotGrid(Figure figure)
    : figure_(std::move(figure)),
      columns_((figure_.width + Figure::kCell - 1) / Figure::kCell),
      cells_(static_cast<std::size_t>(columns_) *
             static_cast<std::size_t>((figure_.height + Figure::kCell - 1) / Figure::kCell)) {}

void DotGrid::add(double x, double y, double depth, std::size_t layer, Colour colour) {
  if (!(x >= 0.0 && x < figure_.width && y >= 0.0 && y < figure_.height)) return;
  const auto column = static_cast<std::size_t>(x / Figure::kCell);
  const auto row = static_cast<std::size_t>(y / Figure::kCell);
  Cell& cell = cells_[row * static_cast<std::size_t>(columns_) + column];
  const auto order = static_cast<int>(layer);
  if (order < cell.layer || (order == cell.layer && depth >= cell.depth)) return;
  cell = {order, depth, colour};
}

Figure DotGrid::figure() const {
  Figure figure = figure_;
  const double step_x = (figure.high_x - figure.low_x) / figure.width * Figure::kCell;
  const double step_y = (figure.high_y - figure.low_y) / figure.height * Figure::kCell;
  const auto columns = static_cast<std::size_t>(columns_);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const Cell& cell = cells_[i];
    if (cell.layer < 0) continue;
    const std::size_t row = i / columns;
    const std::size_t column = i % columns;
    figure.layers[static_cast<std::size_t>(cell.layer)].push_back(
        {static_cast<float>(figure.low_x + (static_cast<double>(column) + 0.5) * step_x),
         static_cast<float>(figure.low_y + (static_cast<double>(row) + 0.5) * step_y),
         cell.colour});
  }
  return figure;
}

namespace {

double scale_of(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int pixels) {
  return (pixels - 1) / std::max((high - low).maxCoeff(), 1.0);
}

/// Without dots.
Figure view_of(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double scale,
               std::size_t layers, std::vector<Figure::LegendEntry> legend) {
  const Eigen::Array2d size = (high - low).array().max(1.0);
  const auto side = [&](double metres) { return static_cast<int>(metres * scale) + 1; };
  Figure figure;
  figure.legend = std::move(legend);
  figure.is_from_above = true;
  figure.width = side(size.x());
  figure.height = side(size.y());
  figure.low_x = low.x();
  figure.low_y = low.y();
  figure.high_x = low.x() + figure.width / scale;
  figure.high_y = low.y() + figure.height / scale;
  figure.layers.resize(layers);
  return figure;
}

}  // namespace

ViewFromAbove::ViewFromAbove(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int pixels,
                             std::size_t layers, std::vector<Figure::LegendEntry> legend)
    : low_(low),
      scale_(scale_of(low, high, pixels)),
      grid_(view_of(low, high, scale_, layers, std::move(legend))) {}

Figure ViewFromAbove::figure(const Eigen::Vector2d& origin) const {
  Figure figure = grid_.figure();
  figure.origin_x = origin.x();
  figure.origin_y = origin.y();
  return figure;
}

void write_figure(const Figure& figure, const std::filesystem::path& folder,
                  const std::string& name) {
  std::string data;
  for (const std::vector<Figure::Dot>& layer : figure.layers) {
    for (const Figure::Dot& dot : layer) {
      const std::uint32_t colour = code_of(dot.colour);
      data.append(reinterpret_cast<const char*>(&dot.x), sizeof(dot.x));
      data.append(reinterpret_cast<const char*>(&dot.y), sizeof(dot.y));
      data.append(reinterpret_cast<const char*>(&colour), sizeof(colour));
    }
  }
  write_file(folder / (name + ".dat"), data);
  write_file(folder / (name + ".gp"), script_of(figure, name));
}

void draw_figure(const std::filesystem::path& folder, const std::string& name) {
  draw_by_gnuplot(folder / (name + ".gp"), folder / (name + ".png"));
}

}  // namespace dynains::program
