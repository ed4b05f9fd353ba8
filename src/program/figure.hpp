// Figures of a cloud of verdicts, drawn by gnuplot.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "picture.hpp"
#include "verdict_cloud.hpp"

namespace dynains::program {

enum class Content {
  kRaw,      ///< every point: static grey, dynamic blue (Fig. 1, top)
  kVerdict,  ///< kept grey, removed dynamic green, lost static orange, missed dynamic red
  kMap,      ///< the points that stay: kept grey, missed dynamic red (Fig. 1, bottom)
};

/// Whether points of this fate are part of the figure.
bool is_shown(Fate fate, Content content);

Colour colour_of(Fate fate, Content content);

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

  Content content = Content::kRaw;
  bool is_from_above = false;         ///< then it has axes and a scale bar
  int width = 1, height = 1;          ///< pixels
  double low_x = 0.0, low_y = 0.0;    ///< of the lower left corner
  double high_x = 1.0, high_y = 1.0;  ///< of the upper right corner
  /// By layer, in the order of drawing: plain points, then those that matter.
  std::array<std::vector<Dot>, kFateCount> layers;
};

/// View from above: world x to the right, y up, the longer side `pixels` long.
Figure view_from_above(const VerdictCloud& cloud, Content content, int pixels);

/// View from behind and above the start of the path, in its direction (towards dynamic points if
/// the sensor stands); 16:9, `pixels` wide.
Figure view_in_perspective(const VerdictCloud& cloud, Content content, int pixels);

/// Writes NAME.dat (for each dot x and y as float, colour as 0x00RRGGBB) and NAME.gp, which reads
/// it, into a folder. Throws IoError.
void write_figure(const Figure& figure, const std::filesystem::path& folder,
                  const std::string& name);

/// Draws NAME.png by NAME.gp. Throws IoError.
void draw_figure(const std::filesystem::path& folder, const std::string& name);

}  // namespace dynains::program
