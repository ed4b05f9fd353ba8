// Logs of ROS: any bytes give scans with poses and a copy, or an IoError that names the log.

#include "dynains/io/recording.hpp"
#include "io/db3_writer.hpp"
#include "io/log_writer.hpp"
#include "io/logs/log_copy.hpp"
#include "support/standard.hpp"
#include "targets.hpp"

namespace dynains::fuzz {
namespace {

using test::LogChannel;
using test::WrittenMessage;

// The first byte of an input chooses the format.
const char* const kLogNames[] = {"log.mcap", "log.bag", "log.db3"};

/// Two clouds with all fields, and their poses as transforms or odometry.
std::vector<WrittenMessage> drive(MessageEncoding encoding, bool by_transforms) {
  const std::vector<test::CloudField> fields =
      test::xyz_and({{"label", 12, 6}, {"ring", 16, 4}, {"t", 18, 6}});
  std::string points;
  for (const float x : {1.0F, 2.0F}) {
    points += test::packed(x, 2.0F, 3.0F, 9U, std::uint16_t{1}, 50U);
  }
  std::vector<WrittenMessage> messages;
  for (const double time : {1.0, 1.5}) {
    const std::uint64_t at = test::nanoseconds(time);
    const Eigen::Isometry3d pose = test::pose_at(time, 0.5);
    messages.push_back({0, at, test::cloud_message(encoding, time, "lidar", fields, 22, points)});
    messages.push_back({1, at,
                        by_transforms ? test::transform(time, "odom", "lidar", pose, encoding)
                                      : test::odometry(time, "lidar", pose, encoding)});
  }
  return messages;
}

std::vector<LogChannel> channels(bool by_transforms) {
  return {{"/points", "sensor_msgs/PointCloud2"},
          by_transforms ? LogChannel{"/tf", "tf2_msgs/TFMessage"}
                        : LogChannel{"/odom", "nav_msgs/Odometry"}};
}

void run_log(Bytes bytes) {
  if (bytes.empty()) return;
  static const test::TemporaryFolder folder;
  const fs::path log = folder / kLogNames[bytes[0] % 3];
  test::write_text(log, {reinterpret_cast<const char*>(bytes.data()) + 1, bytes.size() - 1});
  const fs::path copy = folder / "copy.mcap";
  expect_value_or<IoError>(log, [&](const fs::path& path) {
    check_recording(path, Recording(path), bytes.size());
    const auto file = open_log(path);
    copy_log(*file, copy, [](const LogMessage&, const SerialisedMessage&) { return std::nullopt; });
    require(open_log(copy)->messages().size() == file->messages().size(),
            "a copy has all messages");
  });
}

}  // namespace

Target log_target() {
  std::vector<std::string> seeds;
  for (const std::string compression : {"", "lz4", "zstd"}) {
    test::McapParts parts;
    parts.compression = compression;
    parts.message_index = compression != "lz4";
    seeds.push_back(std::string(1, '\0') +
                    test::mcap_file(channels(true), drive(MessageEncoding::kCdr, true), parts));
  }
  seeds.push_back('\1' + test::bag_file(channels(false), drive(MessageEncoding::kRos1, false),
                                        {true, true, "none"}));
  seeds.push_back('\1' + test::bag_file(channels(true), drive(MessageEncoding::kRos1, true),
                                        {false, false, "lz4"}));
#if defined(DYNAINS_HAS_SQLITE3)
  const test::TemporaryFolder folder;
  test::write_db3(folder / "log.db3", channels(true), drive(MessageEncoding::kCdr, true));
  seeds.push_back('\2' + test::read_text(folder / "log.db3"));
#endif
  return {"log", run_log, seeds};
}

}  // namespace dynains::fuzz
