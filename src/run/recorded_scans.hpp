// Recorded scans as removers take them.
#pragma once

#include <cstddef>
#include <utility>

#include "dynains/config.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"

namespace dynains::run {

inline RawPoints<float> points_of(const RecordedScan& scan) {
  return {scan.xyzi.data(), scan.size(), 4, scan.sensor.empty() ? nullptr : scan.sensor.data()};
}

/// Sets the sensors of a recording of several.
inline void take_sensors(const Recording& recording, RemoverConfig& config) {
  if (!recording.sensors().empty()) config.sensors = recording.sensors();
}

/// Copies the coordinates of a scan.
inline void copy_points(const RecordedScan& scan, PointBuffer& points) {
  const std::size_t size = scan.size();
  points.resize(size);
  const RawPoints<float> cloud = points_of(scan);
  detail::CloudView(cloud).copy(0, size, points.x.data(), points.y.data(), points.z.data());
}

/// Returns `work()`. A PoseError from it gets the name of scan i.
template <class Work>
decltype(auto) naming_scan(const Recording& recording, std::size_t i, Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const PoseError& error) {
    throw PoseError("scan " + recording.name(i) + ": " + error.what());
  }
}

}  // namespace dynains::run
