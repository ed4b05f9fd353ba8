// Removal of the distortion by the motion of the sensor during a scan.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>

#include "dynains/io/recording.hpp"
#include "dynains/io/trajectory.hpp"
#include "dynains/pose.hpp"
#include "point_clock.hpp"

namespace dynains {

/// Moves the points of a scan (sensor frame at the time of each point) to the sensor frame at the
/// stamp of the scan. Columns keep their values; points at the origin and points without a finite
/// time keep their place.
///
/// `motion`: T_world_sensor with times, s. It is interpolated within gaps of at most
/// kMaxPoseGap, and continued with constant velocity by at most kMaxScan. `stamp`: s,
/// `T_world_sensor`: the pose at that time.
///
/// `clock` gives the seconds from the stamp to the time of a point. Points whose time cannot be
/// that of the scan (see times_of_scan()) keep their place.
///
/// Throws IoError that begins with `place` for scans without a time for each point, for times that
/// are not those of the scan, and if the motion at the time of a point is not known.
void deskew(const Trajectory& motion, double stamp, const Pose& T_world_sensor,
            const PointClock& clock, const std::filesystem::path& place, RecordedScan& scan);

}  // namespace dynains
