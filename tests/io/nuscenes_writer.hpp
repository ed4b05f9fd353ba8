// A folder of nuScenes for tests: two scenes of two sweeps each.
#pragma once

#include <string>

#include "files.hpp"

namespace dynains::test {

inline const std::string kSampleData = R"([
{"token": "d4", "sample_token": "s2", "ego_pose_token": "e4", "calibrated_sensor_token": "c2",
 "timestamp": 1532402927747951, "is_key_frame": true, "height": 0, "prev": "", "next": "",
 "filename": "samples/LIDAR_TOP/d__LIDAR_TOP__4.pcd.bin"},
{"token": "d2", "sample_token": "s1", "ego_pose_token": "e2", "calibrated_sensor_token": "c1",
 "timestamp": 1532402927697951, "filename": "sweeps/LIDAR_TOP/b__LIDAR_TOP__2.pcd.bin"},
{"token": "d1", "sample_token": "s1", "ego_pose_token": "e1", "calibrated_sensor_token": "c1",
 "timestamp": 1532402927647951, "filename": "samples/LIDAR_TOP/a__LIDAR_TOP__1.pcd.bin"},
{"token": "d3", "sample_token": "s2", "ego_pose_token": "e3", "calibrated_sensor_token": "c2",
 "timestamp": 1532402927797951, "filename": "sweeps/LIDAR_TOP/c__LIDAR_TOP__3.pcd.bin"},
{"token": "x", "filename": "samples/CAM_FRONT/x.jpg", "prev": null, "nested": {"filename": [1]}}])";

inline const std::string kEgoPoses = R"([
{"token": "e1", "rotation": [1, 0, 0, 0], "translation": [600.5, 1600.0, 0.0], "timestamp": 1},
{"token": "e2", "rotation": [0, 0, 0, 1], "translation": [601.5, 1600.0, 0.0]},
{"token": "e3", "rotation": [1, 0, 0, 0], "translation": [0, 0, 0]},
{"token": "e4", "rotation": [1, 0, 0, 0], "translation": [0, 0, 0]},
{"token": "unused", "rotation": [], "translation": "none"}])";

inline const std::string kSensors = R"([
{"token": "c1", "rotation": [1.0, 0.0, 0.0, 0.0], "translation": [0.5, 0.25, 1.5],
 "camera_intrinsic": []},
{"token": "c2", "rotation": [1.0, 0.0, 0.0, 0.0], "translation": [0, 0, 2]}])";

inline const std::string kScenes =
    R"([{"token": "n1", "name": "scene-0061"}, {"token": "n2", "name": "scene-0103"}])";
inline const std::string kSamples =
    R"([{"token": "s1", "scene_token": "n1"}, {"token": "s2", "scene_token": "n2"}])";

inline void write_nuscenes(const std::filesystem::path& folder) {
  const std::filesystem::path tables = folder / "v1.0-mini";
  write_text(tables / "sample_data.json", kSampleData);
  write_text(tables / "ego_pose.json", kEgoPoses);
  write_text(tables / "calibrated_sensor.json", kSensors);
  write_text(tables / "scene.json", kScenes);
  write_text(tables / "sample.json", kSamples);
  for (const char* name :
       {"samples/LIDAR_TOP/a__LIDAR_TOP__1", "sweeps/LIDAR_TOP/b__LIDAR_TOP__2",
        "sweeps/LIDAR_TOP/c__LIDAR_TOP__3", "samples/LIDAR_TOP/d__LIDAR_TOP__4"}) {
    const float points[] = {1, 2, 3, 40, 31, 4, 5, 6, 50, 0};
    write_text(folder / (name + std::string(".pcd.bin")),
               {reinterpret_cast<const char*>(points), sizeof(points)});
  }
}

}  // namespace dynains::test
