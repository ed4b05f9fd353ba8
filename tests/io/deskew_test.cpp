// Removal of the distortion by the motion of the sensor during a scan.

#include "dynains/io/kitti.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "log_writer.hpp"
#include "support/catch.hpp"

namespace dynains {

using namespace test;

namespace {

constexpr double kSpeed = 20.0;    // m/s along x
constexpr double kTurnRate = 0.5;  // rad/s
const Eigen::Vector3d kPlace(30.0, 8.0, 3.0);

Eigen::Isometry3d motion(double time) { return pose_at(kSpeed * time, kTurnRate * time); }

/// kPlace in the sensor frame at `time`.
Eigen::Vector3f seen_at(double time) { return (motion(time).inverse() * kPlace).cast<float>(); }

Eigen::Vector3f point_of(const RecordedScan& scan, std::size_t i) {
  return Eigen::Map<const Eigen::Vector3f>(scan.xyzi.data() + 4 * i);
}

const std::vector<double> kOffsets = {-0.02, 0.0, 0.013, 0.1};  // s

/// A scan of points at these places (m) with their times.
void write_ply(const fs::path& path,
               const std::vector<std::pair<Eigen::Vector3d, double>>& points) {
  fs::create_directories(path.parent_path());
  PointColumns columns;
  columns.time = true;
  PointFileWriter writer(path, columns);
  for (const auto& [position, time] : points) {
    FilePoint point;
    point.position = position;
    point.time = time;
    writer.add(point);
  }
  writer.commit();
}

/// Three scans that see kPlace four times each. `stored` gives the value of the column time.
void write_drive(const fs::path& folder, const std::function<double(double, double)>& stored,
                 double first_time = 0.0) {
  std::vector<double> times;
  for (int i = 0; i < 3; ++i) {
    const double time = 0.1 * i;
    std::vector<std::pair<Eigen::Vector3d, double>> points;
    for (const double offset : kOffsets) {
      points.emplace_back(seen_at(time + offset).cast<double>(), stored(first_time + time, offset));
    }
    write_ply(folder / ("scan" + std::to_string(i) + ".ply"), points);
    times.push_back(first_time + time);
  }
  write_times(folder / "times.txt", times);
  const auto pose_of = [](std::size_t i) { return motion(0.1 * static_cast<double>(i)); };
  write_text(folder / "poses.tum", timed_rows(times, pose_of));
}

/// Two scans of points
void write_two_scans(const TemporaryFolder& folder,
                     const std::vector<std::pair<Eigen::Vector3d, double>>& points) {
  for (const char* const name : {"0.ply", "1.ply"}) write_ply(folder / name, points);
}

RecordingOptions with_deskewing() {
  RecordingOptions options;
  options.deskew = true;
  options.frame = PointFrame::kSensor;
  return options;
}

void check_deskewed(const fs::path& path) {
  CAPTURE(path);
  const Recording recording(path, with_deskewing());
  const Recording raw(path);
  CHECK(recording.is_deskewed());
  REQUIRE(recording.size() == 3);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const RecordedScan scan = recording.read_scan(i);
    REQUIRE(scan.size() == kOffsets.size());
    CHECK(scan.time == raw.read_scan(i).time);
    for (std::size_t k = 0; k < scan.size(); ++k) {
      CHECK((point_of(scan, k) - seen_at(0.1 * static_cast<double>(i))).norm() < 0.005F);
    }
    CHECK((point_of(raw.read_scan(i), 3) - point_of(scan, 3)).norm() > 1.0F);
  }
}

std::string error_of(const fs::path& path, const RecordingOptions& options = with_deskewing()) {
  return message_of<IoError>([&] { Recording(path, options).read_scan(1); });
}

}  // namespace

TEST_CASE("De-skewing moves points to the time of the scan, for offsets and times since 1970") {
  const TemporaryFolder folder;
  write_drive(folder / "ns", [](double, double offset) { return 1e9 * offset; });
  check_deskewed(folder / "ns");
  write_drive(
      folder / "absolute", [](double stamp, double offset) { return stamp + offset; }, 1.5e9);
  check_deskewed(folder / "absolute");
}

TEST_CASE("Poses of a log between its clouds take part in de-skewing") {
  const std::vector<CloudField> fields = xyz_and({{"t", 12, 5}});
  for (const bool by_transforms : {false, true}) {
    std::vector<WrittenMessage> messages;
    // The sensor stands still, and starts to move between the first cloud and the second one.
    const auto place = [](double time) {
      return pose_at(time < 1.05 ? 0.0 : 20 * (time - 1.05), 0);
    };
    for (int i = 0; i <= 6; ++i) {
      const double time = 1.0 + 0.05 * i;
      messages.push_back(by_transforms ? transform_at(1, time, "odom", "lidar", place(time))
                                       : odometry_at(1, time, "lidar", place(time)));
    }
    for (const double time : {1.0, 1.1, 1.2}) {
      std::string points;
      for (const double offset : {0.0, 0.04, 0.09}) {
        const double x = 50.0 - place(time + offset).translation().x();
        points +=
            packed(static_cast<float>(x), 1.0F, 2.0F, static_cast<std::int32_t>(1e9 * offset));
      }
      messages.push_back({0, nanoseconds(time),
                          cloud_message(MessageEncoding::kCdr, time, "lidar", fields, 16, points)});
    }
    const TemporaryFolder folder;
    write_text(folder / "drive.mcap",
               mcap_file({kClouds, by_transforms ? kTf : kOdometry}, messages, {}));
    const Recording recording(folder / "drive.mcap", with_deskewing());
    REQUIRE(recording.size() == 3);
    for (std::size_t i = 0; i < 3; ++i) {
      const RecordedScan scan = recording.read_scan(i);
      for (std::size_t k = 0; k < scan.size(); ++k) {
        CAPTURE(by_transforms, i, k);
        CHECK((point_of(scan, k) - point_of(scan, 0)).norm() < 0.005F);
      }
    }
  }
}

TEST_CASE("Points at the origin and points without a finite time keep their place") {
  const TemporaryFolder folder;
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  write_two_scans(folder, {{{0, 0, 0}, 0.05}, {{5, 0, 0}, unknown}, {{5, 0, 0}, 0.05}});
  write_text(folder / "poses.tum", "0 0 0 0 0 0 0 1\n0.1 2 0 0 0 0 0 1\n");
  const Recording recording(folder.path(), with_deskewing());
  const RecordedScan scan = recording.read_scan(0);
  CHECK(point_of(scan, 0).isZero(0.0F));
  CHECK(point_of(scan, 1).x() == 5.0F);
  CHECK(point_of(scan, 2).x() == Approx(6.0F).margin(1e-4));
}

TEST_CASE("De-skewing follows the time offset between scans and poses") {
  const TemporaryFolder folder;
  write_two_scans(folder, {{{5, 0, 0}, 0.0}, {{5, 0, 0}, 0.05}});
  // The clock of the poses is 40 s ahead; the sensor moves at 20 m/s in the first 0.1 s.
  write_text(folder / "times.txt", "0\n0.1\n");
  write_text(folder / "poses.tum", "40 0 0 0 0 0 0 1\n40.1 2 0 0 0 0 0 1\n40.2 2 0 0 0 0 0 1\n");
  RecordingOptions options = with_deskewing();
  options.time_offset = 40.0;
  const RecordedScan scan = Recording(folder.path(), options).read_scan(0);
  CHECK(point_of(scan, 0).x() == Approx(5.0F).margin(1e-4));
  CHECK(point_of(scan, 1).x() == Approx(6.0F).margin(1e-4));
}

TEST_CASE("De-skewing that is not possible is an error with its reason") {
  const TemporaryFolder folder;
  write_drive(folder / "other_clock", [](double, double offset) { return 100.0 + offset; });
  CHECK_THAT(error_of(folder / "other_clock"),
             ContainsSubstring((folder / "other_clock" / "scan1.ply").string()) &&
                 ContainsSubstring("expected times of points within 1 s of the time of the scan"));

  write_drive(folder / "drive", [](double, double offset) { return offset; });
  RecordingOptions options = with_deskewing();
  options.frame = PointFrame::kWorld;
  CHECK_THAT(error_of(folder / "drive", options),
             ContainsSubstring("needs points in the frame of the sensor"));
  write_text(folder / "drive" / "poses.tum",
             "0 0 0 0 0 0 0 1\n0.1 2 0 0 0 0 0 1\n9 2 0 0 0 0 0 1\n");
  write_text(folder / "drive" / "times.txt", "0\n0.1\n9\n");
  CHECK_THAT(
      message_of<IoError>([&] { Recording(folder / "drive", with_deskewing()).read_scan(2); }),
      ContainsSubstring("expected poses at most 1 s apart"));

  fs::create_directory(folder / "bare");
  PointFileWriter(folder / "bare" / "0.ply").commit();
  write_text(folder / "bare" / "poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  CHECK_THAT(error_of(folder / "bare"), ContainsSubstring("a column time"));
}

}  // namespace dynains
