// Version number. CMake reads it from this file.
#pragma once

namespace dynains {

inline constexpr int kVersionMajor = 0;
inline constexpr int kVersionMinor = 1;
inline constexpr int kVersionPatch = 0;
inline constexpr char kVersionString[] = "0.1.0";

}  // namespace dynains
