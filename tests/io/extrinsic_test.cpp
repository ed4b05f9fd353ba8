#include "dynains/io/extrinsic.hpp"

#include <string>

#include "dynains/errors.hpp"
#include "dynains/io/recording.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

#if defined(DYNAINS_HAS_EXPAT)
constexpr bool kHasUrdf = true;
#else
constexpr bool kHasUrdf = false;
#endif
#if defined(DYNAINS_HAS_YAML)
constexpr bool kHasYaml = true;
#else
constexpr bool kHasYaml = false;
#endif

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

namespace {

/// `file` holds the lidar 1 m ahead of a mast, which is 2 m above base_link and yawed by 90 deg.
void check_mast(const std::string& file) {
  CAPTURE(file);
  const Eigen::Isometry3d pose = read_extrinsic(file + ":base_link:lidar");
  CHECK(pose.translation().isApprox(Eigen::Vector3d(0, 1, 2), 1e-6));
  CHECK((pose.linear() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY(), 1e-6));
  CHECK(read_extrinsic(file + ":lidar:base_link").isApprox(pose.inverse(), 1e-9));
  for (const std::string& frames : {std::string(), std::string(":base_link:camera")}) {
    CHECK_THAT(message_of<ConfigError>([&] { read_extrinsic(file + frames); }),
               ContainsSubstring(file + ":BODY:LIDAR") &&
                   ContainsSubstring("it has base_link, lidar, mast"));
  }
}

/// Refused with the line and an expectation.
void check_refused(const std::string& name, const std::string& content, const std::string& line,
                   const std::string& what) {
  CAPTURE(name, content);
  const TemporaryFolder folder;
  write_text(folder / name, content);
  const std::string file = folder / name;
  CHECK_THAT(message_of<IoError>([&] { read_extrinsic(file + ":base_link:lidar"); }),
             StartsWith(file + ":" + line + ": ") && ContainsSubstring(what));
}

}  // namespace

TEST_CASE("An extrinsic is found in a robot description by two frames") {
  if (!kHasUrdf) return;
  const TemporaryFolder folder;
  write_text(folder / "robot.urdf",
             "<?xml version='1.0'?>\n<robot name='r'>\n  <link name='base_link'/>\n"
             "  <joint name='a' type='fixed'>\n    <parent link='base_link'/><child link='mast'/>\n"
             "    <origin xyz='0 0 2' rpy='0 0 1.5707963267948966'/>\n  </joint>\n"
             "  <joint name='b' type='fixed'><origin xyz='1 0 0'/><parent link='mast'/>"
             "<child link='lidar'/></joint>\n</robot>\n");
  check_mast(folder / "robot.urdf");

  check_refused("a.urdf", "<robot>\n<joint>\n", "3", "expected a robot description");
  check_refused("b.urdf", "\n<sdf/>\n", "2", "expected an element <robot>, found <sdf>");
  check_refused("c.urdf", "", "1", "expected a robot description");
  check_refused("d.urdf", "<robot>\n<joint>\n<origin xyz='1 2'/></joint></robot>", "3",
                "expected three numbers as xyz, found \"1 2\"");
  check_refused("e.urdf", "<robot><joint>\n<origin rpy='1 2 nan'/></joint></robot>", "2",
                "expected three numbers as rpy");
  check_refused("f.urdf", "<robot>\n<joint><parent link='a'/></joint></robot>", "2",
                "expected the names of two frames");
  const std::string joint = "<joint><parent link='a'/><child link='b'/></joint>\n";
  check_refused("g.urdf", "<robot>\n" + joint + joint + "</robot>", "3",
                "frame b has a transform already");
}

TEST_CASE("An extrinsic is found in static transforms by two frames") {
  if (!kHasYaml) return;
  const TemporaryFolder folder;
  write_text(folder / "flat.yaml",
             "- {parent: base_link, child: mast, x: 0, y: 0, z: 2, roll: 0, pitch: 0,"
             " yaw: 1.5707963267948966}\n"
             "- {frame_id: mast, child_frame_id: lidar, x: 1, y: 0, z: 0}\n");
  check_mast(folder / "flat.yaml");
  std::string star;
  for (int i = 0; i < 60; ++i) {
    star += "- {parent: base_link, child: f" + std::to_string(i) + ", x: 0, y: 0, z: 0}\n";
  }
  write_text(folder / "star.yaml", star);
  CHECK_THAT(message_of<ConfigError>([&] { read_extrinsic(folder / "star.yaml"); }),
             ContainsSubstring("it has base_link, f0, f1, ") && ContainsSubstring(" and 11 more"));
  write_text(folder / "message.yml",
             "transforms:\n- header:\n    frame_id: base_link\n  child_frame_id: mast\n"
             "  transform:\n    translation: {x: 0, y: 0, z: 2}\n"
             "    rotation: {x: 0, y: 0, z: 0.70710678, w: 0.70710678}\n"
             "- header: {frame_id: mast}\n  child_frame_id: lidar\n  transform:\n"
             "    translation: {x: 1.0, y: 0, z: 0}\n    rotation: {x: 0, y: 0, z: 0, w: 1}\n");
  check_mast(folder / "message.yml");

  check_refused("a.yaml", "x: [1,\n", "2", "expected static transforms (YAML)");
  check_refused("b.yaml", "x: 1\n", "1", "expected a list of transforms");
  check_refused("c.yaml", "", "1", "expected a list of transforms");
  check_refused("d.yaml", "\n- {parent: a, child: b, x: 0, y: zero, z: 1}\n", "2",
                "expected a number as y");
  check_refused("e.yaml", "- {parent: a, child: b, x: 0, y: 0}\n", "1", "expected a number as z");
  check_refused("f.yaml", "- {parent: a, child: b}\n", "1", "expected x, y and z");
  check_refused("g.yaml", "- {child: b, x: 0, y: 0, z: 0}\n", "1",
                "expected the names of two frames");
  check_refused("h.yaml", "- {parent: a, child: b, x: 0, y: 0, z: 0, qx: 0, qy: 0, qz: 0, qw: 2}\n",
                "1", "expected a quaternion of length 1");
  check_refused("j.yaml", "- {parent: a, child: b, x: 0, y: 1e200, z: 0}\n", "1",
                "expected frames at most 100 km apart");
  check_refused("i.yaml", "- 7\n", "1", "expected x, y and z");
}

TEST_CASE("Files of frames have a limit of nesting") {
  if (!kHasUrdf || !kHasYaml) return;
  const auto nested = [](std::size_t count, const std::string& open, const std::string& close) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i) text += open;
    for (std::size_t i = 0; i < count; ++i) text += close;
    return text;
  };
  const TemporaryFolder folder;
  for (const bool is_deep : {false, true}) {
    const std::size_t depth = is_deep ? 200000 : 60;
    write_text(folder / "frames.yaml", nested(depth, "[", "]"));
    write_text(folder / "robot.urdf", "<robot>" + nested(depth, "<a>", "</a>") + "</robot>");
    for (const std::string file : {"frames.yaml", "robot.urdf"}) {
      const std::string text = (folder / file).string() + ":a:b";
      const std::string message = message_of<std::exception>([&] { read_extrinsic(text); });
      CHECK_THAT(message, ContainsSubstring(file));
      CHECK((message.find("at most 64 nested") != std::string::npos) == is_deep);
    }
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
