// Dumps of hdl_graph_slam: one folder for each keyframe.
#pragma once

#include <filesystem>
#include <vector>

#include "dynains/pose.hpp"

namespace dynains {

inline constexpr const char* kKeyframeCloud = "cloud.pcd";

/// Folders in `folder` whose names are numbers and that hold cloud.pcd and data, by number.
std::vector<std::filesystem::path> keyframe_folders(const std::filesystem::path& folder);

struct Keyframe {
  double time = 0.0;  ///< s
  Pose T_world_sensor = Pose::Identity();
};

/// Reads `stamp SECONDS NANOSECONDS` and the 4x4 matrix below `estimate`. Throws IoError with the
/// line.
Keyframe read_keyframe(const std::filesystem::path& file);

}  // namespace dynains
