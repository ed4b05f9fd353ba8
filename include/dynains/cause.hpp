// The reason for the verdict on a point.
#pragma once

#include <cstddef>
#include <cstdint>

namespace dynains {

/// Cause of the verdict on one point. `dynains run` writes these numbers to the files
/// OUT/causes/NNNNNN.cause (one uint8 per input point, in input order): new causes go to the end.
enum class Cause : std::uint8_t {
  kUnknown = 0,
  kGround = 1,        ///< static: ground
  kSimilar = 2,       ///< static: similarity of occupancy not below tau_s (Eq. 12)
  kReverted = 3,      ///< static: proposed as dynamic, reverted by belief (Eq. 19) or too few votes
  kTooFewPoints = 4,  ///< static: cluster too small (not used by this pipeline)
  kTooFewScans = 5,   ///< static: cluster not in both the oldest and the newest scan (Eq. 11)
  kNotJudged = 6,     ///< invalid, out of range, or static without a cluster
  kProposed = 7,      ///< dynamic: proposed by occupancy and not reverted (Eq. 19)
  kFreeSpace = 8,     ///< dynamic: another scan saw its place free
  kWithInstance = 9,  ///< dynamic: other scans saw a part of its instance free
  kUnderInstance = 10,     ///< dynamic: ground point below a removed instance
  kNoEvidence = 11,        ///< static: no other scan saw its place
  kAlongTrack = 12,        ///< dynamic: its instance moved in other scans
  kPresumed = 13,          ///< dynamic, for the time being: no earlier scan saw its place
  kOccupied = 14,          ///< static: other scans saw its place occupied
  kTooLittleFree = 15,     ///< static: too few scans saw its place free, or too little of it
  kDynamicOccupancy = 16,  ///< dynamic: nearly all other points in its place moved
};

inline constexpr std::size_t kCauseCount = 17;

/// Whether a point with this cause is removed.
constexpr bool is_dynamic(Cause cause) {
  constexpr auto bit = [](Cause c) { return 1U << static_cast<unsigned>(c); };
  constexpr unsigned kDynamic = bit(Cause::kProposed) | bit(Cause::kFreeSpace) |
                                bit(Cause::kWithInstance) | bit(Cause::kUnderInstance) |
                                bit(Cause::kAlongTrack) | bit(Cause::kPresumed) |
                                bit(Cause::kDynamicOccupancy);
  return (kDynamic >> static_cast<unsigned>(cause) & 1U) != 0;
}

}  // namespace dynains
