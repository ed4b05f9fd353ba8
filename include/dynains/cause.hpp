// Why a point got its verdict: what tells the next engineer where to work.
#pragma once

#include <cstddef>
#include <cstdint>

namespace dynains {

/// Cause of the verdict on one point. The numbers are those of the files OUT/causes/NNNNNN.cause
/// that `dynains run` writes (one uint8 per input point, in input order): new causes are added at
/// the end.
enum class Cause : std::uint8_t {
  kUnknown = 0,
  kGround = 1,          ///< static: called ground
  kSimilar = 2,         ///< static: occupancy hardly changed (similarity not below tau_s)
  kReverted = 3,        ///< static: proposed as dynamic, reverted by belief or for want of votes
  kTooFewPoints = 4,    ///< static: cluster too small to be judged (not by this pipeline)
  kTooFewScans = 5,     ///< static: cluster not seen in the scans that it takes to be judged
  kNotJudged = 6,       ///< invalid, out of range, or static because beyond the range of clusters
  kProposed = 7,        ///< dynamic: proposed by occupancy and not reverted
  kFreeSpace = 8,       ///< dynamic: its place was seen free at another time
  kWithInstance = 9,    ///< dynamic: belongs to an instance that was seen free elsewhere
  kUnderInstance = 10,  ///< dynamic: called ground, but stands below a removed instance
  kNoEvidence = 11,     ///< static: no other scan saw its place
  kAlongTrack = 12,     ///< dynamic: its instance was seen to move in other scans
  kPresumed = 13,       ///< dynamic until the next scans tell: no scan before saw its place
  kOccupied = 14,       ///< static: other scans saw its place occupied
  kTooLittleFree = 15,  ///< static: its place was seen free, but not often or not widely enough
  kInPassage = 16,      ///< dynamic: nearly all else that was met in its place moved
};

inline constexpr std::size_t kCauseCount = 17;

/// Whether a point with this cause is removed.
constexpr bool is_dynamic(Cause cause) {
  constexpr auto bit = [](Cause c) { return 1U << static_cast<unsigned>(c); };
  constexpr unsigned kDynamic = bit(Cause::kProposed) | bit(Cause::kFreeSpace) |
                                bit(Cause::kWithInstance) | bit(Cause::kUnderInstance) |
                                bit(Cause::kAlongTrack) | bit(Cause::kPresumed) |
                                bit(Cause::kInPassage);
  return (kDynamic >> static_cast<unsigned>(cause) & 1U) != 0;
}

}  // namespace dynains
