// Files of the page, embedded by CMake.
#pragma once

#include <string_view>

namespace dynains::viewer {

extern const std::string_view kPageHtml;
extern const std::string_view kPageStyle;
extern const std::string_view kPageScript;

}  // namespace dynains::viewer
