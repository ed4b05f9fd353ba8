#include "io/logs/ros_messages.hpp"

#include "io/logs/transform_tree.hpp"
#include "ros_writer.hpp"
#include "support/catch.hpp"

namespace dynains {

using namespace test;

namespace {

constexpr MessageEncoding kBoth[] = {MessageEncoding::kRos1, MessageEncoding::kCdr};

RecordedScan decode(const std::string& bytes, MessageEncoding encoding) {
  RecordedScan scan;
  read_cloud("sensor_msgs/PointCloud2", serialised(bytes, encoding), scan);
  return scan;
}

}  // namespace

TEST_CASE("Clouds of any layout are read, from ROS 1 and ROS 2") {
  for (const MessageEncoding encoding : kBoth) {
    std::string data;
    for (int i = 0; i < 3; ++i) {
      data += packed(1.5 + i, 2.5, -3.5,                        // double x y z
                     static_cast<std::uint16_t>(40 + i),        // ring
                     static_cast<std::uint8_t>(200),            // intensity
                     static_cast<std::uint32_t>(1000000 * i));  // offset in ns
      data += '?';                                              // padding
    }
    const std::vector<CloudField> fields = {
        {"z", 16, 8}, {"y", 8, 8},       {"x", 0, 8}, {"ring", 24, 4}, {"reflectivity", 26, 2},
        {"t", 27, 6}, {"unknown", 31, 2}};
    const std::string message = cloud_message(encoding, 12.25, "/lidar", fields, 32, data);
    const CloudInfo info = inspect_cloud("sensor_msgs/PointCloud2", serialised(message, encoding));
    CHECK(info.time == 12.25);
    CHECK(info.frame == "lidar");
    CHECK(info.points == 3);
    CHECK((info.columns.ring && info.columns.time && info.columns.intensity));
    CHECK_FALSE(info.columns.label);
    const RecordedScan scan = decode(message, encoding);
    REQUIRE(scan.size() == 3);
    CHECK(scan.xyzi[8] == 3.5F);
    CHECK(scan.xyzi[9] == 2.5F);
    CHECK(scan.xyzi[10] == -3.5F);
    CHECK(scan.xyzi[11] == 200.0F);
    CHECK(scan.ring == std::vector<std::uint16_t>{40, 41, 42});
    CHECK(scan.time[2] == 2000000.0);
  }
}

TEST_CASE("Clouds may be big-endian, and their row step may be that of another cloud") {
  const auto message = [](std::uint8_t is_big_endian, std::uint32_t row_step, std::uint32_t rows,
                          const std::string& data) {
    return cloud_message(MessageEncoding::kRos1, 1.0, "l", kXyz,
                         {rows, 2, 12, row_step, is_big_endian}, data);
  };
  const std::vector<float> values = {1, 2, 3, 4, 5, 6};
  std::string swapped;
  for (const float value : values) {
    const std::string bytes = bytes_of<float>({value});
    swapped.append(bytes.rbegin(), bytes.rend());
  }
  const std::vector<float> expected = {1, 2, 3, 0, 4, 5, 6, 0};
  CHECK(decode(message(0, 24, 1, bytes_of(values)), MessageEncoding::kRos1).xyzi == expected);
  CHECK(decode(message(1, 24, 1, swapped), MessageEncoding::kRos1).xyzi == expected);
  const std::string two_rows = bytes_of(values) + bytes_of<float>({7, 8, 9, 1, 1, 1});
  for (const std::uint32_t row_step : {0U, 24U, 4000U}) {
    CAPTURE(row_step);
    CHECK(decode(message(0, row_step, 2, two_rows), MessageEncoding::kRos1).xyzi[8] == 7.0F);
  }
  CHECK_THAT(message_of<IoError>(
                 [&] { decode(message(0, 4000, 2, two_rows + "1234"), MessageEncoding::kRos1); }),
             ContainsSubstring("expected 2 rows of 4000 bytes, found 52 bytes"));
}

TEST_CASE("Coordinates beyond the range of float become infinite") {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::vector<CloudField> fields = {{"x", 0, 8}, {"y", 8, 8}, {"z", 16, 8}};
  const std::string message =
      cloud_message(MessageEncoding::kCdr, 1.0, "l", fields, 24, packed(1e300, -1e300, kInfinity));
  const auto infinite = static_cast<float>(kInfinity);
  CHECK(decode(message, MessageEncoding::kCdr).xyzi ==
        std::vector<float>{infinite, -infinite, infinite, 0.0F});
}

TEST_CASE("Livox messages are read as clouds") {
  for (const MessageEncoding encoding : kBoth) {
    MessageWriter out(encoding);
    out.header(nanoseconds(5.0), "livox").number(std::uint64_t{5000000000}).number(2U);
    out.number(std::uint8_t{1}).raw(std::string(3, '\0')).number(2U);
    for (int i = 0; i < 2; ++i) {
      out.number(static_cast<std::uint32_t>(50000000 * i));
      for (const float value : {1.0F, 2.0F, 3.0F + static_cast<float>(i)}) out.number(value);
      out.number(std::uint8_t{99}).number(std::uint8_t{0}).number(static_cast<std::uint8_t>(i));
    }
    RecordedScan scan;
    read_cloud("livox_ros_driver/CustomMsg", serialised(out.bytes(), encoding), scan);
    REQUIRE(scan.size() == 2);
    CHECK(scan.xyzi[6] == 4.0F);
    CHECK(scan.xyzi[7] == 99.0F);
    CHECK(scan.ring[1] == 1);
    CHECK((scan.sensor == std::vector<std::uint8_t>{1, 1}));
    CHECK(scan.time[1] == 50000000.0);
  }
}

TEST_CASE("Malformed clouds are refused with their place") {
  const MessageEncoding cdr = MessageEncoding::kCdr;
  const auto error_of = [&](const std::string& bytes) {
    return message_of<IoError>([&] { decode(bytes, cdr); });
  };
  const std::string good = cloud_message(cdr, 1, "l", kXyz, 12, bytes_of<float>({1, 2, 3}));
  CHECK(error_of(good) == "(nothing was thrown)");
  for (std::size_t size = 0; size < good.size() - 4; ++size) {
    CHECK(error_of(good.substr(0, size)).rfind("log: /t: ", 0) == 0);
  }
  CHECK_THAT(error_of("\1" + good.substr(1)), ContainsSubstring("plain CDR"));
  const std::string data = bytes_of<float>({1, 2, 3});
  using Fields = std::vector<CloudField>;
  for (const auto& [fields, expected] :
       {std::pair(Fields{{"x", 0, 7}, {"y", 4, 7}}, "fields x, y and z"),
        {Fields{{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 5}}, "float32 or float64"},
        {Fields{{"x", 0, 7}, {"y", 4, 7}, {"z", 9, 7}}, "within the 12 bytes"},
        {Fields{{"x", 0, 7}, {"y", 4, 7}, {"z", 4294967295U, 7}}, "within the 12"},
        {Fields{{"x", 0, 9}, {"y", 4, 7}, {"z", 8, 7}}, "datatype from 1 to 8"}}) {
    CHECK_THAT(error_of(cloud_message(cdr, 1, "l", fields, 12, data)), ContainsSubstring(expected));
  }
}

TEST_CASE("Poses are read from every type") {
  const Eigen::Isometry3d T = pose_at(3.0, 0.5);
  for (const MessageEncoding encoding : kBoth) {
    const std::string message = MessageWriter(encoding)
                                    .header(nanoseconds(2.5), "/odom")
                                    .string("base")
                                    .pose(T)
                                    .raw("rest")
                                    .bytes();
    const auto poses = read_poses("nav_msgs/Odometry", serialised(message, encoding));
    REQUIRE(poses.size() == 1);
    CHECK(poses[0].time == 2.5);
    CHECK(poses[0].frame == "odom");
    CHECK(poses[0].child == "base");
    CHECK(poses[0].T_frame_child.isApprox(T, 1e-12));

    const std::string stamped =
        MessageWriter(encoding).header(nanoseconds(2.5), "map").pose(T).bytes();
    CHECK(read_poses("geometry_msgs/PoseStamped", serialised(stamped, encoding))[0].child.empty());

    MessageWriter tf(encoding);
    tf.number(std::uint32_t{2});
    for (const char* const child : {"a", "b"})
      tf.header(nanoseconds(1.0), "map").string(child).pose(T);
    CHECK(read_poses("tf2_msgs/TFMessage", serialised(tf.bytes(), encoding))[1].child == "b");
  }
  Eigen::Isometry3d bad = T;
  bad.translation().x() = std::numeric_limits<double>::quiet_NaN();
  const std::string message = odometry(1, "base", bad);
  CHECK_THAT(message_of<IoError>([&] {
               read_poses("nav_msgs/Odometry", serialised(message, MessageEncoding::kCdr));
             }),
             ContainsSubstring("a finite position and a quaternion of length 1"));
}

TEST_CASE("Transforms are chained and interpolated, by the nearest frame above both") {
  TransformTree tree;
  for (const double time : {0.0, 0.2, 0.1}) {
    tree.add({time, "odom", "base", pose_at(10 * time, 0)}, false);
  }
  tree.add({0.1, "odom", "base", pose_at(99, 0)}, false);  // a second transform of one time
  tree.add({0.0, "base", "lidar", pose_at(0.5, M_PI / 2)}, true);
  tree.add({0.0, "base", "imu", pose_at(-0.5, 1.0)}, true);
  tree.sort();
  CHECK(tree.root_of("lidar") == std::string("odom"));
  const Eigen::Isometry3d T_odom_lidar = pose_at(1.5, 0) * pose_at(0.5, M_PI / 2);
  CHECK(tree.find("odom", "lidar", 0.15)->isApprox(T_odom_lidar, 1e-12));
  CHECK(tree.find("lidar", "odom", 0.15)->isApprox(T_odom_lidar.inverse(), 1e-12));
  CHECK(tree.find("imu", "lidar", 99.0)
            ->isApprox(pose_at(-0.5, 1.0).inverse() * pose_at(0.5, M_PI / 2), 1e-12));
  CHECK_FALSE(tree.find("odom", "lidar", 5.0));
  CHECK_FALSE(tree.find("map", "lidar", 0.1));

  CHECK(tree.left_out() == 0);
  tree.add({0.0, "other", "lidar", pose_at(7, 0)}, true);  // a second parent
  CHECK(tree.left_out() == 1);
  CHECK(tree.root_of("lidar") == std::string("odom"));
  tree.add({0.0, "lidar", "odom", pose_at(0, 0)}, true);  // a loop
  CHECK_FALSE(tree.root_of("lidar"));
  CHECK_FALSE(tree.find("map", "lidar", 0.1));
}

TEST_CASE("The newest transform of an edge that hardly changes holds, others end at a gap") {
  TransformTree tree;
  tree.add({-0.5, "base", "lidar", pose_at(0.5, 0)}, false);
  for (const int step : {0, 1, 2}) {
    tree.add({3.0 * step, "map", "odom", pose_at(0.02 * step, 0)}, false);
    tree.add({3.0 * step, "odom", "base", pose_at(9.0 * step, 0)}, false);
  }
  tree.sort();
  CHECK(tree.find("base", "lidar", 7.0)->isApprox(pose_at(0.5, 0), 1e-12));
  CHECK(tree.find("map", "odom", 4.5)->isApprox(pose_at(0.02, 0), 1e-12));
  CHECK(tree.find("map", "odom", 20.0)->isApprox(pose_at(0.04, 0), 1e-12));
  CHECK_FALSE(tree.find("odom", "base", 4.5));

  TransformTree patient(3.5);
  for (const int step : {0, 1})
    patient.add({3.0 * step, "odom", "base", pose_at(9.0 * step, 0)}, false);
  patient.sort();
  CHECK(patient.find("odom", "base", 1.5)->isApprox(pose_at(4.5, 0), 1e-12));
}

TEST_CASE("Poses in any order take the time of sorting, and chains of frames have a limit") {
  TransformTree tree;
  constexpr int kPoses = 300000;
  for (int i = kPoses; i > 0; --i) {
    tree.add({i * 1e-3, "odom", "base", pose_at(i * 1e-3, 0)}, false);
  }
  tree.sort();
  CHECK(tree.times().size() == kPoses);
  CHECK(tree.find("odom", "base", 100.0005)->translation().x() == Approx(100.0005));

  constexpr std::size_t kLevels = TransformTree::kDeepest;
  for (const std::size_t levels : {kLevels, kLevels + 1}) {
    TransformTree chain;
    for (std::size_t i = 0; i < levels; ++i) {
      chain.add({0.0, std::to_string(i), std::to_string(i + 1), pose_at(1, 0)}, true);
    }
    const std::string last = std::to_string(levels);
    const std::string middle = std::to_string(levels / 2);
    CHECK(chain.root_of(last).has_value() == (levels == kLevels));
    CHECK(chain.find("0", last, 0.0).has_value() == (levels == kLevels));
    CHECK(chain.find(middle, last, 0.0).has_value() == (levels == kLevels));
  }
}

}  // namespace dynains
