#include "dynains/io/recording.hpp"
#include "dynains/io/trajectory.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

/// Three scans at the times 0, 1 and 2 s, and poses of a body that moves along x and turns about z.
void write_recording(const std::filesystem::path& folder, const std::string& poses) {
  for (const char* name : {"0", "1", "2"}) {
    write_text(folder / (std::string("velodyne/") + name + ".bin"), std::string(32, '\1'));
  }
  write_text(folder / "times.txt", "0\n1\n2\n");
  write_text(folder / "poses.txt", poses);
}

}  // namespace

TEST_CASE("The position of the sensor is three numbers or that of an extrinsic") {
  CHECK(read_sensor_origin("1, -2.5 3").isApprox(Eigen::Vector3d(1.0, -2.5, 3.0)));
  CHECK(read_sensor_origin("1 2 3 0 0 0 1").isApprox(Eigen::Vector3d(1.0, 2.0, 3.0)));
  for (const std::string wrong : {"1 2", "1 2 3 4", "1 2 x"}) {
    CHECK_THROWS_AS(read_sensor_origin(wrong), ConfigError);
  }
}

TEST_CASE("An extrinsic is seven numbers or a file with one pose") {
  const Eigen::Isometry3d pose = read_extrinsic("1, 2.5 -3,0 0 0.70710678 0.70710678");
  CHECK(pose.translation().isApprox(Eigen::Vector3d(1, 2.5, -3)));
  CHECK((pose.linear() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY(), 1e-6));
  CHECK(read_extrinsic(extrinsic_text(pose)).isApprox(pose, 1e-5));

  const TemporaryFolder folder;
  write_text(folder / "matrix.txt", "0 -1 0 1 1 0 0 2.5 0 0 1 -3\n");
  CHECK(read_extrinsic(folder / "matrix.txt").isApprox(pose, 1e-6));
  write_text(folder / "two.txt", "1 2 3 0 0 0 1\n1 2 3 0 0 0 1\n");
  CHECK_THAT(message_of<IoError>([&] { read_extrinsic(folder / "two.txt"); }),
             ContainsSubstring("two.txt: has 2 poses; expected"));
  CHECK_THAT(message_of<IoError>([&] { read_extrinsic(folder / "none.txt"); }),
             ContainsSubstring("none.txt"));
  for (const char* wrong : {"1 2 3 0 0 0", "1 2 3 0 0 0 1 2", "1 2 3 0 0 0 2", "1 2 nan 0 0 0 1"}) {
    CAPTURE(wrong);
    CHECK_THAT(message_of<ConfigError>([&] { read_extrinsic(wrong); }),
               ContainsSubstring("expected"));
  }
}

TEST_CASE("Poses of a body become poses of the sensor by the extrinsic") {
  const TemporaryFolder folder;
  write_recording(folder.path(),
                  "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0.70710678 0.70710678\n");
  RecordingOptions options;
  options.convention.T_body_sensor.translation() = Eigen::Vector3d(0.5, 0, 2);
  const Recording recording(folder.path(), options);
  CHECK(recording.T_world_sensor(1).translation().isApprox(Eigen::Vector3d(1.5, 0, 2)));
  CHECK(recording.T_world_sensor(2).translation().isApprox(Eigen::Vector3d(2, 0.5, 2), 1e-6));
}

TEST_CASE("A scan has the pose at its time plus the offset") {
  const TemporaryFolder folder;
  write_recording(folder.path(), "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 3 0 0 0 0 0 1\n");
  RecordingOptions options;
  options.time_offset = 0.25;
  const Recording recording(folder.path(), options);
  REQUIRE(recording.size() == 2);
  CHECK(recording.T_world_sensor(0).translation().x() == Approx(0.25));
  CHECK(recording.T_world_sensor(1).translation().x() == Approx(1.5));
  CHECK(recording.time(1) == 1.0);

  // Rows that belong to scans one by one have times, too.
  std::filesystem::remove(folder / "times.txt");
  CHECK(Recording(folder.path(), options).T_world_sensor(1).translation().x() == Approx(1.5));
  write_text(folder / "poses.txt", "0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n3 0 0 0 0 0 1\n");
  CHECK_THAT(message_of<IoError>([&] { Recording(folder.path(), options); }),
             ContainsSubstring("has no times"));
}

TEST_CASE("Poses are interpolated over gaps up to the given length") {
  const TemporaryFolder folder;
  write_recording(folder.path(), "0 0 0 0 0 0 0 1\n2 4 0 0 0 0 0 1\n");
  CHECK(Recording(folder.path()).missing_pose_count() == 1);
  RecordingOptions options;
  options.pose_gap = 2.0;
  const Recording recording(folder.path(), options);
  REQUIRE(recording.size() == 3);
  CHECK(recording.T_world_sensor(1).translation().x() == Approx(2.0));
}
