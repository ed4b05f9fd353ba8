// A page of HTML without references to other files.
#pragma once

#include <ostream>

#include "view_data.hpp"

namespace dynains::viewer {

/// Writes the page of a run with its style, its program and the points. Needs WebGL 2 and
/// DecompressionStream to be shown (Firefox from 113 on, Chromium from 80 on).
void write_page(std::ostream& out, const ViewData& data);

}  // namespace dynains::viewer
