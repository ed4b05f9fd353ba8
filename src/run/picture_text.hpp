// Plain text in a picture.
#pragma once

#include <string>

#include "picture.hpp"

namespace dynains::program {

/// Height of text, pixels.
inline constexpr int kTextHeight = 14;

/// Width of a text, pixels.
int text_width(const std::string& text);

/// Draws lower-case letters, digits, ':' and blanks; other characters are blanks. `x`, `y`: upper
/// left corner, pixels. What lies outside of the picture is left out.
void draw_text(Picture& picture, int x, int y, const std::string& text, Colour colour);

}  // namespace dynains::program
