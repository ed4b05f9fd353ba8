// Names of causes in the error analysis.
#pragma once

#include <array>

#include "dynains/verdict.hpp"

namespace dynains::evaluation {

using dynains::Cause;
using dynains::kCauseCount;

inline constexpr std::array<const char*, kCauseCount> kCauseNames = {"unknown",
                                                                     "called ground",
                                                                     "similarity too high",
                                                                     "belief reverted",
                                                                     "too few points",
                                                                     "too few scans",
                                                                     "not judged",
                                                                     "proposed by occupancy",
                                                                     "seen free",
                                                                     "with dynamic instance",
                                                                     "under an instance",
                                                                     "no evidence",
                                                                     "along its track",
                                                                     "presumed",
                                                                     "seen occupied",
                                                                     "seen free too little",
                                                                     "dynamic occupancy",
                                                                     "came or went",
                                                                     "stands"};

}  // namespace dynains::evaluation
