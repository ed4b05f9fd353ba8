// Sweeps of nuScenes as recordings.

#include "dynains/io/recording.hpp"
#include "nuscenes_writer.hpp"
#include "support/catch.hpp"

namespace dynains {

using namespace test;

namespace {

RecordingOptions scene(const std::string& name) {
  RecordingOptions options;
  options.scene = name;
  return options;
}

std::string opening_error(const fs::path& path, const RecordingOptions& options) {
  return message_of<IoError>([&] { Recording recording(path, options); });
}

/// Whether this build has JSON; without, the error must name its package.
bool can_read(const fs::path& folder) {
  const std::string error = opening_error(folder, scene("scene-0061"));
  const bool has_json = error.find("nlohmann-json3-dev") == std::string::npos;
  return has_json;
}

}  // namespace

TEST_CASE("nuScenes: sweeps of a scene by time, with poses of the vehicle and of the sensor") {
  const TemporaryFolder folder;
  write_nuscenes(folder.path());
  if (!can_read(folder.path())) return;
  for (const fs::path& path : {folder.path(), folder / "v1.0-mini"}) {
    CAPTURE(path);
    const Recording recording(path, scene("scene-0061"));
    REQUIRE(recording.size() == 2);
    CHECK(recording.format() == ScanFormat::kNuScenes);
    CHECK(recording.frame() == PointFrame::kSensor);
    CHECK(recording.name(0) == "a__LIDAR_TOP__1");
    CHECK(recording.name(1) == "b__LIDAR_TOP__2");
    CHECK(recording.time(1) - recording.time(0) == Approx(0.05).margin(1e-6));
    CHECK(recording.T_world_sensor(0).translation().isApprox(Eigen::Vector3d(601, 1600.25, 1.5)));
    CHECK(recording.T_world_sensor(1).translation().isApprox(Eigen::Vector3d(601, 1599.75, 1.5)));
    CHECK(recording.point_count(1) == 2);
    const RecordedScan scan = recording.read_scan(1);
    CHECK(scan.xyzi == std::vector<float>{1, 2, 3, 40, 4, 5, 6, 50});
    CHECK(scan.ring == std::vector<std::uint16_t>{31, 0});
    CHECK(recording.files().size() == 7);
  }
  CHECK(Recording(folder.path(), scene("scene-0103")).name(0) == "d__LIDAR_TOP__4");
}

TEST_CASE("nuScenes: a scene that is not clear or not there is refused with the list of scenes") {
  const TemporaryFolder folder;
  write_nuscenes(folder.path());
  if (!can_read(folder.path())) return;
  for (const std::string name : {"", "scene-1"}) {
    CHECK_THAT(opening_error(folder.path(), scene(name)),
               ContainsSubstring("scene.json: expected one scene, by --nuscenes-scene; found "
                                 "scene-0061, scene-0103"));
  }
  fs::remove(folder / "v1.0-mini" / "scene.json");
  CHECK(Recording(folder.path()).size() == 4);
  CHECK_THAT(opening_error(folder.path(), scene("scene-0061")),
             ContainsSubstring("scene.json: expected"));
}

TEST_CASE("nuScenes: malformed tables and sweeps are refused with file and place") {
  struct Case {
    std::string table, content, expected;
  };
  const std::vector<Case> cases = {
      {"sample_data", "", "byte 1: expected JSON"},
      {"sample_data", "[{\"filename\": \"a.pcd.bin\"", "expected JSON, an array of objects"},
      {"sample_data", "[]", "expected sweeps of a LiDAR (.pcd.bin), found none"},
      {"sample_data", "[[[[1]]], 2, \"filename\"]", "found none"},
      {"sample_data", "[{\"token\": \"a\"}]", "row 0: expected a text \"filename\""},
      {"sample_data", "[{\"filename\": 5}]", "row 0: expected a text \"filename\""},
      {"sample_data", "[{\"filename\": \"a.pcd.bin\", \"sample_token\": \"s1\"}]",
       "row 0: expected a text \"ego_pose_token\""},
      {"ego_pose", "[]", "expected a row with the token e1"},
      {"ego_pose", "[{\"token\": \"e1\", \"translation\": [1, 2]}]",
       "row 0: expected 3 numbers \"translation\""},
      {"ego_pose", "[{\"token\": \"e1\", \"translation\": [1, 2, 3], \"rotation\": [1, 1, 1, 1]}]",
       "row 0: expected a finite translation and a quaternion of length 1"},
      {"calibrated_sensor", "[{\"token\": \"c1\", \"rotation\": [[1], 0, 0, 0]}]",
       "row 0: expected 3 numbers \"translation\""},
      {"scene", "[{\"token\": \"n1\"}]", "row 0: expected a text \"name\""},
      {"sample", "{", "expected JSON"},
      {"ego_pose", "[{\"token\": \"e1\", \"translation\": [1e999, 2, 3]}]",
       "ego_pose.json: expected numbers within the range of double"},
  };
  for (const Case& wrong : cases) {
    CAPTURE(wrong.table, wrong.content);
    const TemporaryFolder folder;
    write_nuscenes(folder.path());
    if (!can_read(folder.path())) return;
    write_text(folder / "v1.0-mini" / (wrong.table + ".json"), wrong.content);
    const std::string error = opening_error(folder.path(), scene("scene-0061"));
    CHECK_THAT(error, StartsWith((folder / "v1.0-mini" / (wrong.table + ".json")).string()) &&
                          ContainsSubstring(wrong.expected));
  }
  const TemporaryFolder folder;
  write_nuscenes(folder.path());
  const fs::path sweep = folder / "samples/LIDAR_TOP/a__LIDAR_TOP__1.pcd.bin";
  write_text(sweep, "12345678901234567890x");
  const Recording recording(folder.path(), scene("scene-0061"));
  CHECK_THAT(message_of<IoError>([&] { recording.point_count(0); }),
             StartsWith(sweep.string()) && ContainsSubstring("expected a multiple of 20"));
  fs::remove(sweep);
  CHECK_THROWS_AS(recording.point_count(0), IoError);
}

TEST_CASE("Sweeps of nuScenes without tables are scans with five columns") {
  const TemporaryFolder folder;
  write_nuscenes(folder.path());
  const fs::path sweeps = folder / "sweeps" / "LIDAR_TOP";
  write_text(sweeps / "poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 0\n");
  const Recording recording(sweeps);
  CHECK(recording.format() == ScanFormat::kNuScenes);
  CHECK(recording.name(1) == "c__LIDAR_TOP__3");
  CHECK(recording.read_scan(1).ring == std::vector<std::uint16_t>{31, 0});
}

}  // namespace dynains
