// Trajectories and folders of scans: any contents and any file names give valid poses and points,
// or an IoError that names the place.

#include "dynains/io/recording.hpp"
#include "dynains/io/trajectory.hpp"
#include "io/files.hpp"
#include "support/standard.hpp"
#include "targets.hpp"

namespace dynains::fuzz {
namespace {

// One text encodes a folder: a file begins with "@@" and the letter of its name, and ends where the
// next one begins.
constexpr char kFirstName = 'a';
const char* const kNames[] = {
    "poses.txt",
    "times.txt",
    "calib.txt",
    "trajectory.csv",
    "poses.tum",
    "timestamps.txt",
    "velodyne/0.bin",
    "velodyne/1.bin",
    "velodyne/2.bin",
    "labels/0.label",
    "labels/1.label",
    "pcd/1.pcd",
    "pcd/2.pcd",
    "pcd/10.pcd",
    "scans/1.5.ply",
    "scans/2.5.ply",
    "1700000000.000001.bin",
    "1700000000_1000.bin",
    "1700000001.bin",
    "README.md",
    "cloud.pcd",
    "cloud.ply",
    ".hidden.pcd",
    "lidar/1_2.pcd",
};
constexpr std::size_t kNameCount = sizeof(kNames) / sizeof(kNames[0]);

std::string file(char name, const std::string& content) {
  return std::string("@@") + name + content;
}

void write_folder(const fs::path& folder, const std::string& text) {
  std::size_t at = text.find("@@");
  while (at != std::string::npos && at + 2 < text.size()) {
    const std::size_t end = text.find("@@", at + 2);
    const auto which =
        static_cast<std::size_t>(static_cast<unsigned char>(text[at + 2]) - kFirstName);
    if (which < kNameCount) {
      const std::size_t begin = at + 3;
      test::write_text(folder / kNames[which],
                       text.substr(begin, end == std::string::npos ? end : end - begin));
    }
    at = end;
  }
}

std::string bin(float x) { return test::packed(x, 1.0F, -1.0F, 0.5F, x + 3.0F, 2.0F, 0.0F, 0.25F); }

std::string pcd(const std::string& viewpoint) {
  return "VERSION 0.7\nFIELDS x y z ring time label\nSIZE 4 4 4 2 8 4\nTYPE F F F U F U\n"
         "COUNT 1 1 1 1 1 1\nWIDTH 1\nHEIGHT 1\nVIEWPOINT " +
         viewpoint + "\nPOINTS 1\nDATA ascii\n1 2 3 4 5.5 252\n";
}

std::string ply() {
  return "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
         "property float z\nend_header\n1 2 3\n";
}

void run_trajectory(Bytes bytes) {
  static const test::TemporaryFolder folder;
  const fs::path path = folder / "trajectory.txt";
  test::write_text(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  expect_value_or<IoError>(path, [&](const fs::path&) {
    const Trajectory trajectory = read_trajectory(path);
    for (const Pose& pose : trajectory.poses) require_rigid(pose);
    const std::vector<double>& times = trajectory.times;
    require(times.empty() || times.size() == trajectory.poses.size(), "a time for each pose");
    for (std::size_t i = 0; i < times.size(); ++i) {
      require(std::isfinite(times[i]) && (i == 0 || times[i] > times[i - 1]), "times increase");
    }
    for (std::size_t i = 0; i + 1 < times.size(); ++i) {
      const auto match = match_time(trajectory, times[i] + 0.25 * (times[i + 1] - times[i]));
      if (!match) continue;
      require(match->before <= match->after && match->after < times.size(), "rows that are there");
      require(match->share >= 0.0 && match->share <= 1.0, "a share is in [0, 1]");
      require_rigid(interpolate(trajectory.poses[match->before], trajectory.poses[match->after],
                                match->share));
    }
  });
}

void run_recording(Bytes bytes) {
  static const test::TemporaryFolder parent;
  const fs::path folder = parent / "recording";
  fs::remove_all(folder);
  fs::create_directory(folder);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  write_folder(folder, text);
  const unsigned choice = bytes.empty() ? 0U : bytes[0];
  RecordingOptions options;
  options.frame = static_cast<PointFrame>(choice % 3);
  options.convention.invert = (choice & 4U) != 0;
  options.convention.left_handed = (choice & 8U) != 0;
  options.convention.shift = (choice & 16U) != 0 ? 1 : 0;
  if ((choice & 32U) != 0) options.poses = folder / kNames[3];
  if ((choice & 64U) != 0) options.times = folder / kNames[5];
  expect_value_or<IoError>(
      folder, [&](const fs::path&) { check_recording(folder, Recording(folder, options)); });
}

}  // namespace

std::vector<Target> recording_targets() {
  const std::string identity = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const std::string label(8, '\0');
  return {
      {"trajectory",
       run_trajectory,
       {identity + "1 0 0 1 0 1 0 0 0 0 1 0\n", "0.0 0 0 0 0 0 0 1\n0.1 1 2 3 0 0 0.7071 0.7071\n",
        "# timestamp,p_x,p_y,p_z,q_x,q_y,q_z,q_w\n1700000000000000000,1,2,3,0,0,0,1\n"
        "1700000000100000000,1,2,3,0,0,0,1\n",
        "w x y z qw qx qy qz\n1;2;3;4;1;0;0;0\n", "1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1\n",
        "0.5 1 0 0 0 0 1 0 0 0 0 1 0\n1.5 0 -1 0 1 1 0 0 0 0 0 1 0\n"}},
      {"recording",
       run_recording,
       {// KITTI with labels.
        std::string(1, '\0') + file('g', bin(5.0F)) + file('h', bin(6.0F)) +
            file('a', identity + identity) + file('b', "0\n0.1\n") + file('c', "Tr: " + identity) +
            file('j', label) + file('k', label),
        // Point clouds with VIEWPOINT, and point clouds with a trajectory and times.
        std::string(1, '\3') + file('l', pcd("1 2 3 1 0 0 0")) + file('m', pcd("2 2 3 1 0 0 0")),
        std::string(1, '\x21') + file('o', ply()) + file('p', ply()) +
            file('d', "t,x,y,z,qx,qy,qz,qw\n1.5,0,0,0,0,0,0,1\n2.5,1,0,0,0,0,0,1\n"),
        // Times in names.
        std::string(1, '\1') + file('q', bin(1.0F)) + file('s', bin(2.0F)) +
            file('e',
                 "1700000000 0 0 0 0 0 0 1\n1700000000.5 1 0 0 0 0 0 1\n"
                 "1700000001 1 0 0 0 0 0 1\n")}},
  };
}

}  // namespace dynains::fuzz
