#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "dynains/pose.hpp"
#include "io/folder.hpp"
#include "program/run_folder.hpp"
#include "program/tiny_sequence.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

constexpr std::size_t kRunScans = 12;

std::vector<Pose> other_poses(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = 20.0 * Eigen::Vector3d(any(random), any(random), any(random));
    pose.linear() = Eigen::Quaterniond(1.0, any(random), any(random), any(random))
                        .normalized()
                        .toRotationMatrix();
    poses.push_back(pose);
  }
  return poses;
}

void write_other_poses(const std::string& file, std::size_t count, unsigned seed) {
  const std::vector<Pose> poses = other_poses(count, seed);
  write_poses(file, poses);
}

/// A finished run over a small sequence, and a file of corrected poses.
struct RemapFixture : RunFolder {
  explicit RemapFixture(const Arguments& more = {}) {
    write_tiny_sequence(seq, kRunScans);
    write_other_poses(corrected, kRunScans, 7);
    succeed(run(more));
  }
  RemapFixture(const RemapFixture& other) : RunFolder() {
    fs::copy(other.folder.path(), folder.path(), fs::copy_options::recursive);
  }
  Outcome remap(const Arguments& more = {}) const {
    return start(Arguments{"remap", seq, out} + more);
  }
  /// Changes the report of the run.
  template <class Change>
  void edit_report(Change&& change) const {
    nlohmann::json edited = report();
    change(edited);
    write_text(report_file, edited.dump());
  }

  std::string corrected = folder / "corrected.txt";
  std::string map = out + "/static_map_remapped.ply";
  std::string report_file = out + "/report.json";
};

/// Bytes of the map of the labels in `out` under the poses of `corrected`.
std::string expected_map(const Recording& points, const Recording& corrected,
                         const std::string& out) {
  StaticMapAccumulator map;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const RecordedScan scan = points.read_scan(i);
    const auto labels = read_labels(out + "/labels/" + points.name(i) + ".label", scan.size());
    PointBuffer cloud;
    std::vector<std::uint8_t> keep;
    for (std::size_t k = 0; k < scan.size(); ++k) {
      cloud.push_back(scan.xyzi[4 * k], scan.xyzi[4 * k + 1], scan.xyzi[4 * k + 2]);
      keep.push_back((labels[k] & 0xffffU) == 9 ? 1 : 0);
    }
    map.insert(cloud, keep, orthonormalized(corrected.T_world_sensor(i)));
  }
  const TemporaryFolder folder;
  const std::string file = folder / "map.ply";
  PointFileWriter writer(file);
  map.for_each([&](const Eigen::Vector3d& point) {
    FilePoint out_point;
    out_point.position = point;
    writer.add(out_point);
  });
  writer.commit();
  return read_text(file);
}

std::string expected_map(const RemapFixture& f) {
  RecordingOptions options;
  options.poses = f.corrected;
  const Recording recording(f.seq, options);
  return expected_map(recording, recording, f.out);
}

}  // namespace

TEST_CASE("remap gives the bytes of a map of the labels and the corrected poses") {
  const RemapFixture f;
  const std::string own_map = read_text(f.out + "/static_map.ply");
  const Outcome outcome = succeed(f.remap({"--poses", f.corrected}));
  CHECK(read_text(f.map) == expected_map(f));
  CHECK_THAT(outcome.out, ContainsSubstring("12 scans, static map: "));
  CHECK(read_text(f.out + "/static_map.ply") == own_map);
  const auto report = f.report();
  CHECK(report["remapped_map"]["points"] == read_points(f.map).positions.size());
  CHECK(report["complete"] == true);

  SECTION("a further correction replaces the map") {
    write_other_poses(f.corrected, kRunScans, 8);
    succeed(f.remap({"--poses", f.corrected, "-q"}));
    CHECK(read_text(f.map) == expected_map(f));
  }
  SECTION("a map elsewhere leaves the folder of the run as it is") {
    const std::string before = read_text(f.report_file);
    const std::string elsewhere = f.folder / "corrected.ply";
    succeed(f.remap({"--poses", f.corrected, "--map", elsewhere}));
    CHECK(read_text(elsewhere) == expected_map(f));
    CHECK(read_text(f.report_file) == before);
    CHECK_THAT(f.remap({"--map", elsewhere}).err, ContainsSubstring("exists"));
    CHECK(read_text(elsewhere) == expected_map(f));
    CHECK(f.remap({"--map", elsewhere, "--force"}).code == 0);
    CHECK(read_text(elsewhere) != expected_map(f));
  }
}

TEST_CASE("remap of scans of thousands of points gives the same bytes") {
  const RemapFixture f;
  std::mt19937 random(11);
  std::uniform_real_distribution<float> place(-30.0F, 30.0F);
  constexpr std::uint32_t kClasses[] = {9, 9, 9, 251, 0};
  for (const std::size_t count : {std::size_t{4095}, std::size_t{4096}, std::size_t{13001}}) {
    std::vector<float> scan(4 * count);
    for (float& value : scan) value = place(random);
    std::vector<std::uint32_t> labels(count);
    for (std::uint32_t& label : labels) label = kClasses[random() % 5] | 7U << 16U;
    for (std::size_t k = 0; k < count; ++k) {
      if ((labels[k] & 0xffffU) == 0) scan[4 * k + k % 3] = std::nanf("");
    }
    const std::string name = scan_name(count % 12);
    write_scan(f.seq + "/velodyne/" + name + ".bin", scan);
    write_labels(f.out + "/labels/" + name + ".label", labels);
    fs::remove(f.out + "/causes/" + name + ".cause");
  }
  succeed(f.remap({"--poses", f.corrected}));
  CHECK(read_text(f.map) == expected_map(f));
}

TEST_CASE("remap with the poses of the run fills the voxels of the run's map") {
  const RemapFixture f({"--level", "false"});
  succeed(f.remap());
  CHECK(read_points(f.map).positions.size() ==
        read_points(f.out + "/static_map.ply").positions.size());
  succeed(f.remap({"--map-voxel", "0"}));
  const auto report = f.report();
  CHECK(read_points(f.map).positions.size() == report["labels"]["static"].get<std::size_t>() +
                                                   report["labels"]["ground"].get<std::size_t>());
}

TEST_CASE("remap takes a run over some of the scans, from --start to --end") {
  const RemapFixture f({"--start", "3", "--end", "8"});
  const Outcome outcome = succeed(f.remap({"--poses", f.corrected}));
  CHECK_THAT(outcome.out, ContainsSubstring("6 scans"));
  CHECK(fs::exists(f.out + "/labels/000003.label"));
  CHECK(fs::exists(f.out + "/labels/000008.label"));
}

TEST_CASE("remap of points in the frame of the world leads through the poses of the run") {
  RemapFixture f;
  const std::string seq = f.folder / "world";
  fs::create_directories(seq + "/pcd");
  const std::vector<Pose> poses = other_poses(kRunScans, 3);
  for (std::size_t i = 0; i < kRunScans; ++i) {
    PointFileWriter writer(seq + "/pcd/" + scan_name(i) + ".pcd", {}, poses[i]);
    const std::vector<float> scan = tiny_scan(i);
    for (std::size_t k = 0; k < scan.size(); k += 4) {
      FilePoint point;
      point.position =
          poses[i] * Eigen::Vector3d(static_cast<double>(scan[k]), static_cast<double>(scan[k + 1]),
                                     static_cast<double>(scan[k + 2]));
      writer.add(point);
    }
    writer.commit();
  }
  const std::string out = f.folder / "world out";
  succeed(start({"run", seq, "--out", out, "--frame", "world", "--accept-poses"}));
  succeed(start({"remap", seq, out, "--poses", f.corrected}));
  RecordingOptions world;
  world.frame = PointFrame::kWorld;
  RecordingOptions corrected;
  corrected.poses = f.corrected;
  corrected.frame = PointFrame::kSensor;
  CHECK(read_text(out + "/static_map_remapped.ply") ==
        expected_map(Recording(seq, world), Recording(seq, corrected), out));

  // The poses of the run came from elsewhere.
  const std::string other = f.folder / "other.txt";
  write_other_poses(other, kRunScans, 4);
  const std::string other_out = f.folder / "other out";
  succeed(start(
      {"run", seq, "--out", other_out, "--frame", "world", "--poses", other, "--accept-poses"}));
  check_refused(start({"remap", seq, other_out, "--poses", f.corrected}), 1,
                "are not those of the run");
}

TEST_CASE("remap refuses what does not belong together, and writes nothing then") {
  const RemapFixture made;
  const std::string name = scan_name(4);
  const auto write_points = [&](const RemapFixture& f, const std::vector<float>& xyzi) {
    write_scan(f.seq + "/velodyne/" + name + ".bin", xyzi);
  };
  const auto write_classes = [&](const RemapFixture& f, const std::vector<std::uint32_t>& labels) {
    write_labels(f.out + "/labels/" + name + ".label", labels);
  };
  struct Case {
    std::function<void(const RemapFixture&)> spoil;
    std::string expected;
  };
  const std::vector<Case> cases = {
      {[](const auto& f) { write_other_poses(f.corrected, kRunScans - 1, 7); }, "expected"},
      {[](const auto& f) {
         std::string rows, times;
         for (std::size_t i = 0; i < kRunScans; ++i) {
           const std::string time = std::to_string(0.1 * static_cast<double>(i));
           if (i < 8) rows += time + " 0 0 0 0 0 0 1\n";
           times += time + '\n';
         }
         write_text(f.corrected, rows);
         write_text(f.seq + "/times.txt", times);
       },
       "has no pose or no scan for 4 of 12 scans of the run, 000008 first"},
      {[](const auto& f) { f.edit_report([](auto& report) { report["complete"] = false; }); },
       "/complete: expected true"},
      {[](const auto& f) {
         f.edit_report([](auto& report) { report["outputs"]["scans"].clear(); });
       },
       "/outputs/scans: expected the scans of the run"},
      {[](const auto& f) {
         fs::remove_all(f.out);
         fs::create_directory(f.out);
       },
       "report.json: not found"},
      {[](const auto& f) { fs::remove_all(f.out); }, "cannot be opened: No such file"},
      {[&](const auto& f) { write_points(f, std::vector<float>(40, 1.0F)); }, name + ".label: has"},
      {[&](const auto& f) {
         write_classes(f, std::vector<std::uint32_t>(tiny_scan(4).size() / 4, 40));
       },
       "point 0 has class 40"},
      {[&](const auto& f) {
         write_points(f, std::vector<float>(std::size_t{4} * 9001, 5.0F));
         std::vector<std::uint32_t> labels(9001, 9);
         labels.back() = 40;
         write_classes(f, labels);
       },
       "point 9000 has class 40"},
      {[&](const auto& f) {
         write_points(f, std::vector<float>(tiny_scan(4).size(), std::nanf("")));
       },
       "not finite"},
      {[](const auto& f) { write_text(f.map, "mine"); }, "exists, and is no file of the results"},
  };
  const auto check_unchanged = [](const RemapFixture& f, const std::vector<std::string>& flags,
                                  int code, const std::string& expected) {
    CAPTURE(expected);
    const auto text_of = [](const std::string& file) {
      return fs::exists(file) ? read_text(file) : "";
    };
    const std::string report = text_of(f.report_file), map = text_of(f.map);
    check_refused(f.remap(Arguments{"--poses", f.corrected} + flags), code, expected);
    CHECK(text_of(f.report_file) == report);
    CHECK(text_of(f.map) == map);
  };
  for (const Case& wrong : cases) {
    const RemapFixture f(made);
    wrong.spoil(f);
    check_unchanged(f, {}, 1, wrong.expected);
  }
  check_unchanged(made, {"--map", made.out + "/static_map.ply"}, 2,
                  "in the folder of the run, the map is static_map_remapped.ply");
  check_unchanged(made, {"--map-voxel", "0.001"}, 2, "map_voxel = 0.001");
  check_unchanged(made, {"--session", "monday"}, 2, "--session needs --update CITY");
  const Folder folder(made.out);
  folder.lock();
  check_unchanged(made, {}, 2, "is in use");
}
