// What the evidence of other scans says of the points of one scan.
#pragma once

#include <cstdint>

#include "dynains/cause.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Points above the ground share the verdict of their group, which is the same group in every
/// verdict on a scan; of the ground only what moved is told.
struct EvidenceVerdict {
  struct Group {
    Cause cause = Cause::kNotJudged;  ///< why it moved or stays (see is_dynamic)
    float belief = 0.0F;              ///< that it moved, a probability

    friend bool operator==(const Group& a, const Group& b) {
      return a.cause == b.cause && a.belief == b.belief;
    }
  };
  struct GroundPoint {
    std::uint32_t point;  ///< number in the ground of the split
    Group verdict;
  };

  Span<const Group> groups;
  Span<const std::uint32_t> group_of;  ///< by point above the ground, in the order of the split
  Span<const GroundPoint> ground;      ///< each at most once
};

}  // namespace dynains
