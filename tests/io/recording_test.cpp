#include "dynains/io/recording.hpp"

#include "dynains/io/kitti.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

/// A scan of points around `centre`, as PCD; `viewpoint` is the line after the keyword.
std::string pcd(const Eigen::Vector3d& centre, const std::string& viewpoint = "0 0 0 1 0 0 0",
                const std::vector<double>& intensities = {0.5, 0.5, 0.5}) {
  std::string text =
      "VERSION 0.7\nFIELDS x y z intensity ring time\nSIZE 8 8 8 4 2 8\nTYPE F F F F U F\n"
      "COUNT 1 1 1 1 1 1\nWIDTH 3\nHEIGHT 1\nVIEWPOINT " +
      viewpoint + "\nPOINTS 3\nDATA ascii\n";
  for (const int i : {1, 2, 3}) {
    text += std::to_string(centre.x() + i) + ' ' + std::to_string(centre.y()) + ' ' +
            std::to_string(centre.z()) + ' ' +
            std::to_string(intensities[static_cast<std::size_t>(i - 1)]) + ' ' + std::to_string(i) +
            " 7.25\n";
  }
  return text;
}

std::string ply() {
  return "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
         "float z\nend_header\n1 2 3\n";
}

std::string tum(double time, double x) {
  return std::to_string(time) + ' ' + std::to_string(x) + " 0 0 0 0 0 1\n";
}

std::string error_of(const fs::path& folder, const RecordingOptions& options = {}) {
  return message_of<IoError>([&] { Recording recording(folder, options); });
}

bool tells(const Recording& recording, const std::string& note) {
  const std::vector<std::string>& notes = recording.notes();
  return std::find(notes.begin(), notes.end(), note) != notes.end();
}

/// Writes a raw scan of one point, or a PLY, for each name.
void write_scans(const fs::path& folder, const std::vector<std::string>& names,
                 const std::string& ending = ".bin") {
  for (const std::string& name : names) {
    write_text(folder / (name + ending), ending == ".ply" ? ply() : std::string(16, 'B'));
  }
}

/// Times (s) of scans whose files have these names, without poses.
std::vector<double> recorded_times(const std::vector<std::string>& names) {
  const TemporaryFolder folder;
  write_scans(folder / "velodyne", names);
  RecordingOptions options;
  options.without_poses = true;
  const Recording recording(folder.path(), options);
  std::vector<double> times;
  for (std::size_t i = 0; i < recording.size(); ++i) times.push_back(recording.time(i));
  return times;
}

}  // namespace

TEST_CASE("Scans in the world frame with VIEWPOINT come back in the sensor frame") {
  const TemporaryFolder folder;
  // Poses at (100, 0, 0) and (101, 0, 0), turned by 90 degrees around z.
  write_text(folder / "pcd/000007.pcd", pcd({100, 0, 0}, "100 0 0 0.70710678 0 0 0.70710678"));
  write_text(folder / "pcd/000009.pcd", pcd({101, 0, 0}, "101 0 0 0.70710678 0 0 0.70710678"));
  write_text(folder / "gt_cloud.pcd", pcd({0, 0, 0}));
  const Recording recording(folder.path());
  REQUIRE(recording.size() == 2);
  CHECK(recording.name(1) == "000009");
  CHECK(recording.number(1) == 9);
  CHECK(recording.frame() == PointFrame::kWorld);
  const RecordedScan scan = recording.read_scan(1);
  REQUIRE(scan.size() == 3);
  // One metre along x of the world is one metre along -y of the sensor.
  CHECK(scan.point(0).position.isApprox(Eigen::Vector3d(0, -1, 0), 1e-5));
  CHECK(scan.xyzi[3] == 0.5F);
  CHECK(scan.ring == std::vector<std::uint16_t>{1, 2, 3});
  CHECK(scan.time == std::vector<double>{7.25, 7.25, 7.25});
}

TEST_CASE("Intensities 0 and 1 of scans with VIEWPOINT are labels, others are not") {
  using Intensities = std::vector<double>;
  const std::string placed = "100 0 0 1 0 0 0";
  const auto labels_of = [&](const Intensities& first, const Intensities& second) {
    const TemporaryFolder folder;
    write_text(folder / "pcd/1.pcd", pcd({100, 0, 0}, placed, first));
    write_text(folder / "pcd/2.pcd", pcd({100, 0, 0}, placed, second));
    const Recording recording(folder.path());
    return recording.has_labels() ? recording.read_labels(1) : std::vector<std::uint32_t>();
  };
  CHECK(labels_of({0, 0, 0}, {0, 1, 0}) == std::vector<std::uint32_t>{99, 259, 99});
  CHECK(labels_of({0, 0, 0}, {0, 0.5, 1}).empty());
  CHECK(labels_of({0, 0, 0}, {0, 0, 0}).empty());
  CHECK(labels_of({1, 1, 1}, {1, 1, 1}).empty());

  const TemporaryFolder folder;
  write_text(folder / "pcd/1.pcd", pcd({100, 0, 0}, "0 0 0 1 0 0 0", {0, 1, 0}));
  write_text(folder / "poses.txt", pose_row());
  CHECK_FALSE(Recording(folder.path()).has_labels());
}

TEST_CASE("points of several sensors have numbers in files beside the scans, or in a column") {
  const TemporaryFolder folder;
  write_text(folder / "poses.txt", "1 0 0 10 0 1 0 20 0 0 1 30\n");
  RecordingOptions options;
  SECTION("files") {
    write_text(folder / "a1.pcd", pcd({4, 5, 6}));
    write_text(folder / "sensors.txt", "1 0 0 1 0 1 0 0.5 0 0 1 2\n1 0 0 1 0 1 0 -0.5 0 0 1 2\n");
    write_text(folder / "sensor/a1.id", std::string("\1\0\1", 3));
    const Recording recording(folder.path());
    REQUIRE(recording.sensors().size() == 2);
    CHECK(recording.sensors()[1].translation().isApprox(Eigen::Vector3d(1.0, -0.5, 2.0)));
    CHECK((recording.read_scan(0).sensor == std::vector<std::uint8_t>{1, 0, 1}));
    CHECK(tells(recording, "points are of 2 sensors"));
    write_text(folder / "sensor/a1.id", "\1\1");
    CHECK_THROWS_WITH(recording.read_scan(0),
                      ContainsSubstring("expected a byte for each of the scan's 3 points"));
    options.sensor_origin.x() = 1.0;
    CHECK_THROWS_AS(Recording(folder.path(), options), ConfigError);
  }
  SECTION("a column, which counts the beams of all") {
    write_text(folder / "a1.csv", "x,y,z,laser_number\n4,5,6,31\n4,5,7,32\n4,5,8,63\n4,5,9,-1\n");
    CHECK(Recording(folder.path()).read_scan(0).sensor.empty());
    options.sensors.assign(2, Pose::Identity());
    options.sensor_beams = 32;
    const Recording recording(folder.path(), options);
    CHECK((recording.read_scan(0).sensor == std::vector<std::uint8_t>{0, 1, 1, 7}));
  }
}

TEST_CASE(
    "With the position of the sensor in the clouds, points and poses are those of the sensor") {
  const TemporaryFolder folder;
  RecordingOptions options;
  options.sensor_origin = {1.0, 0.0, 1.5};
  SECTION("clouds of a body") {
    write_text(folder / "a1.pcd", pcd({4, 5, 6}));
    write_text(folder / "poses.txt", "0 -1 0 10 1 0 0 20 0 0 1 30\n");
    const Recording recording(folder.path(), options);
    const Eigen::Vector3d first = recording.read_scan(0).point(0).position;
    CHECK(first.isApprox(Eigen::Vector3d(4.0, 5.0, 4.5), 1e-5));
    CHECK(recording.T_world_sensor(0).translation().isApprox(Eigen::Vector3d(10.0, 21.0, 31.5)));
    CHECK(tells(recording, "the sensor is at (1 0 1.5) m in the frame of the clouds"));
  }
  SECTION("clouds of the world, placed by poses of a body") {
    write_text(folder / "a1.pcd", pcd({100, 0, 0}, "100 0 0 1 0 0 0"));
    options.frame = PointFrame::kWorld;
    const Recording recording(folder.path(), options);
    const Eigen::Vector3d first = recording.read_scan(0).point(0).position;
    CHECK(first.isApprox(Eigen::Vector3d(0.0, 0.0, -1.5), 1e-5));
  }
  SECTION("a position that no sensor has") {
    write_text(folder / "a1.pcd", pcd({4, 5, 6}, "1 0 0 1 0 0 0"));
    options.sensor_origin.y() = 1000.0;
    CHECK_NOTHROW(Recording(folder.path(), options));
    for (const double wrong : {1000.1, std::nan("")}) {
      options.sensor_origin.y() = wrong;
      CHECK_THROWS_AS(Recording(folder.path(), options), ConfigError);
    }
  }
}

TEST_CASE("Options of another kind of recording are refused") {
  const TemporaryFolder folder;
  write_text(folder / "a1.ply", ply());
  write_text(folder / "poses.txt", pose_row());
  const auto refusal = [&](auto&& set) {
    RecordingOptions options;
    set(options);
    return message_of<ConfigError>([&] { Recording(folder.path(), options); });
  };
  for (const auto option : {&RecordingOptions::cloud_topic, &RecordingOptions::cloud_frame,
                            &RecordingOptions::pose_topic, &RecordingOptions::pose_frame,
                            &RecordingOptions::sensor_frame}) {
    CHECK_THAT(refusal([&](auto& o) { o.*option = "x"; }),
               ContainsSubstring("are for logs of ROS"));
  }
  CHECK_THAT(refusal([](auto& o) { o.scene = "x"; }),
             ContainsSubstring("--nuscenes-scene is for nuScenes"));
  CHECK_THAT(refusal([](auto& o) { o.point_time_unit = 1.0; }),
             ContainsSubstring("--point-time-unit is for points with times; these have none"));
}

TEST_CASE("The frame of the points is detected, and can be forced") {
  const TemporaryFolder folder;
  write_text(folder / "a1.pcd", pcd({0, 0, 0}, "100 0 0 1 0 0 0"));
  write_text(folder / "a2.pcd", pcd({0, 0, 0}, "101 0 0 1 0 0 0"));
  CHECK(Recording(folder.path()).frame() == PointFrame::kSensor);
  CHECK(Recording(folder.path()).read_scan(0).xyzi[0] == 1.0F);
  RecordingOptions options;
  options.frame = PointFrame::kWorld;
  CHECK(Recording(folder.path(), options).read_scan(0).xyzi[0] == -99.0F);
}

TEST_CASE("Names are ordered by the numbers in them") {
  const TemporaryFolder folder;
  write_scans(folder / "scans", {"scan10", "scan9", "scan1"}, ".ply");
  write_text(folder / "poses.txt", "0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n2 0 0 0 0 0 1\n");
  const Recording recording(folder.path());
  CHECK(recording.name(0) == "scan1");
  CHECK(recording.name(1) == "scan9");
  CHECK(recording.name(2) == "scan10");
  CHECK(recording.number(2) == 2);
  CHECK(recording.T_world_sensor(2).translation().x() == 2.0);
  CHECK(recording.time(2) == Approx(0.2));
  CHECK(recording.read_scan(0).xyzi == std::vector<float>{1.0F, 2.0F, 3.0F, 0.0F});
  CHECK(recording.read_scan(0).ring.empty());
}

TEST_CASE("Times in names find their poses by interpolation, and scans without pose are left out") {
  const TemporaryFolder folder;
  write_scans(folder.path(), {"1600000000.00", "1600000000.25", "1600000000.50", "1600000009.00"},
              ".ply");
  write_text(folder / "trajectory.tum",
             tum(1600000000.0, 0.0) + tum(1600000000.5, 2.0) + tum(1600000000.9, 2.0));
  const Recording recording(folder.path());
  REQUIRE(recording.size() == 3);
  CHECK(recording.scan_file_count() == 4);
  CHECK(recording.time(1) == 1600000000.25);
  CHECK(recording.T_world_sensor(1).translation().x() == Approx(1.0));
  CHECK(recording.T_world_sensor(2).translation().x() == Approx(2.0));
  REQUIRE(recording.warnings().size() == 1);
  CHECK_THAT(recording.warnings()[0],
             ContainsSubstring("1 of 4 scans have no pose and are left out, 1600000009.00 first"));

  write_text(folder / "trajectory.tum", tum(5.0, 0.0) + tum(6.0, 2.0));
  CHECK_THAT(error_of(folder.path()),
             ContainsSubstring("trajectory.tum: has poses from 5 s to 6 s for 0 of 4 scans"));
}

TEST_CASE("A pose that no map can take is refused with its file and scan") {
  const TemporaryFolder folder;
  write_text(folder / "a.pcd", pcd({0, 0, 0}));
  write_text(folder / "b.pcd", pcd({0, 0, 0}));
  for (const bool is_far : {false, true}) {
    const std::string far_row = "1 0 0 1e300 0 1 0 0 0 0 1 0\n";
    write_text(folder / "poses.txt", pose_row() + (is_far ? far_row : pose_row(2e7)));
    const std::string error = error_of(folder.path());
    if (is_far) {
      CHECK_THAT(error, StartsWith((folder / "poses.txt").string() + ": pose of scan b: ") &&
                            ContainsSubstring("a translation of 1e+300 m"));
    } else {
      CHECK(error == "(nothing was thrown)");
    }
  }
}

TEST_CASE("A shift gives every scan the pose of a neighbour") {
  const TemporaryFolder folder;
  write_scans(folder / "velodyne", {"0", "1", "2"});
  write_text(folder / "poses.txt", tum(1, 10) + tum(2, 11) + tum(3, 12));
  RecordingOptions options;
  options.convention.shift = 1;
  const Recording recording(folder.path(), options);
  REQUIRE(recording.size() == 2);
  CHECK(recording.name(0) == "0");
  CHECK(recording.T_world_sensor(0).translation().x() == 11.0);
  CHECK(recording.T_world_sensor(1).translation().x() == 12.0);
  options.convention.shift = 3;
  CHECK_THAT(error_of(folder.path(), options), ContainsSubstring("no pose for any scan"));
}

TEST_CASE("calib.txt and times.txt are beside the poses or in the folder") {
  const TemporaryFolder folder;
  const fs::path scans = folder / "velodyne";
  write_scans(scans, {"000000", "000001"});
  write_text(folder / "calib.txt", "Tr: 0 -1 0 0.1 0 0 -1 -0.5 1 0 0 0\n");
  write_text(folder / "poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 2\n");
  write_text(folder / "times.txt", "0\n0.25\n");
  const Recording whole(folder.path());
  // Tr^-1 P Tr. Axes of the camera: z forward, x right, y down; of the sensor: x forward, y left.
  CHECK(whole.T_world_sensor(0).isApprox(Eigen::Isometry3d::Identity(), 1e-15));
  REQUIRE(whole.T_world_sensor(1).translation().isApprox(Eigen::Vector3d(2, -1, 0), 1e-12));

  const Recording inner(scans);
  CHECK(inner.has_calibration());
  CHECK(inner.time(1) == 0.25);
  CHECK(inner.T_world_sensor(1).isApprox(whole.T_world_sensor(1), 1e-15));

  // A times.txt beside the poses is ignored if its number of rows does not fit.
  write_text(folder / "times.txt", "0\n");
  const Recording without(scans);
  CHECK(without.time(1) == 0.1);
  const std::string times = folder / "times.txt";
  CHECK(tells(without, "not used: " + times + " has 1 rows for 2 scans"));
  CHECK_THAT(error_of(folder.path()), ContainsSubstring("times.txt"));

  // Poses of another folder come with their calib.txt. Their times.txt may belong to other scans.
  const fs::path copy = folder / "elsewhere/scans";
  fs::create_directories(copy);
  for (const auto& file : fs::directory_iterator(scans)) fs::copy(file, copy);
  RecordingOptions options;
  options.poses = folder / "poses.txt";
  const Recording other(copy, options);
  CHECK(other.T_world_sensor(1).isApprox(whole.T_world_sensor(1), 1e-15));
  CHECK(other.time(1) == 0.1);
}

TEST_CASE("A calib.txt that cannot be read is an error for poses of a camera only") {
  const TemporaryFolder folder;
  write_text(folder / "velodyne/000000.bin", std::string(32, 'a'));
  write_text(folder / "calib.txt", "of another kind\n");
  write_text(folder / "poses.txt", tum(1, 7));
  const Recording recording(folder.path());
  CHECK_FALSE(recording.has_calibration());
  CHECK(recording.T_world_sensor(0).translation().x() == 7.0);
  CHECK_THAT(recording.notes()[1], StartsWith("not used: ") && ContainsSubstring("calib.txt"));

  RecordingOptions options;
  options.convention.frame = PoseFrame::kCamera;
  CHECK_THAT(error_of(folder.path(), options), ContainsSubstring("calib.txt"));
  write_text(folder / "poses.txt", pose_row(7));
  CHECK_THAT(error_of(folder.path()), ContainsSubstring("calib.txt"));
  options.convention.frame = PoseFrame::kLidar;
  CHECK(Recording(folder.path(), options).T_world_sensor(0).translation().x() == 7.0);
}

TEST_CASE("Folders that are no recording are refused with a reason") {
  const TemporaryFolder folder;
  const fs::path seq = folder / "seq";
  CHECK_THAT(error_of(seq), ContainsSubstring("is not a folder; expected a KITTI folder"));
  fs::create_directory(seq);
  CHECK_THAT(error_of(seq), ContainsSubstring("has no scans"));
  fs::create_directory(seq / "velodyne");
  CHECK_THAT(error_of(seq), ContainsSubstring("velodyne: has no scans"));

  write_text(seq / "velodyne/a.ply", ply());
  CHECK_THAT(error_of(seq), ContainsSubstring("poses.txt: not found: expected a pose"));
  write_text(seq / "velodyne/b.pcd", pcd({0, 0, 0}));
  CHECK_THAT(error_of(seq), ContainsSubstring("scans of one kind, found a.ply and b.pcd"));
  fs::remove(seq / "velodyne/a.ply");
  CHECK_THAT(error_of(seq), ContainsSubstring("poses.txt: not found"));

  write_text(seq / "poses.txt", tum(1, 0) + tum(2, 0));
  CHECK_THAT(error_of(seq), ContainsSubstring("poses.txt:2: expected a row for each of 1 scans"));
  write_text(seq / "poses.txt", tum(1, 0));
  CHECK(Recording(seq).size() == 1);
  write_text(seq / "times.txt", "1\n2\n");
  CHECK_THAT(error_of(seq), ContainsSubstring("times.txt:2: expected a row for each of 1 scans"));
  fs::remove(seq / "times.txt");

  write_text(seq / "velodyne/b.pcd",
             "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH "
             "99999999999\nDATA binary\n1234");
  CHECK_THAT(error_of(seq),
             ContainsSubstring("b.pcd: byte") && ContainsSubstring("99999999999 points"));
  write_text(seq / "velodyne/b.pcd", "no header\n");
  CHECK_THAT(error_of(seq), ContainsSubstring("b.pcd:1: expected a line of a PCD header"));
}

TEST_CASE("Folders and devices in the place of files are refused before they are read") {
  const TemporaryFolder folder;
  const fs::path seq = folder / "seq";
  write_text(seq / "0.ply", ply());
  write_text(seq / "poses.txt", tum(1, 0));
  const std::string device = "is a device or a pipe; expected a file";
  for (const auto& [file, reason] : {std::pair<fs::path, std::string>("/dev/null", device),
                                     {"/dev/zero", device},
                                     {seq, "is a folder; expected a file"},
                                     {seq / "none.txt", "No such file or directory"}}) {
    for (const auto role : {&RecordingOptions::times, &RecordingOptions::poses}) {
      RecordingOptions options;
      options.*role = file;
      CHECK(error_of(seq, options) == file.string() + ": cannot be read: " + reason);
    }
  }
  CHECK_THAT(error_of(""), StartsWith("\"\": is not a folder; expected a KITTI folder"));
}

TEST_CASE("Names need not be UTF-8") {
  const TemporaryFolder folder;
  write_text(folder / "scan\xff\xfe 1.ply", ply());
  write_text(folder / "poses.txt", tum(1, 0));
  const Recording recording(folder.path());
  CHECK(recording.name(0) == "scan\xff\xfe 1");
  CHECK(recording.read_scan(0).size() == 1);
}

TEST_CASE("Values that are not finite are read, and labels of a column are read") {
  const TemporaryFolder folder;
  write_text(
      folder / "0.ply",
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty "
      "float z\nproperty uint label\nend_header\nnan inf 3 252\n1 2 3 40\n");
  write_text(folder / "poses.txt", tum(1, 0));
  const Recording recording(folder.path());
  const RecordedScan scan = recording.read_scan(0);
  CHECK(std::isnan(scan.xyzi[0]));
  CHECK(std::isinf(scan.xyzi[1]));
  CHECK(recording.has_labels());
  CHECK(recording.read_labels(0) == std::vector<std::uint32_t>{252, 40});
}

TEST_CASE("Two scans with one name are refused") {
  const TemporaryFolder folder;
  for (const char* const name : {"a.pcd", "a.PCD", "b.pcd"}) {
    write_text(folder / name, pcd({1, 2, 3}, "1 0 0 1 0 0 0"));
  }
  CHECK_THAT(error_of(folder.path()),
             ContainsSubstring("expected scans of different names, found ") &&
                 ContainsSubstring("a.pcd") && ContainsSubstring("a.PCD"));
}

namespace {

/// Points of a floor in rows; `columns` values each, the fourth and later ones 7.
template <class Number>
std::string raw_scan(int columns, int points = 300) {
  std::string bytes;
  for (int i = 0; i < points; ++i) {
    for (int column = 0; column < columns; ++column) {
      const double values[] = {5.0 + 0.05 * (i % 100), 2.0 + 0.5 * (i / 100), -1.5};
      bytes += packed(static_cast<Number>(column < 3 ? values[column] : 7.0));
    }
  }
  return bytes;
}

}  // namespace

TEST_CASE("Raw scans with other columns are refused with the option, and read with it") {
  const TemporaryFolder folder;
  write_text(folder / "poses.txt", pose_row(0));
  const fs::path file = folder / "velodyne/000000.bin";
  struct Case {
    std::string bytes;
    std::string option;
  };
  // 300 points of 3, 5, 6 or 8 floats are a multiple of 16 bytes, too.
  for (const Case& one :
       {Case{raw_scan<float>(3), "3"}, Case{raw_scan<float>(5), "5"}, Case{raw_scan<float>(6), "6"},
        Case{raw_scan<double>(3), "3d"}, Case{raw_scan<double>(4), "4d"}}) {
    CAPTURE(one.option);
    write_text(file, one.bytes);
    CHECK_THAT(error_of(folder.path()),
               StartsWith(file.string() + ": does not ") && ContainsSubstring("--bin-columns"));
    RecordingOptions options;
    options.bin_layout = parse_bin_layout(one.option);
    const Recording recording(folder.path(), options);
    const RecordedScan scan = recording.read_scan(0);
    REQUIRE(scan.size() == 300);
    CHECK(recording.point_count(0) == 300);
    CHECK(scan.xyzi[4 * 101] == 5.05F);
    CHECK(scan.xyzi[4 * 101 + 2] == -1.5F);
    CHECK(scan.xyzi[3] == (options.bin_layout.columns > 3 ? 7.0F : 0.0F));
    CHECK(recording.columns().intensity == (options.bin_layout.columns > 3));
  }
  write_text(file, raw_scan<float>(4));
  CHECK(Recording(folder.path()).read_scan(0).xyzi[4 * 101] == 5.05F);
  // The beams of a non-repeating sensor take turns: each second point is near, the next one is not.
  std::string alternating;
  for (int i = 0; i < 600; ++i) {
    const double angle = 0.005 * i + (i % 2) * M_PI;
    alternating += bytes_of<float>(
        {static_cast<float>(9.0 * std::cos(angle)), static_cast<float>(7.0 * std::sin(angle)),
         -1.5F + 0.01F * static_cast<float>(i % 40), 0.1F * static_cast<float>(i % 7)});
  }
  write_text(file, alternating);
  CHECK(Recording(folder.path()).read_scan(0).size() == 600);
  // As of HeLiPR: float32 x y z intensity, uint32 time, three uint16.
  std::string mixed;
  const std::string floats = raw_scan<float>(4, 320);
  for (std::size_t i = 0; i < 320; ++i) mixed += floats.substr(16 * i, 16) + "0123456789";
  for (const std::size_t points : {std::size_t{320}, std::size_t{319}}) {
    write_text(file, mixed.substr(0, 26 * points));
    CHECK_THAT(error_of(folder.path()), ContainsSubstring("--bin-columns 4:26 reads it"));
    RecordingOptions options;
    options.bin_layout = parse_bin_layout("4:26");
    const RecordedScan scan = Recording(folder.path(), options).read_scan(0);
    REQUIRE(scan.size() == points);
    CHECK(scan.xyzi[4 * 101] == 5.05F);
    CHECK(scan.xyzi[4 * 101 + 3] == 7.0F);
  }
  write_text(file, raw_scan<float>(5, 21));
  CHECK_THAT(message_of<IoError>([&] { Recording(folder.path()).point_count(0); }),
             ContainsSubstring("truncated at byte 420: expected a multiple of 16 bytes"));
  for (const char* wrong : {"", "d", "2", "65", "4.5", "4f", "4:15", "4:"}) {
    CHECK_THAT(message_of<ConfigError>([&] { parse_bin_layout(wrong); }),
               ContainsSubstring(": expected 3 to 64"));
  }
}

TEST_CASE("Files of scans that are cut off are left out on demand") {
  const TemporaryFolder folder;
  for (const char* name : {"1.pcd", "2.pcd", "3.pcd"}) {
    write_text(folder / name, pcd({-0.5, 0, 0}, std::string("10") + name[0] + " 0 0 1 0 0 0"));
  }
  fs::resize_file(folder / "2.pcd", fs::file_size(folder / "2.pcd") - 100);
  CHECK_THAT(error_of(folder.path()), ContainsSubstring("2.pcd"));
  RecordingOptions options;
  options.accept_missing = true;
  const Recording recording(folder.path(), options);
  REQUIRE(recording.size() == 2);
  CHECK(recording.T_world_sensor(1).translation().x() == 103.0);
  CHECK_THAT(
      recording.warnings().at(0),
      StartsWith("1 of 3 scan files are broken and left out: ") && ContainsSubstring("2.pcd"));
}

TEST_CASE("Points in the boxes of the own vehicle count as beams without a return") {
  const TemporaryFolder folder;
  write_text(folder / "1.pcd", pcd({-0.5, 0, 0}, "100 0 0 1 0 0 0"));
  const auto x_of_first = [&](const std::string& boxes) {
    RecordingOptions options;
    options.frame = PointFrame::kSensor;
    options.self_boxes = parse_self_boxes(boxes);
    const Recording recording(folder.path(), options);
    const RecordedScan scan = recording.read_scan(0);
    CHECK(scan.size() == recording.point_count(0));
    return scan.xyzi[0];
  };
  CHECK(x_of_first("0.51 -1 -1 1 1 1") == 0.5F);
  CHECK(x_of_first("0.49 -1 -1 1 1 1") == 0.0F);
  CHECK(x_of_first("1, 1, 1, 0.49, -1, -1") == 0.0F);
  CHECK(x_of_first("2 2 2 3 3 3; 0 -1 -1 1 1 1") == 0.0F);
  for (const char* wrong : {"", "1 2 3 4 5", "1 2 3 4 5 6 7", "1 2 3 4 5 x", "1 2 3 4 5 inf"}) {
    CHECK_THAT(message_of<ConfigError>([&] { parse_self_boxes(wrong); }),
               ContainsSubstring("expected six finite numbers for each box"));
  }
}

TEST_CASE("Coordinates in millimetres become metres, also in the world frame") {
  const TemporaryFolder folder;
  write_text(folder / "1.pcd", pcd({100000, 0, 0}, "100 0 0 0.70710678 0 0 0.70710678"));
  write_text(folder / "2.pcd", pcd({101000, 0, 0}, "101 0 0 0.70710678 0 0 0.70710678"));
  RecordingOptions options;
  options.point_unit = 0.001;
  const Recording world(folder.path(), options);
  CHECK(world.frame() == PointFrame::kWorld);
  CHECK(Eigen::Vector3f(world.read_scan(1).xyzi.data())
            .isApprox(Eigen::Vector3f(0.0F, -0.001F, 0.0F), 1e-3F));
  options.frame = PointFrame::kSensor;
  CHECK(Recording(folder.path(), options).read_scan(0).xyzi[0] == Approx(100.001F));
}

TEST_CASE("Poses may begin with a mark of UTF-8") {
  const TemporaryFolder folder;
  const std::string kMark = "\xEF\xBB\xBF";
  write_scans(folder / "velodyne", {"000000"});
  for (const std::string& rows : {pose_row(7), tum(1, 7)}) {
    write_text(folder / "poses.txt", kMark + rows);
    CHECK(Recording(folder.path()).T_world_sensor(0).translation().x() == 7.0);
  }
  write_text(folder / "poses.txt", pose_row(7));
  write_text(folder / "times.txt", kMark + "2.5\n");
  CHECK(Recording(folder.path()).time(0) == 2.5);
}

TEST_CASE("Rows of KITTI-360 belong to the scans of their number") {
  const TemporaryFolder folder;
  const std::string scans = GENERATE("velodyne", "velodyne_points/data");
  write_scans(folder / scans, {"0000000001", "0000000002", "0000000004"});
  write_text(folder / "poses.txt", "1 " + pose_row(10) + "3 " + pose_row(30) + "4 " + pose_row(40));
  const Recording recording(folder.path());
  REQUIRE(recording.size() == 2);
  CHECK(recording.T_world_sensor(1).translation().x() == 40.0);
  CHECK(recording.time(1) - recording.time(0) == Approx(0.3));
  CHECK(recording.missing_pose_count() == 1);
  // Times of a matrix are no numbers of scans.
  write_text(folder / "poses.txt",
             "0.5 " + pose_row(10) + "1.5 " + pose_row(30) + "4 " + pose_row(40));
  CHECK(Recording(folder.path()).time(2) == 4.0);
}

TEST_CASE("Digits behind the point of a name are decimals, or nanoseconds without leading zeros") {
  constexpr double kSecond = 1700000000.0;
  const auto check = [&](const std::vector<std::string>& names, double first, double second) {
    const std::vector<double> times = recorded_times(names);
    REQUIRE(times.size() == 2);
    CHECK(times[0] - kSecond == Approx(first).margin(1e-6));
    CHECK(times[1] - kSecond == Approx(second).margin(1e-6));
  };
  check({"1700000000.11149430", "1700000000.111494300"}, 0.01114943, 0.1114943);
  check({"1700000000.011149430", "1700000000.111494300"}, 0.01114943, 0.1114943);
  check({"1700000000.25", "1700000001.5"}, 0.25, 1.5);
  check({"1700000000.011149430", "1700000001.5"}, 0.01114943, 1.5);
}

TEST_CASE("Parts of a second in names are read so that scans follow each other evenly") {
  using Names = std::vector<std::string>;
  const auto times = [](const Names& names) {
    std::vector<long> milliseconds;
    for (const double time : recorded_times(names)) {
      milliseconds.push_back(std::lround(1e3 * (time - 1700000000.0)));
    }
    return milliseconds;
  };
  const std::vector<long> counted = {911, 1011, 1111, 1211};
  const std::string a = "1700000000", b = "1700000001";
  CHECK(times({a + ".911149", b + ".11149", b + ".111149", b + ".211149"}) == counted);
  CHECK(times({a + "_911149", b + "_11149", b + "_111149", b + "_211149"}) == counted);
  CHECK(times({a + ".911", b + ".11", b + ".111", b + ".211"}) == counted);
  CHECK(times({a + ".7", a + ".8", a + ".901", b + ".0"}) ==
        std::vector<long>{700, 800, 901, 1000});
}

TEST_CASE("Names of 19 digits are times") {
  const TemporaryFolder folder;
  write_scans(folder / "velodyne", {"1566535940000000000", "1566535940100000000"});
  write_text(folder / "poses.txt",
             "1566535940000000000 " + pose_row(1) + "1566535940100000000 " + pose_row(2));
  const Recording recording(folder.path());
  REQUIRE(recording.size() == 2);
  CHECK(recording.time(1) - recording.time(0) == Approx(0.1));
  CHECK(recording.T_world_sensor(1).translation().x() == 2.0);
}

TEST_CASE("Folders of SC-LIO-SAM are read") {
  const TemporaryFolder folder;
  write_text(folder / "sc/Scans/000000.pcd", pcd({1, 0, 0}));
  write_text(folder / "sc/optimized_poses.txt", pose_row(3));
  CHECK(Recording(folder / "sc").T_world_sensor(0).translation().x() == 3.0);
}
