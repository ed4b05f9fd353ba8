// Figures of points, drawn by gnuplot.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "run/picture.hpp"

namespace dynains::program {

/// A figure: dots on a grid of cells of kCell pixels, at most one in a cell.
struct Figure {
  static constexpr int kCell = 2;  ///< pixels

  struct Dot {
    float x, y;  ///< m for a view from above; pixels, y up, in perspective
    Colour colour;
    friend bool operator==(const Dot& a, const Dot& b) {
      return a.x == b.x && a.y == b.y && a.colour == b.colour;
    }
  };
  struct LegendEntry {
    std::string name;  ///< printable
    Colour colour;
  };

  std::vector<LegendEntry> legend;
  bool is_from_above = false;         ///< then it has axes and a scale bar
  int width = 1, height = 1;          ///< pixels
  double low_x = 0.0, low_y = 0.0;    ///< of the lower left corner
  double high_x = 1.0, high_y = 1.0;  ///< of the upper right corner
  double origin_x = 0.0;              ///< m, world: place of x = 0 of a view from above
  double origin_y = 0.0;              ///< m, world
  /// By layer, in the order of drawing: plain points, then those that matter.
  std::vector<std::vector<Dot>> layers;
};

/// Chooses one point for each cell of a figure: of the highest layer, then the nearest.
class DotGrid {
 public:
  /// `figure`: its size in pixels and in its units, and its layers.
  explicit DotGrid(Figure figure);

  /// `x`, `y`: pixels from the lower left corner; points outside are left out.
  void add(double x, double y, double depth, std::size_t layer, Colour colour);

  /// The figure with dots in the middle of their cells.
  Figure figure() const;

 private:
  struct Cell {
    int layer = -1;
    double depth = 0.0;
    Colour colour;
  };

  Figure figure_;
  int columns_;
  std::vector<Cell> cells_;
};

/// View from above: x to the right, y up. Of each cell, the highest point of the last layer is
/// drawn. Memory: a cell of DotGrid for each 4 pixels.
class ViewFromAbove {
 public:
  /// Shows the places from `low` to `high` (m); the longer side has `pixels` pixels.
  ViewFromAbove(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int pixels,
                std::size_t layers, std::vector<Figure::LegendEntry> legend);

  /// `point`: m, in the frame of `low`.
  void add(const Eigen::Vector3d& point, std::size_t layer, Colour colour) {
    grid_.add((point.x() - low_.x()) * scale_, (point.y() - low_.y()) * scale_, -point.z(), layer,
              colour);
  }

  /// `origin`: world position of x = y = 0, m; written at the axes.
  Figure figure(const Eigen::Vector2d& origin = Eigen::Vector2d::Zero()) const;

 private:
  Eigen::Vector2d low_;
  double scale_;  // pixels per m
  DotGrid grid_;
};

/// Writes NAME.dat (for each dot x and y as float, colour as 0x00RRGGBB) and NAME.gp, which reads
/// it, into a folder. Throws IoError.
void write_figure(const Figure& figure, const std::filesystem::path& folder,
                  const std::string& name);

/// Draws NAME.png by NAME.gp. Throws IoError.
void draw_figure(const std::filesystem::path& folder, const std::string& name);

}  // namespace dynains::program
