#include "figure.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <utility>

#include "dynains/io/atomic_file.hpp"
#include "gnuplot.hpp"

namespace dynains::program {
namespace {

/// Static points get lighter with height, so that walls and trees stand out from the ground.
Colour shaded(Colour colour, double height) {
  const double light = std::clamp(0.55 + 0.07 * height, 0.55, 1.2);
  const auto scale = [&](std::uint8_t value) {
    return static_cast<std::uint8_t>(std::min(215.0, value * light));
  };
  return {scale(colour.r), scale(colour.g), scale(colour.b)};
}

/// Height that a share of the points lies below; the ground for small shares.
double height_quantile(const VerdictCloud& cloud, double share) {
  std::vector<float> heights;
  for (const VerdictCloud::Point& point : cloud.points()) heights.push_back(point.local.z());
  if (heights.empty()) return 0;
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(heights.size() - 1));
  std::nth_element(heights.begin(), heights.begin() + rank, heights.end());
  return heights[static_cast<std::size_t>(rank)];
}

/// Errors are drawn last, over correct points.
std::size_t layer_of(Fate fate, Content content) {
  if (content == Content::kRaw) return is_dynamic(fate) ? 1 : 0;
  return static_cast<std::size_t>(fate);
}

/// Chooses one point for each cell of a figure: of the highest layer, then the nearest.
class DotGrid {
 public:
  explicit DotGrid(Figure& figure)
      : figure_(figure),
        columns_((figure.width + Figure::kCell - 1) / Figure::kCell),
        cells_(static_cast<std::size_t>(columns_) *
               static_cast<std::size_t>((figure.height + Figure::kCell - 1) / Figure::kCell)) {}

  /// `x`, `y`: pixels from the lower left corner; points outside are left out.
  void add(double x, double y, double depth, std::size_t layer, Colour colour) {
    if (!(x >= 0.0 && x < figure_.width && y >= 0.0 && y < figure_.height)) return;
    const auto column = static_cast<std::size_t>(x / Figure::kCell);
    const auto row = static_cast<std::size_t>(y / Figure::kCell);
    Cell& cell = cells_[row * static_cast<std::size_t>(columns_) + column];
    const auto order = static_cast<int>(layer);
    if (order < cell.layer || (order == cell.layer && depth >= cell.depth)) return;
    cell = {order, depth, colour};
  }

  /// Dots in the middle of their cells.
  void finish() const {
    const double step_x = (figure_.high_x - figure_.low_x) / figure_.width * Figure::kCell;
    const double step_y = (figure_.high_y - figure_.low_y) / figure_.height * Figure::kCell;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const Cell& cell = cells_[i];
      if (cell.layer < 0) continue;
      const auto columns = static_cast<std::size_t>(columns_);
      const std::size_t row = i / columns;
      const std::size_t column = i % columns;
      figure_.layers[static_cast<std::size_t>(cell.layer)].push_back(
          {static_cast<float>(figure_.low_x + (static_cast<double>(column) + 0.5) * step_x),
           static_cast<float>(figure_.low_y + (static_cast<double>(row) + 0.5) * step_y),
           cell.colour});
    }
  }

 private:
  struct Cell {
    int layer = -1;
    double depth = 0.0;
    Colour colour;
  };

  Figure& figure_;
  int columns_;
  std::vector<Cell> cells_;
};

/// add(point, layer, colour) for every point that the figure shows.
template <class Add>
void for_each_shown(const VerdictCloud& cloud, Content content, Add&& add) {
  const double ground = height_quantile(cloud, 0.1);
  for (const VerdictCloud::Point& point : cloud.points()) {
    if (!is_shown(point.fate, content)) continue;
    const std::size_t layer = layer_of(point.fate, content);
    const Colour colour = colour_of(point.fate, content);
    add(point.local.cast<double>(), layer,
        layer == 0 ? shaded(colour, point.local.z() - ground) : colour);
  }
}

/// Horizontal direction of the path; towards dynamic points if the sensor stands.
Eigen::Vector3d viewing_direction(const VerdictCloud& cloud) {
  Eigen::Vector3d forward = cloud.path().back() - cloud.path().front();
  forward.z() = 0;
  if (forward.norm() < 1) {
    forward.setZero();
    for (const VerdictCloud::Point& point : cloud.points()) {
      if (is_dynamic(point.fate)) forward += point.local.cast<double>();
    }
    forward.z() = 0;
  }
  return forward.norm() > 0 ? Eigen::Vector3d(forward.normalized()) : Eigen::Vector3d::UnitX();
}

}  // namespace

bool is_shown(Fate fate, Content content) {
  return content != Content::kMap || fate == Fate::kKeptStatic || fate == Fate::kMissedDynamic;
}

Colour colour_of(Fate fate, Content content) {
  if (content != Content::kRaw) return kFateColours[static_cast<std::size_t>(fate)];
  return is_dynamic(fate) ? kRawDynamicColour
                          : kFateColours[static_cast<std::size_t>(Fate::kKeptStatic)];
}

Figure view_from_above(const VerdictCloud& cloud, Content content, int pixels) {
  Eigen::Array2d low = Eigen::Array2d::Zero();
  Eigen::Array2d high = Eigen::Array2d::Zero();
  for (const VerdictCloud::Point& point : cloud.points()) {
    const Eigen::Array2d p = point.local.head<2>().cast<double>().array();
    low = low.min(p);
    high = high.max(p);
  }
  const Eigen::Array2d size = (high - low).max(1.0);
  const double scale = (pixels - 1) / size.maxCoeff();  // pixels per m
  const auto side = [&](double metres) { return static_cast<int>(metres * scale) + 1; };
  Figure figure;
  figure.content = content;
  figure.is_from_above = true;
  figure.width = side(size.x());
  figure.height = side(size.y());
  figure.low_x = low.x();
  figure.low_y = low.y();
  figure.high_x = low.x() + figure.width / scale;
  figure.high_y = low.y() + figure.height / scale;
  DotGrid grid(figure);
  for_each_shown(cloud, content, [&](const Eigen::Vector3d& p, std::size_t layer, Colour colour) {
    grid.add((p.x() - low.x()) * scale, (p.y() - low.y()) * scale, -p.z(), layer, colour);
  });
  grid.finish();
  return figure;
}

Figure view_in_perspective(const VerdictCloud& cloud, Content content, int pixels) {
  Figure figure;
  figure.content = content;
  figure.width = pixels;
  figure.height = std::max(1, pixels * 9 / 16);
  figure.high_x = figure.width;
  figure.high_y = figure.height;
  if (cloud.path().empty()) return figure;
  const Eigen::Vector3d forward = viewing_direction(cloud);

  constexpr double kBack = 22, kUp = 16, kAhead = 25, kFocal = 0.9;  // m, m, m, picture widths
  const Eigen::Vector3d eye = -kBack * forward + kUp * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = (kAhead * forward - eye).normalized();
  const Eigen::Vector3d right = axis.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d up = right.cross(axis);
  DotGrid grid(figure);
  for_each_shown(cloud, content, [&](const Eigen::Vector3d& p, std::size_t layer, Colour colour) {
    constexpr double kNearest = 2;  // m
    const double depth = axis.dot(p - eye);
    if (depth < kNearest) return;
    const double scale = kFocal * figure.width / depth;
    grid.add(0.5 * figure.width + scale * right.dot(p - eye),
             0.5 * figure.height + scale * up.dot(p - eye), depth, layer, colour);
  });
  grid.finish();
  return figure;
}

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

/// Names of the layers for the legend, with their colours.
std::vector<std::pair<std::string, Colour>> legend_of(Content content) {
  if (content == Content::kRaw) {
    return {{"static", colour_of(Fate::kKeptStatic, content)},
            {"dynamic", colour_of(Fate::kRemovedDynamic, content)}};
  }
  std::vector<std::pair<std::string, Colour>> entries;
  const std::pair<Fate, const char*> names[] = {{Fate::kKeptStatic, "kept static"},
                                                {Fate::kRemovedDynamic, "removed dynamic"},
                                                {Fate::kLostStatic, "lost static"},
                                                {Fate::kMissedDynamic, "missed dynamic"}};
  for (const auto& [fate, name] : names) {
    if (is_shown(fate, content)) entries.emplace_back(name, colour_of(fate, content));
  }
  return entries;
}

/// The largest of 1, 2, 5, 10, 20, ... that is at most a quarter of `width`.
double bar_length(double width) {
  const double power = std::pow(10.0, std::floor(std::log10(0.25 * width)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= 0.25 * width) return factor * power;
  }
  return power;
}

/// Axes and a scale bar below the picture.
std::string axes_of(const Figure& figure) {
  if (!figure.is_from_above) return "unset border\nunset tics\n";
  const double bar = bar_length(figure.high_x - figure.low_x);
  std::ostringstream text;
  text << "set xlabel \"x (m)\"\nset ylabel \"y (m)\"\nset tics out nomirror\n"
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
  const auto entries = legend_of(figure.content);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    text << "keyentry with points pt 5 ps 1 lc rgb \"" << text_of(entries[i].second)
         << "\" title \"" << entries[i].first << '"'
         << (i + 1 < entries.size() ? ", \\\n  " : "\n");
  }
  return text.str();
}

void write_file(const std::filesystem::path& path, const std::string& bytes) {
  AtomicFile file(path);
  file.stream() << bytes;
  file.commit();
}

}  // namespace

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
