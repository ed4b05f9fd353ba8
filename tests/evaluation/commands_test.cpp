// The commands for evaluation, from the command line to the files that they write.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/io/point_file.hpp"
#include "io/files.hpp"
#include "program/command.hpp"
#include "run/labelled_sequence.hpp"
#include "scenes.hpp"
#include "simulation/write_sequence.hpp"
#include "support/catch.hpp"
#include "support/scene.hpp"

namespace dynains::program {

using namespace evaluation::testing;
using simulation::scan_name;
using test::read_text;
using test::TemporaryFolder;

namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Flat ground, a wall and a box of a car (instance 3) that moves `speed` m per scan along y.
OwnedScan street_scan(std::size_t number, double speed) {
  OwnedScan scan;
  for (int ring = 0; ring < 12; ++ring) {
    for (int step = 0; step < 240; ++step) {
      const Eigen::Vector3d place = (4.0 + 1.5 * ring) * test::ray_of(0.0, step * M_PI / 120);
      scan.add(static_cast<float>(place.x()), static_cast<float>(place.y()), -1.7F, kRoad);
    }
  }
  for (int column = 0; column < 120; ++column) {
    for (int row = 0; row < 12; ++row) {
      scan.add(-10.0F, -9.0F + 0.15F * static_cast<float>(column),
               -1.4F + 0.25F * static_cast<float>(row), 50);
    }
  }
  const auto y = static_cast<float>(-4.0 + speed * static_cast<double>(number));
  for (int column = 0; column < 60; ++column) {
    for (int row = 0; row < 8; ++row) {
      scan.add(9.0F, y + 0.05F * static_cast<float>(column),
               -1.3F + 0.15F * static_cast<float>(row), kMovingCar | 3U << 16U);
    }
  }
  return scan;
}

/// Writes the scans as a sequence; returns them.
std::vector<OwnedScan> write_street(const std::filesystem::path& folder, std::size_t scans,
                                    double speed = 1.0) {
  std::filesystem::create_directories(folder / "velodyne");
  std::filesystem::create_directories(folder / "labels");
  std::vector<OwnedScan> result;
  std::vector<Pose> poses;
  std::vector<double> times;
  for (std::size_t number = 0; number < scans; ++number) {
    result.push_back(street_scan(number, speed));
    const OwnedScan& scan = result.back();
    std::vector<float> xyzi;
    for (std::size_t i = 0; i < scan.truth.size(); ++i) {
      xyzi.insert(xyzi.end(), {scan.xyz[3 * i], scan.xyz[3 * i + 1], scan.xyz[3 * i + 2], 0.5F});
    }
    write_scan(folder / "velodyne" / (scan_name(number) + ".bin"), xyzi);
    write_labels(folder / "labels" / (scan_name(number) + ".label"), scan.truth);
    poses.push_back(scan.T_world_sensor);
    times.push_back(0.1 * static_cast<double>(number));
  }
  write_poses(folder / "poses.txt", poses);
  write_times(folder / "times.txt", times);
  return result;
}

/// Labels of a run that is right except for the first `missed` moving points of each scan: final
/// labels, or the verdicts without latency ("online").
void write_run(const std::filesystem::path& out, const std::vector<OwnedScan>& scans,
               std::size_t missed, const std::string& kind = "labels") {
  std::filesystem::create_directories(out / kind);
  for (std::size_t number = 0; number < scans.size(); ++number) {
    std::vector<std::uint32_t> labels;
    std::size_t moving = 0;
    for (const std::uint32_t truth : scans[number].truth) {
      const bool found = evaluation::semantic_class(truth) == kMovingCar && moving++ >= missed;
      labels.push_back(found ? 251 : 9);
    }
    write_labels(out / kind / (scan_name(number) + ".label"), labels);
  }
}

/// Standard output of `dynains <arguments>`. Exceptions of the command are passed on.
std::string call(std::vector<std::string> arguments) {
  CLI::App app("test", "dynains");
  add_eval_command(app);
  std::ostringstream output;
  std::streambuf* const before = std::cout.rdbuf(output.rdbuf());
  std::reverse(arguments.begin(), arguments.end());
  try {
    app.parse(arguments);
  } catch (...) {
    std::cout.rdbuf(before);
    throw;
  }
  std::cout.rdbuf(before);
  return output.str();
}

std::string message_of(const std::vector<std::string>& arguments) {
  return test::message_of<std::exception>([&] { call(arguments); });
}
const std::string kNoMessage = "(nothing was thrown)";

/// A street with a correct run, whose score is written to `json`.
struct JudgedStreet {
  explicit JudgedStreet(std::size_t scan_count = 3) : scans(write_street(sequence, scan_count)) {
    write_run(run, scans, 0);
  }
  std::vector<std::string> eval(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {"eval",   sequence.string(), run.string(),
                                          "--json", json.string(),     "--force"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  nlohmann::json result() const { return nlohmann::json::parse(read_text(json)); }

  TemporaryFolder folder;
  fs::path sequence = folder.path() / "street";
  std::vector<OwnedScan> scans;
  fs::path run = folder.path() / "run";
  fs::path json = folder.path() / "eval.json";
};

}  // namespace

TEST_CASE("eval refuses an incomplete run, unless a flag allows it") {
  const JudgedStreet street;
  const std::string sequence = street.sequence.string();
  const fs::path run = street.run;
  const auto report = [&](const std::string& text) { test::write_text(run / "report.json", text); };
  const std::string unfinished = R"({"program": "dynains", "complete": false})";

  CHECK_NOTHROW(call({"eval", sequence, run.string()}));  // without report.json: by any tool
  report(R"({"program": "dynains", "complete": true})");
  CHECK_NOTHROW(call({"eval", sequence, run.string()}));
  report(R"({"program": "other", "complete": false})");
  CHECK_NOTHROW(call({"eval", sequence, run.string()}));
  report(unfinished);
  CHECK_THROWS_WITH(call({"eval", sequence, run.string()}),
                    ContainsSubstring("run/report.json: /complete: expected true, found false") &&
                        ContainsSubstring("--unfinished"));
  CHECK_NOTHROW(call({"eval", sequence, run.string(), "--unfinished"}));
  report(R"({"program": "dynains", "complete": "no"})");
  CHECK(has(message_of({"eval", sequence, run.string()}), "expected true or false, found string"));
  report("{");
  CHECK(has(message_of({"eval", sequence, run.string()}), "json:1: column 2: expected JSON"));
  report(unfinished);

  PointFileWriter map(run / "map.ply");
  map.add({});
  map.commit();
  CHECK_THROWS_WITH(call({"eval", sequence, "--map", (run / "map.ply").string()}),
                    ContainsSubstring("/complete: expected true"));
  fs::rename(run / "map.ply", street.folder.path() / "map.ply");
  CHECK_NOTHROW(call({"eval", sequence, "--map", (street.folder.path() / "map.ply").string()}));
}

TEST_CASE("eval scores a run beside identity and oracle") {
  const JudgedStreet street(4);
  const std::string half = (street.folder.path() / "half").string();
  write_run(half, street.scans, 240);  // of 480 points

  const std::string csv_path = (street.folder.path() / "eval.csv").string();
  const std::string text = call({"eval", street.sequence.string(), half, street.run.string(),
                                 "--errors", "--json", street.json.string(), "--csv", csv_path});
  CHECK(has(text, "identity"));
  CHECK(has(text, "moving-car"));
  const auto json = street.result();
  REQUIRE(json["rows"].size() == 4);
  CHECK(json["rows"][1]["points"]["ha"] == 100.0);
  CHECK(json["rows"][2]["points"]["da"] == 50.0);
  CHECK(json["rows"][2]["points"]["sa"] == 100.0);
  CHECK(json["rows"][3]["voxels"]["f1"] == 1.0);
  CHECK(json["errors"]["by_class"][2]["removed"] == 960);
  CHECK(has(read_text(csv_path), "identity"));

  const std::string window = call({"eval", street.sequence.string(), "--start", "1", "--end", "2"});
  CHECK(has(window, "2 scans, "));
}

TEST_CASE("eval judges the scans that have ground truth, and tells how many have none") {
  const JudgedStreet street;
  fs::remove(street.sequence / "labels" / "000001.label");
  std::ostringstream told;
  std::streambuf* const before = std::cerr.rdbuf(told.rdbuf());
  const std::string text = call(street.eval());
  std::cerr.rdbuf(before);
  CHECK(has(text, "2 scans, "));
  CHECK(has(told.str(), "1 of 3 scans have no ground truth"));
  CHECK(street.result()["rows"][1]["points"]["ha"] == 100.0);
  fs::remove(street.sequence / "labels" / "000000.label");
  fs::remove(street.sequence / "labels" / "000002.label");
  CHECK(has(message_of(street.eval()), "no label of any chosen scan"));
}

TEST_CASE("Ground truth of moving object segmentation is judged as it is") {
  const JudgedStreet street;
  for (std::size_t i = 0; i < street.scans.size(); ++i) {
    std::vector<std::uint32_t> labels;
    for (const std::uint32_t truth : street.scans[i].truth) {
      labels.push_back(evaluation::semantic_class(truth) >= 252 ? 251 : 9);
    }
    write_labels(street.sequence / "labels" / (scan_name(i) + ".label"), labels);
  }
  call(street.eval());
  const auto json = street.result();
  CHECK(json["rows"][1]["points"]["da"] == 100.0);
  CHECK(json["rows"][1]["points"]["sa"] == 100.0);
}

TEST_CASE("eval --online scores the verdicts without latency, and only these") {
  const JudgedStreet street;
  const auto accuracy = [&](const std::vector<std::string>& more) {
    call(street.eval(more));
    return street.result()["rows"][2]["points"]["da"].get<double>();
  };
  CHECK(message_of(street.eval({"--online"})) != kNoMessage);
  write_run(street.run, street.scans, 120, "online");  // of 480 points
  CHECK(accuracy({}) == 100.0);
  CHECK(accuracy({"--online"}) == 75.0);
}

TEST_CASE("Maps of several runs are distinguished by their paths") {
  const JudgedStreet street;
  std::vector<std::string> maps;
  for (const char* run : {"a", "b"}) {
    fs::create_directories(street.folder.path() / run);
    maps.push_back((street.folder.path() / run / "static_map.ply").string());
    PointFileWriter(maps.back()).commit();
  }
  const std::string sequence = street.sequence.string();
  const std::string one = call({"eval", sequence, "--map", maps[0]});
  CHECK(has(one, "static_map.ply"));
  CHECK(!has(one, maps[0]));
  const std::string two = call({"eval", sequence, "--map", maps[0], "--map", maps[1]});
  CHECK(has(two, maps[0]));
  CHECK(has(two, maps[1]));
}

TEST_CASE("A file that cannot be written is detected before the evaluation") {
  const JudgedStreet street;
  // If it were detected afterwards, the error would be the missing run.
  const std::string missing = (street.folder.path() / "nowhere").string();
  const std::string broken = (street.folder.path() / "no run").string();
  for (const char* flag : {"--json", "--csv"}) {
    CHECK(has(message_of({"eval", street.sequence.string(), broken, flag, missing + "/file"}),
              missing + ": cannot be opened"));
  }
}

TEST_CASE("eval scores map files of either format") {
  const JudgedStreet street;
  for (const char* name : {"map.ply", "map.pcd"}) {
    const fs::path path = street.folder.path() / name;
    PointFileWriter writer(path);
    for (const auto& scan : street.scans) {
      for (std::size_t i = 0; i < scan.truth.size(); ++i) {
        FilePoint point;
        point.position = scan.view().point(i);
        if (evaluation::semantic_class(scan.truth[i]) != kMovingCar) writer.add(point);
      }
    }
    writer.commit();
    call({"eval", street.sequence.string(), "--map", path.string(), "--json", street.json.string(),
          "--force"});
    const auto json = street.result();
    REQUIRE(json["rows"].size() == 3);
    CHECK(json["rows"][2]["voxels"]["f1"] == 1.0);
    CHECK(json["rows"][2]["points"]["ha"] == 100.0);
    CHECK(json["rows"][2]["foreign_points"] == 0);
  }
}

TEST_CASE("eval names the problem of its input, and then writes nothing") {
  const JudgedStreet street;
  const auto& [folder, sequence, scans, run, json] = street;
  const std::vector<std::string> good = street.eval();
  CHECK(has(message_of(street.eval({"--classes", "252-"})), "classes = \"252-\""));
  CHECK(has(message_of(street.eval({"--voxel", "0"})), "EvaluationConfig.voxel = 0 must be in"));
  CHECK(has(message_of(street.eval({"--max-range", "1"})), "crossed"));
  CHECK(has(message_of(street.eval({"--unlabeled", "maybe"})), "maybe"));
  CHECK(has(message_of(street.eval({"--start", "7"})), "no scan within the chosen window"));
  CHECK(has(message_of(street.eval({"--map", (folder.path() / "none.ply").string()})), "none.ply"));
  CHECK(has(message_of({"eval", sequence.string(), (folder.path() / "nobody").string()}),
            "no labels for any scan"));
  CHECK(has(message_of({"eval", (folder.path() / "nowhere").string()}), "nowhere"));
  CHECK(!fs::exists(json));

  // A gap in the numbers of the label files is an error.
  const fs::path label = run / "labels" / "000001.label";
  fs::rename(label, folder.path() / "aside");
  CHECK(has(message_of(good), "000001.label"));
  fs::rename(folder.path() / "aside", label);

  const std::vector<std::uint32_t> short_by_one(scans[1].truth.size() - 1, 9);
  write_labels(label, short_by_one);
  CHECK(has(message_of(good), "000001.label"));
  std::vector<std::uint32_t> strange(scans[1].truth.size(), 9);
  strange[5] = 40;
  write_labels(label, strange);
  CHECK(has(message_of(good), "point 5 has class 40; expected 9 (static), 251 (moving)"));
  write_run(run, scans, 0);

  fs::create_directories(run / "causes");
  std::ofstream(run / "causes" / "000002.cause") << "short";
  CHECK(has(message_of(good), "000002.cause: has 5 bytes; expected a byte for each"));
  fs::remove(run / "causes" / "000002.cause");
  fs::create_directory(run / "causes" / "000002.cause");
  CHECK(has(message_of(good), "000002.cause: Is a directory; expected a byte for each"));
  fs::remove_all(run / "causes");

  fs::rename(sequence / "labels", sequence / "labels_aside");
  CHECK(has(message_of(good), "no ground truth"));
  CHECK(!fs::exists(json));
  fs::rename(sequence / "labels_aside", sequence / "labels");
  CHECK(message_of(good) == kNoMessage);
  CHECK(fs::exists(json));
}

}  // namespace dynains::program
