// Recorded scans as the clouds that removers take.
#pragma once

#include "dynains/io/recording.hpp"
#include "dynains/point_cloud_traits.hpp"

namespace dynains::program {

inline RawPoints<float> points_of(const RecordedScan& scan) {
  return {scan.xyzi.data(), scan.size(), 4};
}

}  // namespace dynains::program
