// Verdict by free space on the points of one scan.
#pragma once

#include <cstdint>

#include "dynains/cause.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Non-ground points share the verdict of their group; groups are the same in every verdict on a
/// scan. Ground points are static unless they are listed.
struct EvidenceVerdict {
  struct Group {
    Cause cause = Cause::kNotJudged;  ///< see is_dynamic()
    float belief = 0.0F;              ///< probability of being dynamic

    friend bool operator==(const Group& a, const Group& b) {
      return a.cause == b.cause && a.belief == b.belief;
    }
  };
  struct GroundPoint {
    std::uint32_t point;  ///< number in the ground of the split
    Group verdict;
  };

  Span<const Group> groups;
  Span<const std::uint32_t> group_of;  ///< by non-ground point, in the order of the split
  Span<const GroundPoint> ground;      ///< dynamic ground points, each at most once
};

}  // namespace dynains
