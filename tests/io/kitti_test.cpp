#include "dynains/io/kitti.hpp"

#include "dynains/io/recording.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

std::string bytes(std::size_t count) { return std::string(count, '\0'); }

/// A valid sequence of three scans with 2 points each. Tests then damage one part of it.
void make_sequence(const TemporaryFolder& folder) {
  for (const char* name : {"000000", "000001", "000002"}) {
    write_text(folder / ("velodyne/" + std::string(name) + ".bin"), bytes(32));
    write_text(folder / ("labels/" + std::string(name) + ".label"), bytes(8));
  }
  write_text(folder / "poses.txt", pose_row() + pose_row() + pose_row());
}

std::string open_error(const TemporaryFolder& folder) {
  return message_of<IoError>([&] { Recording recording(folder.path()); });
}

}  // namespace

TEST_CASE("Written sequences are read back") {
  TemporaryFolder folder;
  make_sequence(folder);
  const std::vector<float> scan = {1.5F, -2.0F, 3.25F, 0.5F, std::nanf(""), -0.0F, 1e30F, 1.0F};
  const std::vector<std::uint32_t> labels = {251U | 7U << 16, 0xFFFFFFFFU};
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
  pose.translation() << 691234.123456, 5334567.654321, 512.25;  // UTM
  const std::vector<Pose> poses(3, pose);
  const std::vector<double> times = {1571.123456789, 1571.2, 1600000000.000001};

  write_scan(folder / "velodyne/000001.bin", scan);
  write_labels(folder / "labels/000001.label", labels);
  write_poses(folder / "poses.txt", poses);
  write_times(folder / "times.txt", times);

  const Recording recording(folder.path());
  CHECK(recording.size() == 3);
  CHECK(recording.name(1) == "000001");
  CHECK(recording.point_count(1) == 2);
  const std::vector<float> read = recording.read_scan(1).xyzi;
  REQUIRE(read.size() == scan.size());
  CHECK(read[2] == 3.25F);
  CHECK(std::isnan(read[4]));
  CHECK(std::signbit(read[5]));
  CHECK(recording.has_labels());
  CHECK(recording.read_labels(1) == labels);
  CHECK(recording.time(0) == times[0]);
  CHECK(recording.time(2) == times[2]);
  CHECK(recording.T_world_sensor(2).translation() == pose.translation());
  CHECK(recording.T_world_sensor(2).linear().isApprox(pose.linear(), 1e-15));
}

TEST_CASE("Scans find their rows by number, or by order in a clip") {
  TemporaryFolder folder;
  write_text(folder / "velodyne/000002.bin", bytes(16));
  write_text(folder / "velodyne/000003.bin", bytes(16));
  const auto check = [&](double first, double second, double time) {
    const Recording recording(folder.path());
    CHECK(recording.T_world_sensor(0).translation().x() == first);
    CHECK(recording.T_world_sensor(1).translation().x() == second);
    CHECK(recording.time(1) == Approx(time));
  };
  write_text(folder / "poses.txt",
             pose_row(10) + pose_row(11) + pose_row(12) + pose_row(13) + pose_row(14));
  check(12.0, 13.0, 0.3);
  write_text(folder / "poses.txt", pose_row(10) + pose_row(11));  // of the clip
  check(10.0, 11.0, 0.1);
  write_text(folder / "poses.txt", pose_row(10) + pose_row(11) + pose_row(12));
  CHECK_THAT(open_error(folder),
             ContainsSubstring("poses.txt:4:") && ContainsSubstring("at least 4, found 3"));
}

TEST_CASE("Rounded rotations are accepted and made exact") {
  TemporaryFolder folder;
  make_sequence(folder);
  // 30 degrees about z with four digits.
  const std::string row = "0.8660 -0.5000 0 1 0.5000 0.8660 0 2 0 0 1 3\n";
  write_text(folder / "poses.txt", row + row + row);
  const Recording recording(folder.path());
  const Eigen::Matrix3d R = recording.T_world_sensor(0).linear();
  CHECK((R.transpose() * R).isApprox(Eigen::Matrix3d::Identity(), 1e-14));
  CHECK(R(1, 0) == Approx(0.5).epsilon(1e-4));
}

TEST_CASE("Empty scans and blank lines at the end are accepted") {
  TemporaryFolder folder;
  make_sequence(folder);
  write_text(folder / "velodyne/000001.bin", "");
  write_text(folder / "poses.txt", pose_row() + pose_row() + pose_row() + "\n  \n");
  const Recording recording(folder.path());
  CHECK(recording.read_scan(1).xyzi.empty());
}

TEST_CASE("Broken sequences are refused with path, line and expectation") {
  const std::string id = pose_row();
  struct Case {
    const char* file;                 // of the sequence
    std::optional<std::string> text;  // none: the file or folder is removed
    std::vector<std::string> parts;   // of the message
  };
  const std::vector<Case> cases = {
      {"velodyne", {}, {": has no scans; expected a KITTI folder"}},
      {"velodyne/cloud.bin", bytes(16), {"cloud.bin: expected a number"}},
      {"velodyne/1.bin", bytes(16), {"two scans with one number", "000001.bin", "1.bin"}},
      {"poses.txt", {}, {"poses.txt: not found", "12 numbers"}},
      {"poses.txt", id + id, {"txt:3: expected a row for each scan, at least 3, found 2"}},
      {"poses.txt",
       id + id + "1 0 0 0 0 1 0 0 0 0 1 O\n",
       {"poses.txt:3: expected a finite number in column 12, found \"O\""}},
      {"times.txt", "0\n0.1\n", {"txt:3: expected a row for each scan, at least 3, found 2"}},
      {"times.txt", "0\n0.1\n0.1\n", {"times.txt:3: expected a time after"}},
      {"calib.txt", "P0: 7 0 6 0 0 7 1 0 0 0 1 0\n", {"calib.txt: expected a line \"Tr: \""}},
      {"calib.txt",
       "P0: 1\nTr: 7 0 6 0 0 7 1 0 0 0 1 0\n",
       {"calib.txt:2: expected a rigid transform"}}};
  for (const Case& broken : cases) {
    TemporaryFolder folder;
    make_sequence(folder);
    if (broken.text) {
      write_text(folder / broken.file, *broken.text);
    } else {
      fs::remove_all(folder / broken.file);
    }
    const std::string text = open_error(folder);
    CHECK_THAT(text, StartsWith(folder.path().string()));
    for (const std::string& part : broken.parts) CHECK_THAT(text, ContainsSubstring(part));
  }
}

TEST_CASE("Broken scans and labels are refused with path and size") {
  TemporaryFolder folder;
  make_sequence(folder);
  const Recording recording(folder.path());
  const auto refusal = [&](const char* file, std::size_t size) {
    write_text(folder / file, bytes(size));
    if (size == 0) fs::remove(folder / file);
    return message_of<IoError>([&] {
      recording.read_scan(1);
      recording.read_labels(1);
    });
  };
  CHECK_THAT(
      refusal("labels/000001.label", 12),
      ContainsSubstring("000001.label: has 12 bytes, expected 8") && ContainsSubstring("2 points"));
  CHECK_THAT(refusal("labels/000001.label", 0), ContainsSubstring("000001.label: cannot be read"));
  CHECK_THAT(
      refusal("velodyne/000001.bin", 31),
      ContainsSubstring("000001.bin: truncated at byte 31") && ContainsSubstring("multiple of 16"));
  CHECK_THAT(refusal("velodyne/000001.bin", 0), ContainsSubstring("000001.bin: cannot be read"));
}

TEST_CASE("A scan of any size has the same points after it is written and read") {
  TemporaryFolder folder;
  const fs::path file = folder / "000000.bin";
  for (const std::size_t points : {0U, 4095U, 4096U, 4097U, 10000U}) {
    std::vector<float> xyzi(4 * points);
    for (std::size_t i = 0; i < xyzi.size(); ++i) xyzi[i] = static_cast<float>(i);
    write_scan(file, xyzi);
    std::vector<float> read(7);
    read_scan(file, read);
    CHECK(read == xyzi);
  }
}
