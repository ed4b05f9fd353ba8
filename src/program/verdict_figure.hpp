// Figures of a cloud of verdicts.
#pragma once

#include "figure.hpp"
#include "run/verdict_cloud.hpp"

namespace dynains::program {

enum class Content {
  kRaw,      ///< every point: static grey, dynamic blue (Fig. 1, top)
  kVerdict,  ///< kept grey, removed dynamic green, lost static orange, missed dynamic red
  kMap,      ///< the points that stay: kept grey, missed dynamic red (Fig. 1, bottom)
};

/// Whether points of this fate are part of the figure.
bool is_shown(Fate fate, Content content);

Colour colour_of(Fate fate, Content content);

/// View from above: world x to the right, y up, the longer side `pixels` long. One layer per fate.
Figure view_from_above(const VerdictCloud& cloud, Content content, int pixels);

/// View from behind and above the start of the path, in its direction (towards dynamic points if
/// the sensor stands); 16:9, `pixels` wide.
Figure view_in_perspective(const VerdictCloud& cloud, Content content, int pixels);

}  // namespace dynains::program
