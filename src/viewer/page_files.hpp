// Files of the pages, embedded by CMake.
#pragma once

#include <string_view>

namespace dynains::viewer {

extern const std::string_view kPageHtml;
extern const std::string_view kPageStyle;
extern const std::string_view kPageScript;
extern const std::string_view kMapPageHtml;
extern const std::string_view kMapPageScript;

}  // namespace dynains::viewer
