// Points as compact bytes for a page.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "view_data.hpp"

namespace dynains::viewer {

struct PackedPoints {
  /// zlib stream of columns, each with one value per point: x, y, z, scan, instance (differences
  /// to the point before in its chunk, modulo 65536; first all low bytes, then all high bytes),
  /// intensity, belief, cause, and flags (label + 4 * truth), one byte each.
  std::string bytes;
  /// `unit`: step of x, y, z, m. `intensity`: value of 255. `chunks`: `layer` (0 map, 1 moving),
  /// `count` of points, `origin` of x, y, z in m.
  nlohmann::ordered_json description;
};

/// Packs the map and the moving points. The order of points is not kept. Coordinates are rounded to
/// 2 mm, intensities to steps of 1/255 of their 99th percentile, at which they are cut.
PackedPoints pack(const ViewData& data);

}  // namespace dynains::viewer
