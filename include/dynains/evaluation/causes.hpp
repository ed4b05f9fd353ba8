// Why a pipeline decided as it did, one byte per point: what the error analysis can be told.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace dynains::evaluation {

/// Written as OUT/causes/NNNNNN.cause: one uint8 per input point, in input order. The numbers are
/// part of that format; new causes are added at the end.
enum class Cause : std::uint8_t {
  kUnknown = 0,
  kGround = 1,          ///< called ground
  kSimilar = 2,         ///< instance, but its occupancy hardly changed (similarity above tau_s)
  kReverted = 3,        ///< proposed as dynamic, reverted by the belief update
  kTooFewPoints = 4,    ///< cluster too small to be judged
  kTooFewScans = 5,     ///< cluster not seen in the scans that it takes to be judged
  kNotJudged = 6,       ///< invalid or out of range
  kProposed = 7,        ///< dynamic: proposed by occupancy and not reverted
  kFreeSpace = 8,       ///< dynamic: its place was seen free at another time
  kWithInstance = 9,    ///< dynamic: belongs to an instance that is dynamic elsewhere
  kUnderInstance = 10,  ///< ground under a removed instance, re-tested
  kNoEvidence = 11,     ///< static: nothing speaks against it
};

inline constexpr std::size_t kCauseCount = 12;

inline constexpr std::array<const char*, kCauseCount> kCauseNames = {
    "unknown",        "called ground",         "similarity too high", "belief reverted",
    "too few points", "too few scans",         "not judged",          "proposed by occupancy",
    "seen free",      "with dynamic instance", "under an instance",   "no evidence"};

}  // namespace dynains::evaluation
