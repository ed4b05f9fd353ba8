// Test of poses: registrations of merged scans that begin at the poses must stay there.
#pragma once

#include <cstddef>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "merged_scans.hpp"
#include "motion_registration.hpp"

namespace dynains {

/// What the scans at some places of a recording say about poses.
struct PoseTest {
  /// Certain motions: to the next scan, and over some metres.
  std::vector<RegisteredMotion> motions;
  std::size_t stride = 0;           ///< median number of scans between scans of `as_given`
  Agreement as_given;               ///< of merged scans some metres apart
  Agreement standing;               ///< likewise, without motion
  std::vector<Mounting> mountings;  ///< by place
};

/// Places of a test: `count`, evenly spread over the scans `first` to `last` (inclusive), and two
/// more at the start of the recording if `looks_at_start`.
struct TestPlaces {
  std::size_t first = 0;
  std::size_t last = 0;
  std::size_t count = 6;
  bool looks_at_start = true;
};

/// Tests `pose_of`. `on_scan`: see ScanMerger. Throws IoError.
PoseTest test_poses(const Recording& recording, const PoseOfScan& pose_of, const TestPlaces& places,
                    const ScanMerger::OnScan& on_scan = {});

}  // namespace dynains
