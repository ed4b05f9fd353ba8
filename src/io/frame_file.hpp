// Fixed transforms between frames of a robot, from files.
#pragma once

#include <filesystem>

#include "log/transform_tree.hpp"

namespace dynains {

/// Whether the name ends in .urdf, .yaml or .yml.
bool is_frame_file(const std::filesystem::path& path);

/// The transforms of a robot description (URDF: origins of joints; joints that move count at their
/// zero position) or of static transforms in YAML. YAML: a list, or the list `transforms` of a map.
/// Each entry names its frames by `frame_id` or `parent` (also within `header`) and
/// `child_frame_id` or `child`, and has `x`, `y`, `z` (m) and `qx`, `qy`, `qz`, `qw` or `roll`,
/// `pitch`, `yaw` (rad), or `transform` with `translation` (x, y, z) and `rotation` (x, y, z, w),
/// as messages of ROS do. Throws IoError with the line.
TransformTree read_frame_file(const std::filesystem::path& path);

}  // namespace dynains
