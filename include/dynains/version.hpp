// Version number. CMake reads it from this file.
#pragma once

namespace dynains {

inline constexpr int kVersionMajor = 1;
inline constexpr int kVersionMinor = 0;
inline constexpr int kVersionPatch = 0;
inline constexpr char kVersionString[] = "1.0.0";

}  // namespace dynains
