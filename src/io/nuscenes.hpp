// Sweeps of the LiDAR in a folder of nuScenes, by its tables.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dynains/pose.hpp"

namespace dynains {

struct NuScenesSweep {
  std::filesystem::path file;  ///< .pcd.bin
  double time = 0.0;           ///< s
  Pose T_world_sensor = Pose::Identity();
};

struct NuScenesSweeps {
  std::vector<NuScenesSweep> sweeps;          ///< by time, at least one
  std::vector<std::filesystem::path> tables;  ///< that were read
};

/// The folder of the tables of `folder`: itself, or its subfolder v1.0-*; empty if it has none.
std::optional<std::filesystem::path> nuscenes_tables(const std::filesystem::path& folder);

/// Reads sample_data.json, ego_pose.json and calibrated_sensor.json, and sample.json and scene.json
/// if they are there. `scene`: name of a scene; empty: the only one. Memory grows with the number
/// of sweeps, not with the size of the tables. Throws IoError, also if this build has no JSON.
NuScenesSweeps read_nuscenes(const std::filesystem::path& folder,
                             const std::filesystem::path& tables, const std::string& scene);

}  // namespace dynains
