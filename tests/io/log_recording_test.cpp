// Logs as recordings: topics, poses, labels, files.

#include "db3_writer.hpp"
#include "dynains/io/recording.hpp"
#include "io/logs/decompress.hpp"
#include "log_writer.hpp"
#include "support/catch.hpp"

namespace dynains {

using namespace test;

namespace {

const Eigen::Isometry3d kT_base_lidar = pose_at(0.5, M_PI / 2);

const std::vector<LogChannel> kDrive = {kClouds, kTf, kStaticTf};  // of drive_by_transforms()

/// Four clouds in frame `frame`, one metre apart along x.
std::vector<WrittenMessage> drive_by_transforms(MessageEncoding encoding = MessageEncoding::kCdr,
                                                const std::string& frame = "lidar") {
  std::vector<WrittenMessage> messages = {
      transform_at(2, 1.0, "base", "lidar", kT_base_lidar, encoding)};
  for (int i = 0; i < 4; ++i) {
    const double time = 1.0 + 0.1 * i;
    messages.push_back(transform_at(1, time, "odom", "base", pose_at(i, 0), encoding));
    messages.push_back({0, nanoseconds(time + 0.03), small_cloud(time, frame, encoding)});
  }
  return messages;
}

/// Three clouds in frame `frame` on channel 0, and `poses` on channel 1.
std::vector<WrittenMessage> clouds_with(const std::string& frame,
                                        const std::vector<std::string>& poses) {
  std::vector<WrittenMessage> messages;
  for (std::size_t i = 0; i < 3; ++i) {
    const double time = 1.0 + 0.1 * static_cast<double>(i);
    messages.push_back(cloud_at(0, time, frame));
    if (i < poses.size()) messages.push_back({1, nanoseconds(time), poses[i]});
  }
  return messages;
}

std::vector<std::string> three_odometries(const std::string& child) {
  std::vector<std::string> messages;
  for (int i = 0; i < 3; ++i) {
    messages.push_back(odometry(1.0 + 0.1 * i, child, pose_at(i, 0.1)));
  }
  return messages;
}

std::string log_error(const fs::path& log, const RecordingOptions& options = {}) {
  return message_of<IoError>([&] { Recording(log, options); });
}

/// A log in a folder of its own.
struct Log {
  void write(const std::vector<LogChannel>& channels,
             const std::vector<WrittenMessage>& messages) const {
    write_text(path, mcap_file(channels, messages, {}));
  }
  std::string error(const RecordingOptions& options = {}) const { return log_error(path, options); }
  Pose pose(std::size_t scan, const RecordingOptions& options = {}) const {
    return Recording(path, options).T_world_sensor(scan);
  }

  TemporaryFolder folder;
  fs::path path = folder / "drive.mcap";
};

bool has_note(const Recording& recording, const std::string& part) {
  return std::any_of(recording.notes().begin(), recording.notes().end(),
                     [&](const auto& note) { return note.find(part) != std::string::npos; });
}

void check_drive(const fs::path& log) {
  CAPTURE(log);
  const Recording recording(log);
  REQUIRE(recording.size() == 4);
  CHECK(recording.format() == ScanFormat::kLog);
  CHECK(recording.name(3) == "000003");
  CHECK(recording.number(3) == 3);
  CHECK(recording.time(2) == Approx(1.2));
  CHECK(recording.T_world_sensor(2).isApprox(pose_at(2, 0) * kT_base_lidar, 1e-9));
  CHECK(recording.point_count(1) == 2);
  CHECK(recording.read_scan(1).xyzi == std::vector<float>{1, 2, 3, 0, 4, 5, 6, 0});
  CHECK_FALSE(recording.columns().ring);
  CHECK_FALSE(recording.has_labels());
  CHECK_FALSE(recording.early_end());
  CHECK(recording.files() == std::vector<fs::path>{log});
}

}  // namespace

TEST_CASE("A frame of the log gives the position of the sensor in the clouds") {
  const Log log;
  log.write(kDrive, drive_by_transforms(MessageEncoding::kCdr, "base"));
  RecordingOptions options;
  options.sensor_frame = "lidar";
  const Recording recording(log.path, options);
  CHECK(recording.sensor_origin().isApprox(kT_base_lidar.translation()));
  const Eigen::Vector3d origin = kT_base_lidar.translation();
  const Eigen::Vector3d expected = Eigen::Vector3d(2, 0, 0) + origin;
  CHECK(recording.T_world_sensor(2).translation().isApprox(pose_at(2, 0) * origin));
  const auto x = static_cast<float>(origin.x()), y = static_cast<float>(origin.y()),
             z = static_cast<float>(origin.z());
  CHECK(recording.read_scan(1).xyzi ==
        std::vector<float>{1 - x, 2 - y, 3 - z, 0, 4 - x, 5 - y, 6 - z, 0});

  write_text(log.folder / "poses.txt", "1 0 0 0 0 0 0 1\n1.4 4 0 0 0 0 0 1\n");
  options.poses = log.folder / "poses.txt";
  CHECK(log.pose(2, options).translation().isApprox(expected));

  options.sensor_frame = "radar";
  CHECK_THAT(log.error(options),
             ContainsSubstring("to frame radar; found transforms of base, lidar"));
}

TEST_CASE("Clouds of several topics within half a period are one scan, at one time") {
  const Log log;
  const Eigen::Isometry3d T_base_rear = pose_at(-2, 0);
  const LogChannel rear = {"/rear", "sensor_msgs/msg/PointCloud2"};
  std::vector<WrittenMessage> messages = drive_by_transforms();
  messages.push_back(transform_at(2, 1.0, "base", "rear", T_base_rear));
  for (const double time : {0.98, 1.04, 1.13, 1.38}) {  // twice, once, never, and too late
    messages.push_back(cloud_at(3, time, "rear"));
  }
  for (const double time : {0.9, 1.4}) {
    messages.push_back(transform_at(1, time, "odom", "base", pose_at(10 * time - 10, 0)));
  }
  log.write({kClouds, kTf, kStaticTf, rear}, messages);
  RecordingOptions options;
  options.cloud_topic = "/points, /rear";
  const Recording recording(log.path, options);
  REQUIRE(recording.size() == 5);
  REQUIRE(recording.sensors().size() == 2);
  CHECK(recording.sensors()[0].isApprox(Pose::Identity()));
  CHECK(recording.sensors()[1].isApprox(kT_base_lidar.inverse() * T_base_rear, 1e-9));
  CHECK(recording.point_count(0) == 6);
  CHECK(recording.read_scan(0).sensor == std::vector<std::uint8_t>{0, 0, 1, 1, 1, 1});
  CHECK(recording.read_scan(1).sensor == std::vector<std::uint8_t>{0, 0, 1, 1});
  CHECK(recording.read_scan(2).sensor == std::vector<std::uint8_t>{0, 0});
  CHECK(recording.read_scan(4).sensor == std::vector<std::uint8_t>{1, 1});
  CHECK(recording.time(4) == Approx(1.38));

  // Points of the second sensor were measured 0.03 s after the scan, by 0.3 m farther on.
  const Eigen::Vector3d measured(1, 2, 3);
  const Eigen::Vector3d expected =
      (pose_at(1, 0) * kT_base_lidar).inverse() * (pose_at(1.3, 0) * T_base_rear * measured);
  const RecordedScan scan = recording.read_scan(1);
  CHECK(Eigen::Vector3f(scan.xyzi.data()).isApprox(measured.cast<float>()));
  CHECK(Eigen::Vector3f(scan.xyzi.data() + 8).isApprox(expected.cast<float>(), 1e-5F));
  REQUIRE(scan.time.size() == 4);
  CHECK(scan.time[1] == 0.0);
  CHECK(scan.time[3] == Approx(0.03));

  options.without_poses = true;  // the odometry gets the times instead
  const Recording unplaced(log.path, options);
  const RecordedScan raw = unplaced.read_scan(1);
  const Eigen::Vector3d at_its_time = unplaced.sensors()[1] * measured;
  CHECK(Eigen::Vector3f(raw.xyzi.data() + 8).isApprox(at_its_time.cast<float>(), 1e-5F));
  CHECK(unplaced.point_offsets(1, raw).back() == Approx(0.03));

  options.cloud_topic = "/points,/points";
  CHECK_THAT(log.error(options), ContainsSubstring("each topic once, found /points twice"));
  messages.erase(messages.begin());
  log.write({kClouds, kTf, kStaticTf, rear}, messages);
  options.cloud_topic = "/points,/rear";
  CHECK_THAT(
      log.error(options),
      ContainsSubstring("expected a transform from frame lidar of the clouds to frame rear"));
}

TEST_CASE("Concatenated clouds have the sensors of ConcatenatedPointCloudInfo") {
  const Log log;
  std::vector<WrittenMessage> messages = drive_by_transforms(MessageEncoding::kCdr, "base");
  messages.push_back(transform_at(2, 1.0, "base", "left", pose_at(1, 0)));
  MessageWriter info(MessageEncoding::kCdr);
  info.header(nanoseconds(1.1), "base").number(std::uint8_t{1}).number(std::uint8_t{1});
  info.number(3U).raw("abc").number(2U);
  const auto add = [&](const std::string& frame, std::uint32_t begin) {
    info.header(nanoseconds(1.1), frame).string("/" + frame).number(std::uint8_t{0});
    info.number(begin).number(1U);
  };
  add("lidar", 1);
  add("left", 0);
  messages.push_back({3, nanoseconds(1.1), info.bytes()});
  const LogChannel infos = {"/info", "autoware_sensing_msgs/msg/ConcatenatedPointCloudInfo"};
  log.write({kClouds, kTf, kStaticTf, infos}, messages);
  const Recording recording(log.path);
  REQUIRE(recording.sensors().size() == 2);
  const RecordedScan scan = recording.read_scan(1);
  REQUIRE(scan.sensor.size() == 2);
  CHECK(recording.sensors().at(scan.sensor[0]).isApprox(pose_at(1, 0), 1e-9));
  CHECK(recording.sensors().at(scan.sensor[1]).isApprox(kT_base_lidar, 1e-9));
  CHECK(recording.read_scan(2).sensor.empty());  // no message names its sensors
}

TEST_CASE("A log of each format is a recording with clouds and with poses from transforms") {
  const TemporaryFolder folder;
  write_text(folder / "drive.mcap", mcap_file(kDrive, drive_by_transforms(), {}));
  check_drive(folder / "drive.mcap");
  for (const char* name : {"drive.bag", "drive.bag.active"}) {  // of a recorder that still runs
    write_text(folder / name, bag_file({{"/points", "sensor_msgs/PointCloud2"},
                                        {"/tf", "tf/tfMessage"},
                                        {"/tf_static", "tf2_msgs/TFMessage"}},
                                       drive_by_transforms(MessageEncoding::kRos1), {}));
    check_drive(folder / name);
  }
#if defined(DYNAINS_HAS_SQLITE3)
  write_db3(folder / "drive.db3", kDrive, drive_by_transforms());
  check_drive(folder / "drive.db3");
#endif
}

TEST_CASE("Poses of a file belong to the clouds of a log by time") {
  const Log log;
  log.write(kDrive, drive_by_transforms());
  write_text(log.folder / "poses.tum",
             "1.0 5 0 0 0 0 0 1\n1.1 6 0 0 0 0 0 1\n1.2 7 0 0 0 0 0 1\n1.3 8 0 0 0 0 0 1\n");
  RecordingOptions options;
  options.poses = log.folder / "poses.tum";
  const Recording recording(log.path, options);
  CHECK(recording.T_world_sensor(2).translation().x() == Approx(7.0));
  CHECK(recording.files() == std::vector<fs::path>{log.path, log.folder / "poses.tum"});
  options.times = log.folder / "times.txt";
  CHECK_THAT(log.error(options),
             StartsWith((log.folder / "times.txt").string() + ": expected no file of times"));
}

TEST_CASE("A topic of poses gets the transform to the sensor from the log") {
  const Log log;
  std::vector<WrittenMessage> messages = clouds_with("lidar", three_odometries("base"));
  messages.push_back(transform_at(2, 1.0, "base", "lidar", kT_base_lidar));
  log.write({kClouds, kOdometry, kStaticTf}, messages);
  CHECK(log.pose(2).isApprox(pose_at(2, 0.1) * kT_base_lidar, 1e-9));
  CHECK(has_note(Recording(log.path), "the transform from lidar to base is from the log"));

  messages.pop_back();
  log.write({kClouds, kOdometry}, messages);
  CHECK(log.pose(2).isApprox(pose_at(2, 0.1), 1e-9));
  CHECK(has_note(Recording(log.path),
                 "no transform from lidar to base: poses count as those of lidar"));

  std::vector<std::string> poses;
  for (int i = 0; i < 3; ++i) {
    poses.push_back(MessageWriter(MessageEncoding::kCdr)
                        .header(nanoseconds(1.0 + 0.1 * i), "map")
                        .pose(pose_at(i, 0.1))
                        .bytes());
  }
  log.write({kClouds, {"/pose", "geometry_msgs/msg/PoseStamped"}}, clouds_with("lidar", poses));
  CHECK(log.pose(1).isApprox(pose_at(1, 0.1), 1e-9));
}

TEST_CASE("Clouds in the fixed frame of the poses come back in the frame of the sensor") {
  const Log log;
  log.write({kClouds, kOdometry}, clouds_with("odom", three_odometries("body")));
  const Recording recording(log.path);
  CHECK(recording.frame() == PointFrame::kWorld);
  const RecordedScan scan = recording.read_scan(2);
  const Eigen::Vector3d expected = pose_at(2, 0.1).inverse() * Eigen::Vector3d(1, 2, 3);
  CHECK(Eigen::Vector3f(scan.xyzi.data()).isApprox(expected.cast<float>(), 1e-5F));
}

TEST_CASE("Topics are found if there is only one, and listed otherwise") {
  const Log log;
  std::vector<WrittenMessage> messages = clouds_with("lidar", three_odometries("base"));
  for (const WrittenMessage& message : clouds_with("rear", three_odometries("wheels"))) {
    messages.push_back(
        {static_cast<std::uint16_t>(message.channel + 2), message.time, message.data});
  }
  log.write({kClouds,
             kOdometry,
             {"/rear", "sensor_msgs/msg/PointCloud2"},
             {"/wheels", "nav_msgs/msg/Odometry"}},
            messages);
  RecordingOptions options;
  CHECK(log.error() == log.path.string() +
                           ": expected one topic with clouds, or --cloud-topic; found /points "
                           "(sensor_msgs/PointCloud2, 3 messages), /rear "
                           "(sensor_msgs/PointCloud2, 3 messages)");
  options.cloud_topic = "/none";
  CHECK_THAT(log.error(options), ContainsSubstring("expected clouds on topic /none; found /p"));
  options.cloud_topic = "/points";
  CHECK_THAT(log.error(options),
             ContainsSubstring("expected one topic with poses, or --pose-topic; found /odom"));
  options.pose_topic = "/points";
  CHECK_THAT(log.error(options), ContainsSubstring("expected poses on topic /points; found"));
  options.pose_topic = "/odom";
  CHECK(Recording(log.path, options).size() == 3);

  log.write({kClouds}, clouds_with("lidar", {}));
  CHECK_THAT(log.error(), ContainsSubstring("expected a topic with poses, or a file of poses"));
  log.write({kOdometry}, {{0, 1, three_odometries("base")[0]}});
  CHECK_THAT(log.error(), ContainsSubstring("expected a topic with clouds; found /odom"));
  const LogChannel packets = {"/packets", "velodyne_msgs/msg/VelodyneScan"};
  log.write({packets}, {{0, 1, "no matter"}});
  CHECK_THAT(log.error(),
             ContainsSubstring("found /packets") &&
                 ContainsSubstring("packets of a sensor are not read: play the log through the ROS "
                                   "driver of the sensor"));
}

TEST_CASE("Robots of one log whose frames have equal names keep their own transforms") {
  const Log log;
  const Pose T_of_other = pose_at(0, 0.3);
  const auto write = [&](const std::string& points) {
    std::vector<WrittenMessage> messages = drive_by_transforms();
    messages.push_back(transform_at(4, 1.0, "base", "lidar", T_of_other));
    for (int i = 0; i < 4; ++i) {
      const double time = 1.01 + 0.1 * i;
      messages.push_back(transform_at(3, time, "odom", "base", pose_at(-i, 1)));
    }
    log.write({{points, kClouds.type},
               {"/one/tf", kTf.type},
               {"/one/tf_static", kTf.type},
               {"/two/tf", kTf.type},
               {"/two/tf_static", kTf.type}},
              messages);
  };
  write("/one/points");
  check_drive(log.path);
  write("/two/points");
  CHECK(log.pose(1).linear().isApprox((pose_at(-1, 1) * T_of_other).linear(), 0.1));
  write("/points");
  CHECK_THAT(log.error(), ContainsSubstring("found different ones of frame ") &&
                              ContainsSubstring(" by namespaces /one and /two"));
  RecordingOptions options;
  options.pose_topic = "/one/tf";
  CHECK(log.pose(2, options).isApprox(pose_at(2, 0) * kT_base_lidar, 1e-9));
}

TEST_CASE("Flag --pose-frame-id takes the poses from transforms, in that frame") {
  const Log log;
  std::vector<WrittenMessage> messages = drive_by_transforms();
  messages.push_back(transform_at(2, 1.0, "map", "odom", pose_at(100, 1)));
  messages.push_back(odometry_at(3, 1.0, "base", pose_at(50, 0)));
  log.write({kClouds, kTf, kStaticTf, kOdometry}, messages);
  RecordingOptions options;
  options.pose_topic = "/tf";
  CHECK(log.pose(0, options).isApprox(pose_at(100, 1) * pose_at(0, 0) * kT_base_lidar, 1e-9));
  options.pose_topic.clear();
  options.pose_frame = "odom";
  CHECK(log.pose(0, options).isApprox(pose_at(0, 0) * kT_base_lidar, 1e-9));
  options.pose_frame = "utm";
  CHECK_THAT(log.error(options),
             ContainsSubstring("expected poses of frame lidar in utm at the times of the clouds"));
}

TEST_CASE("A time offset is applied before poses of the log are taken") {
  const Log log;
  for (const double ahead : {0.15, 40.0}) {
    for (const bool by_transforms : {false, true}) {
      CAPTURE(ahead, by_transforms);
      std::vector<WrittenMessage> messages = clouds_with("lidar", {});
      for (int i = 0; i < 6; ++i) {
        const double time = 1.0 + 0.1 * i + ahead;
        messages.push_back(by_transforms ? transform_at(1, time, "odom", "lidar", pose_at(i, 0))
                                         : odometry_at(1, time, "lidar", pose_at(i, 0)));
      }
      log.write({kClouds, by_transforms ? kTf : kOdometry}, messages);
      RecordingOptions options;
      options.time_offset = ahead;
      const Recording recording(log.path, options);
      REQUIRE(recording.size() == 3);
      for (std::size_t i = 0; i < 3; ++i) {
        CHECK(recording.T_world_sensor(i).translation().x() == Approx(i).margin(1e-6));
      }
      options.time_offset = ahead + 7;
      CHECK_THAT(log.error(options),
                 ContainsSubstring("found none for 3 clouds, which are from 1 s to 1.2 s (by "
                                   "--time-offset ") &&
                     ContainsSubstring("poses are from "));
    }
  }
}

TEST_CASE("An extrinsic calibration of the user stands for a transform that the log lacks") {
  const Log log;
  std::vector<WrittenMessage> messages = drive_by_transforms();
  messages.erase(messages.begin());
  const auto write = [&] { log.write(kDrive, messages); };
  write();
  RecordingOptions options;
  CHECK_THAT(log.error(options), ContainsSubstring("--extrinsic gives the pose of lidar in base"));
  options.convention.T_body_sensor = kT_base_lidar;
  const auto check = [&] {
    const Recording recording(log.path, options);
    CHECK(recording.T_world_sensor(2).isApprox(pose_at(2, 0) * kT_base_lidar, 1e-9));
    CHECK(has_note(recording, "poses of base, in which --extrinsic places the sensor"));
  };
  check();
  // Wheels of the body move, too, and a static transform of the lidar leads nowhere.
  for (int i = 0; i < 4; ++i) {
    for (const char* wheel : {"left", "right"}) {
      messages.push_back(transform_at(1, 1.0 + 0.1 * i, "base", wheel, pose_at(0, i)));
    }
  }
  write();
  check();
  messages.push_back(transform_at(2, 1.0, "mast", "lidar", kT_base_lidar));
  write();
  check();
  CHECK_THAT(log.error(), ContainsSubstring("--extrinsic gives the pose of lidar in base"));
  // Two bodies that nothing connects.
  messages.push_back(transform_at(1, 1.0, "world", "trailer", pose_at(0, 0)));
  write();
  CHECK_THAT(log.error(options),
             ContainsSubstring("expected one moving body for --extrinsic, found moving transforms "
                               "of base, left, right, trailer"));
}

TEST_CASE("Parts of a log that are missing are named, and accepted on demand") {
  const TemporaryFolder folder;
  const std::vector<WrittenMessage> all = drive_by_transforms();
  const auto write = [&](const std::string& name, std::ptrdiff_t first, std::ptrdiff_t last) {
    write_text(folder / name, mcap_file(kDrive, {all.begin() + first, all.begin() + last}, {}));
  };
  write("drive_0.mcap", 0, 5);
  write("drive_1.mcap", 5, 9);
  CHECK(Recording(folder.path()).size() == 4);
  write_text(folder / "metadata.yaml",
             "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - "
             "drive/drive_0.mcap\n    - \"drive_1.mcap.zstd\"\n  duration:\n    nanoseconds: 3\n");
  CHECK(Recording(folder.path()).size() == 4);
  CHECK(Recording(folder.path()).warnings().empty());

  fs::remove(folder / "drive_1.mcap");
  CHECK(
      log_error(folder.path()) ==
      folder.path().string() +
          ": 1 of 2 parts of the log are missing: drive_1.mcap; --accept-missing reads the others");
  RecordingOptions options;
  options.accept_missing = true;
  const Recording half(folder.path(), options);
  CHECK(half.size() == 2);
  CHECK(half.warnings() ==
        std::vector<std::string>{"1 of 2 parts of the log are missing: drive_1.mcap"});

  fs::remove(folder / "metadata.yaml");
  CHECK(Recording(folder.path()).size() == 2);
  write("drive_2.mcap", 5, 9);
  CHECK_THAT(log_error(folder.path()),
             ContainsSubstring("1 of 3 parts of the log are missing: drive_1"));
  write("other.mcap", 5, 9);
  CHECK_THAT(log_error(folder.path()), ContainsSubstring("has 3 logs (drive_0.mcap, drive_2.mcap, "
                                                         "other.mcap) and no metadata.yaml"));
}

TEST_CASE("Messages that rosbag2 compressed are read, and compressed files are named") {
  const TemporaryFolder folder;
  std::vector<WrittenMessage> messages = drive_by_transforms();
  for (WrittenMessage& message : messages) message.data = compressed("zstd", message.data);
  write_text(folder / "drive.mcap", mcap_file(kDrive, messages, {}));
#if defined(DYNAINS_HAS_SQLITE3)
  write_db3(folder / "drive.db3", kDrive, messages);
#endif
  std::vector<std::uint8_t> bytes, spare;
  const std::string frame = compressed("zstd", "a");
  bytes.assign(frame.begin(), frame.end());
  if (decompress_frame(bytes, spare).empty()) {
    check_drive(folder / "drive.mcap");
#if defined(DYNAINS_HAS_SQLITE3)
    check_drive(folder / "drive.db3");
#endif
    messages[2].data.resize(messages[2].data.size() - 1);
    write_text(folder / "cut.mcap", mcap_file(kDrive, messages, {}));
    CHECK_THAT(log_error(folder / "cut.mcap"), ContainsSubstring("/points at 1030000000 ns: "));
  } else {
    CHECK_THAT(log_error(folder / "drive.mcap"), ContainsSubstring("this build has no zstd"));
  }

  const fs::path part = folder / "bag/drive_0.mcap.zstd";
  write_text(part, "no matter");
  write_text(folder / "bag/metadata.yaml", "  relative_file_paths:\n    - drive_0.mcap.zstd\n");
  const std::string expected =
      part.string() + ": is compressed as a whole; decompress it: zstd -d --rm " + part.string();
  CHECK(log_error(folder / "bag") == expected);
  CHECK(log_error(part) == expected);
}

TEST_CASE("Contradictory poses and clouds are refused with their place") {
  const Log log;
  Eigen::Isometry3d not_finite = pose_at(0, 0);
  not_finite.translation().x() = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    LogChannel poses;
    std::vector<std::string> messages;
    std::string expected;
  };
  const std::vector<Case> cases = {
      {kOdometry, {odometry(1, "base", not_finite)}, "/odom at 1000000000 ns: expected a finite"},
      {kOdometry, {"\1"}, "/odom at 1000000000 ns: byte 0: expected 4 bytes of the header of CDR"},
      {kTf,
       {transform(1, "odom", "base", pose_at(0, 0))},
       "expected a transform of frame lidar, that of the clouds; found transforms of base"},
      {kTf,
       {transform(1, "lidar", "lidar", pose_at(0, 0))},
       "found a loop or more above frame lidar"},
      {kTf,
       {transform(1, "base", "lidar", pose_at(0, 0)), transform(1, "lidar", "base", pose_at(0, 0))},
       "found a loop or more above frame lidar"},
      {kOdometry,
       {odometry(50, "", pose_at(0, 0))},
       "expected poses of frame lidar in odom at the times of the clouds, found none for 3 clouds, "
       "which are from 1 s to 1.2 s; poses are from 50 s to 50 s. If the clocks differ, "
       "--time-offset"},
  };
  for (const Case& one : cases) {
    log.write({kClouds, one.poses}, clouds_with("lidar", one.messages));
    CHECK_THAT(log.error(),
               StartsWith(log.path.string() + ": ") && ContainsSubstring(one.expected));
  }
  std::vector<WrittenMessage> messages = drive_by_transforms();
  messages.back().data = small_cloud(1.3, "rear");
  log.write(kDrive, messages);
  CHECK_THAT(log.error(), ContainsSubstring("expected clouds of one frame, or --frame-id for "
                                            "those of one sensor; found frames lidar (3), rear "
                                            "(1)"));
  RecordingOptions options;
  options.cloud_frame = "rear";
  options.without_poses = true;
  CHECK(Recording(log.path, options).size() == 1);
  options.cloud_frame = "lidar";
  CHECK(Recording(log.path, options).size() == 3);
  options.cloud_frame = "front";
  CHECK_THAT(log.error(options), ContainsSubstring("found frames lidar (3), rear (1)"));
}

TEST_CASE("Clouds that a log has lost are told, and uneven stamps are not") {
  const Log log;
  const auto warnings_of = [&](const std::vector<double>& stamps) {
    std::vector<WrittenMessage> messages;
    for (const double time : stamps) {
      messages.push_back(cloud_at(0, time, "lidar"));
      messages.push_back(odometry_at(1, time, "lidar", pose_at(time, 0)));
    }
    log.write({kClouds, kOdometry}, messages);
    return Recording(log.path).warnings();
  };
  std::vector<double> stamps;
  for (int i = 0; i < 20; ++i) stamps.push_back(1.0 + 0.1 * (i < 12 ? i : i + 3));
  CHECK(warnings_of(stamps) ==
        std::vector<std::string>{"3 scans seem to be missing: the longest interval is 4 times "
                                 "the usual one"});
  stamps.resize(12);
  CHECK(warnings_of(stamps).empty());
  CHECK(warnings_of({1.0, 1.1, 1.25, 1.7, 1.75, 1.9, 2.4, 2.5, 2.7}).empty());
}

TEST_CASE("Clouds whose stamps do not increase are left out and counted") {
  const Log log;
  std::vector<WrittenMessage> messages = drive_by_transforms();
  messages.push_back({0, nanoseconds(1.32), small_cloud(1.1, "lidar")});
  log.write(kDrive, messages);
  const Recording recording(log.path);
  CHECK(recording.size() == 4);
  REQUIRE(recording.warnings().size() == 1);
  CHECK_THAT(recording.warnings().front(),
             ContainsSubstring("1 of 5 clouds have a stamp that is not after"));

  for (WrittenMessage& message : messages) {
    if (message.channel == 0) message.data = small_cloud(1.0, "lidar");
  }
  log.write(kDrive, messages);
  CHECK_THAT(log.error(), ContainsSubstring("expected stamps that increase: 4 of 5 clouds"));
}

TEST_CASE("A field label gives the labels, and a truncated log gives the scans before its end") {
  const TemporaryFolder folder;
  std::vector<WrittenMessage> messages = drive_by_transforms();
  std::vector<CloudField> fields = kXyz;
  fields.push_back({"label", 12, 6});
  const std::string points = bytes_of<float>({1, 2, 3}) + ByteWriter().number(0x1000FBU).bytes();
  for (WrittenMessage& message : messages) {
    if (message.channel != 0) continue;
    message.data = cloud_message(MessageEncoding::kCdr, 1e-9 * static_cast<double>(message.time),
                                 "lidar", fields, 16, points);
  }
  const std::string whole = mcap_file(kDrive, messages, {});
  write_text(folder / "drive.mcap", whole);
  const Recording recording(folder / "drive.mcap");
  CHECK(recording.has_labels());
  CHECK(recording.read_labels(1) == std::vector<std::uint32_t>{0x1000FBU});

  write_text(folder / "cut.mcap", whole.substr(0, whole.size() / 2));
  const Recording cut(folder / "cut.mcap");
  CHECK(cut.size() < 4);
  REQUIRE(cut.early_end());
  CHECK_THAT(*cut.early_end(), StartsWith((folder / "cut.mcap").string() + ": byte "));
  REQUIRE(cut.warnings().size() == 1);
  CHECK_THAT(cut.warnings()[0], ContainsSubstring("the log ends early") &&
                                    ContainsSubstring("scans before it are read"));

  write_text(folder / "first_bytes.mcap", whole.substr(0, 40));
  CHECK_THAT(log_error(folder / "first_bytes.mcap"),
             ContainsSubstring("found no topic") && ContainsSubstring("the log ends early"));
}

}  // namespace dynains
