// Poses and times of a recording, and how they belong to its scans.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "../points/point_clock.hpp"
#include "../scan_reader.hpp"
#include "dynains/io/recording.hpp"

namespace dynains {

// All functions throw IoError with path, position and expected content.

/// Finds poses and times of scans in files, and places the scans.
void read_poses(RecordingContents& r);
/// Places scans that have times by RecordingOptions::poses, or by the trajectory of `origin`, the
/// file that states it.
void pose_by_stamps(RecordingContents& r, const std::filesystem::path& origin);
/// Scans without poses: they have times, and count as matched when they get poses.
void leave_unplaced(RecordingContents& r);
/// See Recording::take_poses().
void take_poses(RecordingContents& r, std::size_t first, const std::vector<Pose>& T_world_sensor);
/// The clock of points by the times (s) of their scans, of which `read(i)` gives one with raw
/// times. `topic`: of the scans, for the warning about it; may be empty. Empty without times.
std::optional<PointClock> found_clock(RecordingContents& r, const std::string& topic,
                                      const std::vector<double>& times,
                                      const std::function<const RecordedScan&(std::size_t)>& read);
/// Finds the clock of the points, and the trajectory by which they are moved: rows with times of
/// their own, else the poses of the scans.
void prepare_deskewing(RecordingContents& r, const ScanReader& reader);

/// Pose of the scan of that index (see ScanEntry) under a convention; empty if it has none.
std::optional<Pose> pose_under(const RecordingContents& r, const PoseConvention& convention,
                               std::size_t index);
/// Pose of the sensor at a time of scans, s; empty outside of a trajectory with times.
std::optional<Pose> pose_at(const RecordingContents& r, double time);

}  // namespace dynains
