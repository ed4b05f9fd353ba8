#include <csignal>

#include "dynains/compiled_remover.hpp"
#include "dynains/io/point_file.hpp"
#include "program/run_folder.hpp"
#include "program/tiny_sequence.hpp"
#include "run/verdict_files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

struct Fixture : RunFolder {
  explicit Fixture(std::size_t scans = 12) { write_tiny_sequence(seq, scans); }
  std::size_t labels() const { return count_entries(out + "/labels"); }
  std::string scan_file(std::size_t i) const { return seq + "/velodyne/" + scan_name(i) + ".bin"; }
  void await_first_scan() const { await("labels/000000.label"); }
  /// Waits for a file of a run that has begun.
  void await(const std::string& file) const {
    for (int i = 0; i < 60000 && !fs::exists(out + ".partial/" + file); ++i) ::usleep(1000);
  }
};

}  // namespace

TEST_CASE("File names are printed without bytes that control the terminal") {
  const Fixture fixture(3);
  const std::string evil = "evil\x1b[31m\nname\xC2\x9B";
  const std::string seq = fixture.folder / evil;
  fs::rename(fixture.seq, seq);
  fs::create_directory(seq + "/labels");
  for (std::size_t i = 0; i < 3; ++i) {
    const std::vector<std::uint32_t> labels(tiny_scan(i).size() / 4, 9);
    write_labels(seq + "/labels/" + scan_name(i) + ".label", labels);
  }
  const std::string out = fixture.folder / (evil + " out");
  const std::string table = fixture.folder / (evil + ".csv");
  const std::string missing = fixture.folder / (evil + " missing");
  const std::string map = out + "/static_map.ply";
  const std::vector<std::vector<std::string>> calls = {
      {"run", seq, "--out", out},
      {"run", seq, "--out", out},
      {"run", seq, "--out", missing, "--map", missing},
      {"check", seq},
      {"eval", seq, out, out, "--map", map, "--map", map, "--csv", table},
      {"eval", seq, missing},
      {evil},
      {"run", seq, "--out", missing, "--tau-s", evil},
  };
  for (const std::vector<std::string>& arguments : calls) {
    const Outcome outcome = start(arguments);
    CAPTURE(arguments, outcome.code, outcome.out, outcome.err);
    for (const std::string* text : {&outcome.out, &outcome.err}) {
      CHECK(text->find('\x1b') == std::string::npos);
      CHECK(text->find("\xC2\x9B") == std::string::npos);
    }
    if (outcome.code != 0) CHECK(count_lines(outcome.err) == 1);
  }
  CHECK_THAT(start({"check", missing}).err, ContainsSubstring("evil\\x1B[31m\\nname\\xC2\\x9B"));
}

TEST_CASE("run writes labels, causes, map, moving points, report and timing, and nothing else") {
  const Fixture fixture;
  const Outcome outcome = succeed(fixture.run());
  CHECK_THAT(outcome.out, ContainsSubstring("12 scans"));
  CHECK(count_entries(fixture.out) == 7);
  CHECK(fixture.labels() == 12);
  CHECK(count_entries(fixture.out + "/causes") == 12);

  std::uint64_t points = 0;
  std::uint64_t moving = 0;
  for (std::size_t i = 0; i < 12; ++i) {
    const auto labels = labels_in(fixture.out, scan_name(i));
    CHECK(labels.size() == tiny_scan(i).size() / 4);
    points += labels.size();
    for (const std::uint32_t label : labels) {
      const std::uint32_t id = label & 0xFFFF;
      CHECK((id == 251 || id == 9 || id == 0));
      if (is_removed(label)) ++moving;
    }
  }
  const nlohmann::json report = fixture.report();
  CHECK(report["program"] == "dynains");
  CHECK(report["command"] == "run");
  CHECK(report["outputs"]["files"] ==
        nlohmann::json({"dynamic_points.ply", "overview.png", "static_map.ply", "timing.csv"}));
  CHECK(report["outputs"]["folders"] ==
        nlohmann::json({{"labels", ".label"}, {"causes", ".cause"}}));
  CHECK(report["outputs"]["scans"].size() == 12);
  CHECK(report["complete"] == true);
  CHECK(report["first_scan"] == "000000");
  CHECK(report["last_scan"] == "000011");
  CHECK(report["scans"] == 12);
  CHECK(report["points"] == points);
  CHECK(report["labels"]["dynamic"] == moving);
  CHECK(moving > 0);
  CHECK(report["preset"] == "default");
  CHECK(report["peak_memory_bytes"] > 1000000);
  for (const char* stage : {"ingest", "ground", "cluster", "map", "total"}) {
    const nlohmann::json& ms = report["milliseconds"][stage];
    CHECK(ms["median"] <= ms["p95"]);
    CHECK(ms["p95"] <= ms["p99"]);
    CHECK(ms["p99"] <= ms["max"]);
  }
  CHECK(report["static_map"]["file"] == "static_map.ply");
  CHECK(read_points(fixture.out + "/static_map.ply").positions.size() ==
        report["static_map"]["points"]);
  CHECK(read_points(fixture.out + "/dynamic_points.ply").positions.size() == moving);

  const std::string page = read_text(std::string(DYNAINS_DOCS) + "/results.md");
  for (const auto& [field, value] : report.items())
    CHECK_THAT(page,
               ContainsSubstring('"' + field + "\": ") || ContainsSubstring('`' + field + '`'));
  for (const auto& entry : fs::directory_iterator(fixture.out)) {
    const std::string name = entry.path().filename().string();
    CHECK_THAT(page, ContainsSubstring("\n" + name + (entry.is_directory() ? "/NAME" : " ")));
  }

  const std::string timing = read_text(fixture.out + "/timing.csv");
  CHECK_THAT(timing, StartsWith("scan,points,ingest_ms,"));
  CHECK(count_lines(timing) == 13);
}

TEST_CASE("Labels, causes and moving points of a run are those of the remover, scan by scan") {
  const Fixture fixture;
  const Eigen::Vector3d place(100.0, 200.0, 300.0);
  write_tiny_sequence(fixture.seq, 12, place);
  const std::string preset = GENERATE("default", "paper");  // scans are read again, or wait
  succeed(fixture.run({"--preset", preset, "--passes", "1", "--write-online", "--start", "1"}));
  std::vector<Eigen::Vector3d> moving;
  const auto check = [&](const ScanVerdict& verdict, const std::string& folder) {
    const std::size_t i = verdict.scan + 1;
    std::vector<std::uint32_t> expected;
    for (std::size_t k = 0; k < verdict.labels.size(); ++k) {
      expected.push_back(run::mos_label(verdict.labels[k], verdict.instances[k]));
      if (folder == "online" || verdict.labels[k] != PointLabel::kDynamic) continue;
      const std::vector<float> scan = tiny_scan(i);
      moving.push_back(place + Eigen::Map<const Eigen::Vector3f>(&scan[4 * k]).cast<double>());
    }
    const std::string file = fixture.out + '/' + folder + '/' + scan_name(i) + ".label";
    CHECK(read_labels(file, expected.size()) == expected);
    if (folder == "online") return;
    std::string causes;
    for (const Cause cause : verdict.causes) causes += static_cast<char>(cause);
    CHECK(read_text(fixture.out + "/causes/" + scan_name(i) + ".cause") == causes);
  };
  DynaInsRemover remover(preset == "paper" ? DynaInsRemover::Config::paper()
                                           : DynaInsRemover::Config());
  const Pose pose(Eigen::Translation3d{place});
  for (std::size_t i = 1; i < 12; ++i) {
    const std::vector<float> scan = tiny_scan(i);
    const RawPoints<float> points{scan.data(), scan.size() / 4, 4};
    const FrameResult frame = remover.push(points, pose, 0.1 * static_cast<double>(i));
    check(frame.newest(), "online");
    if (frame.finished) check(*frame.finished, "labels");
  }
  remover.flush([&](const ScanVerdict& verdict) { check(verdict, "labels"); });
  CHECK_FALSE(fs::exists(fixture.out + "/labels/000000.label"));
  const PointFile written = read_points(fixture.out + "/dynamic_points.ply");
  REQUIRE(written.positions.size() == moving.size());
  CHECK(moving.size() > 100);
  for (std::size_t k = 0; k < moving.size(); ++k) {
    CHECK_FALSE((written.positions[k] - moving[k]).norm() > 1e-4);
  }
  CHECK(written.intensity.front() == 0.5F);
}

TEST_CASE("The flag --objects writes a row of tracks.csv for each object of each scan") {
  const Fixture fixture(40);
  succeed(fixture.run({"--objects", "true", "--lookahead-scans", "5"}));
  const std::string tracks = read_text(fixture.out + "/tracks.csv");
  CHECK_THAT(tracks, StartsWith("scan,time,id,x,y,z,length,width,height,yaw,vx,vy,points,"
                                "first_scan,last_scan\n"));
  CHECK(count_lines(tracks) > 10);
  CHECK(fixture.report()["outputs"]["files"].dump().find("tracks.csv") != std::string::npos);
  succeed(fixture.run({"--force"}));
  CHECK_FALSE(fs::exists(fixture.out + "/tracks.csv"));
}

TEST_CASE("A map of LAS holds classes and attributes of its points") {
  const Fixture fixture;
  const std::string map = fixture.folder / "map.las";
  succeed(fixture.run({"--map-attributes"}));
  const PointFile expected = read_points(fixture.out + "/static_map.ply");
  CHECK(expected.intensity.size() == expected.positions.size());
  CHECK(expected.time.empty());

  succeed(fixture.run({"--map", map, "--force"}));
  CHECK(fixture.report()["static_map"]["points"] == expected.positions.size());
  const PointFile points = read_points(map);
  REQUIRE(points.positions.size() == expected.positions.size());
  for (std::size_t i = 0; i < points.positions.size(); ++i) {
    CHECK((points.positions[i] - expected.positions[i]).cwiseAbs().maxCoeff() < 0.00052);
  }
  CHECK(points.time.size() == points.positions.size());
}

TEST_CASE("Flags --map and --map-voxel") {
  const Fixture fixture;
  const std::string map = fixture.folder / "my map.pcd";
  succeed(fixture.run({"--map", map, "--map-voxel", "0"}));
  CHECK_FALSE(fs::exists(fixture.out + "/static_map.ply"));
  const nlohmann::json report = fixture.report();
  // Without voxels, every kept point is in the map.
  CHECK(read_points(map).positions.size() == report["labels"]["ground"].get<std::size_t>() +
                                                 report["labels"]["static"].get<std::size_t>());

  succeed(fixture.run({"--force", "--map-voxel", "1"}));
  CHECK(read_points(fixture.out + "/static_map.ply").positions.size() <
        read_points(map).positions.size() / 4);

  succeed(fixture.run({"--force", "--build-map", "false"}));
  CHECK_FALSE(fs::exists(fixture.out + "/static_map.ply"));
  CHECK(fixture.report()["static_map"].is_null());
}

TEST_CASE("Preset, config file and flags: the later one has priority") {
  const Fixture fixture;
  const std::string config = fixture.folder / "run.cfg";
  write_text(config, "tau-s = 0.5\nwindow = 5\n");
  succeed(fixture.run({"--preset", "paper", "--config", config, "--window", "6"}));
  const nlohmann::json report = fixture.report();
  CHECK(report["preset"] == "paper");
  CHECK(report["configuration"]["tau_s"] == 0.5);
  CHECK(report["configuration"]["window"] == 6);
  CHECK(report["configuration"]["p_inc"] == 0.7);
}

TEST_CASE("run takes the output of config, for every parameter") {
  const Fixture fixture;
  const std::string preset = GENERATE("default", "paper");
  const Outcome printed = succeed(start({"config", "--preset", preset}));
  const std::string config = fixture.folder / "run.cfg";
  write_text(config, printed.out);
  // The other preset, so that only the file can set the values.
  REQUIRE(
      fixture.run({"--config", config, "--preset", preset == "paper" ? "default" : "paper"}).code ==
      0);
  const std::string help = start({"run", "--help-all"}).out;
  const nlohmann::json configuration = fixture.report()["configuration"];
  std::size_t parameters = 0;
  DynaInsRemover::Config expected =
      preset == "paper" ? DynaInsRemover::Config::paper() : DynaInsRemover::Config();
  DynaInsRemover::Config::visit(expected, [&](const auto& parameter) {
    ++parameters;
    std::string flag = parameter.name;
    std::replace(flag.begin(), flag.end(), '_', '-');
    CAPTURE(flag);
    CHECK(configuration.at(parameter.name) == plain_value(parameter.value));
    CHECK_THAT(help, ContainsSubstring("--" + flag + " "));
    CHECK_THAT(printed.out, ContainsSubstring("\n" + flag + " = "));
  });
  CHECK(configuration.size() == parameters);
}

TEST_CASE("A map in another folder is replaced with the results that name it, and no other map") {
  const Fixture fixture;
  const std::string map = fixture.folder / "maps/of all.ply";
  write_text(map, "of another run");
  const auto check_map_exists = [&](const Outcome& refused) {
    check_refused(refused, 1, map + ": exists");
    CHECK(count_entries(fixture.folder / "maps") == 1);
  };
  check_map_exists(fixture.run({"--map", map}));
  check_map_exists(fixture.run({"--map", map, "--force"}));
  CHECK(read_text(map) == "of another run");
  CHECK_FALSE(fs::exists(fixture.out));
  succeed(fixture.run());
  check_map_exists(fixture.run({"--map", map, "--force"}));
  CHECK(read_text(map) == "of another run");

  fs::remove(map);
  succeed(fixture.run({"--map", map, "--force"}));
  check_map_exists(
      start({"run", fixture.seq, "--out", fixture.out + "2", "--map", map, "--force"}));
  succeed(fixture.run({"--map", map, "--force", "--end", "4"}));
  CHECK(read_points(map).positions.size() == fixture.report()["static_map"]["points"]);
  CHECK(count_entries(fixture.folder / "maps") == 1);

  const std::string among_scans = fixture.seq + "/velodyne/000003.ply";
  check_refused(fixture.run({"--map", among_scans, "--force"}), 1, "is read by this command");
  CHECK_FALSE(fs::exists(among_scans));
}

TEST_CASE("Different spellings of a path name one place") {
  const Fixture fixture;
  struct Here {
    explicit Here(const fs::path& folder) : before(fs::current_path()) { fs::current_path(folder); }
    ~Here() { fs::current_path(before); }
    fs::path before;
  };
  const Here here(fixture.folder.path());
  for (const Arguments& flags : {Arguments{"--out", "trailing/"},
                                 {"--out", "beside", "--map", "map.ply"},
                                 {"--out", "within", "--map", fixture.folder / "within/own.ply"}}) {
    CAPTURE(flags);
    const Arguments arguments = Arguments{"run", "a seq", "--quiet"} + flags;
    succeed(start(arguments));
    succeed(start(arguments + Arguments{"--force"}));
  }
  const auto map_of = [](const fs::path& out) { return report_in(out)["static_map"]["file"]; };
  CHECK(map_of("trailing") == "static_map.ply");
  CHECK(map_of("within") == "own.ply");
  CHECK(map_of("beside") == (fs::current_path() / "map.ply").string());

  const Here among_scans(fixture.seq + "/velodyne");
  check_refused(start({"run", "..", "--out", "../../other", "--map", "map.ply"}), 1,
                "is read by this command");
  CHECK_FALSE(fs::exists("map.ply"));
}

TEST_CASE("Scans without a pose are left out with a warning, and counted in the report") {
  const Fixture fixture;
  std::string poses;
  std::string times;
  for (int i = 0; i < 12; ++i) times += std::to_string(100.0 + 0.1 * i) + '\n';
  for (int i = 0; i < 7; ++i) poses += std::to_string(100.0 + 0.1 * i) + " 0 0 0 0 0 0 1\n";
  write_text(fixture.seq + "/times.txt", times);
  write_text(fixture.seq + "/poses.txt", poses);
  check_warns(fixture.run(), "warning: 5 of 12 scans have no pose and are left out");
  CHECK(fixture.report()["scans"] == 7);
  CHECK(fixture.report()["scans_without_pose"] == 5);
}

TEST_CASE("Wrong flags: exit code 2, one line, nothing written") {
  const Fixture fixture;
  const std::string config = fixture.folder / "run.cfg";
  write_text(config, "window = 4\n# more\ntau-x = 1\n");
  struct Case {
    std::vector<std::string> flags;
    std::string expected;
  };
  const std::vector<Case> cases = {
      {{"--tau-s", "7"}, "--tau-s = 7: expected FLOAT in [0, 1]"},
      {{"--votes", "9", "--window", "4"}, "votes = 9 must be at most window = 4"},
      {{"--tau-x", "1"}, "not known here: --tau-x 1 "},
      {{"--config", config}, "run.cfg:3: tau-x: unknown parameter, see dynains config"},
      {{"--preset", "best"}, "best not in"},
      {{"--start", "12"}, "--start and --end leave no scan of 000000 to 000011"},
      {{"--start", "5", "--end", "4"}, "--start and --end leave no scan"},
      {{"--start", "-1"}, "--start: expected the number of a scan, found -1"},
      {{"--end", "-1"}, "--end: expected the number of a scan, found -1"},
      {{"--map", "a.ply", "--build-map", "false"}, "--map needs --build-map true"},
      {{"--map", fixture.out + "/dynamic_points.ply"}, "the moving points go there"},
      {{"--map", fixture.out + "/clean/a.ply"}, "other results go into that folder"},
      {{"--map", fixture.folder / "map.laz"}, "ends in .ply, .pcd or .las"},
      {{"--map-attributes", "--build-map", "false"}, "--map-attributes needs --build-map true"},
      {{"--crs", "EPSG:25832"}, "--crs needs --map FILE.las"},
      {{"--map", fixture.folder / "map.las", "--crs", "EPSG:25832"}, "projinfo"},
  };
  for (const Case& wrong : cases) {
    check_one_error(fixture.run(wrong.flags), 2, wrong.expected);
    CHECK_FALSE(fs::exists(fixture.out));
  }
}

TEST_CASE("Broken input: exit code 1, one line, earlier results as they were") {
  const Fixture fixture;
  succeed(fixture.run());
  const std::string before = read_text(fixture.out + "/report.json");
  const std::string right = fixture.folder / "right";
  fs::rename(fixture.seq, right);
  std::string far_away;
  for (int i = 0; i < 12; ++i) far_away += pose_row(i == 5 ? 3e7 : 0.0);
  struct Case {
    std::string file;                 // of the sequence
    std::optional<std::string> text;  // none: the file is removed
    std::string expected;
    Arguments flags = {};
  };
  const std::vector<Case> cases = {
      {"velodyne/000011.bin", std::string(33, '\0'), "000011.bin: truncated at byte 33"},
      {"poses.txt", {}, "poses.txt: not found"},
      {"poses.txt", far_away, "scan 000005: T_world_sensor has a translation of"},
      {"velodyne", {}, "a seq: has no scans"},
      {"no", {}, "/no/such.cfg: cannot be read: No such", {"--config", "/no/such.cfg"}},
      {"no", {}, "/no/such: cannot be opened: No such", {"--map", "/no/such/map.ply"}},
  };
  for (const Case& broken : cases) {
    CAPTURE(broken.expected);
    fs::remove_all(fixture.seq);
    fs::copy(right, fixture.seq, fs::copy_options::recursive);
    const std::string file = fixture.seq + '/' + broken.file;
    if (broken.text) {
      write_text(file, *broken.text);
    } else {
      fs::remove_all(file);
    }
    check_one_error(fixture.run(broken.flags + Arguments{"--force"}), 1, broken.expected);
    CHECK(read_text(fixture.out + "/report.json") == before);
    CHECK(fixture.labels() == 12);
  }
}

TEST_CASE("One odd scan does not decide how much memory a run takes") {
  const TemporaryFolder folder;
  const std::filesystem::path scans = folder / "scans";
  constexpr int kPoints = 1000000;
  const std::string head =
      "VERSION .7\nFIELDS x y z\nSIZE 1 1 1\nTYPE I I I\nCOUNT 1 1 1\nHEIGHT 1\n";
  const auto size_lines = [](int points) {
    return "WIDTH " + std::to_string(points) + "\nPOINTS " + std::to_string(points) + "\n";
  };
  // LZF: a literal byte 5, then copies of 264 bytes from distance 1. 34 KB encode all points.
  std::string lzf("\0\5", 2);
  int made = 1;
  for (; made + 264 <= 3 * kPoints; made += 264) lzf += std::string("\xE0\xFF\0", 3);
  for (; made < 3 * kPoints; ++made) lzf += std::string("\0\5", 2);
  const std::string sizes = packed(static_cast<std::uint32_t>(lzf.size()), 3U * kPoints);
  write_text(scans / "000000.pcd",
             head + size_lines(kPoints) + "DATA binary_compressed\n" + sizes + lzf);
  std::string poses;
  for (int i = 0; i < 40; ++i) {
    poses += pose_row();
    if (i == 0) continue;
    std::string usual = head + size_lines(3000) + "DATA ascii\n";
    for (int k = 0; k < 3000; ++k) {
      usual += std::to_string(5 + k % 100) + ' ' + std::to_string(k / 100) + " -1\n";
    }
    write_text(scans / (scan_name(static_cast<std::size_t>(i)) + ".pcd"), usual);
  }
  write_text(scans / "poses.txt", poses);
  succeed(start({"run", scans, "--out", folder / "out", "-q"}));
  // The open scan, its file in memory, and the memory for its verdict: 300 bytes per point.
  CHECK(report_in(folder / "out")["peak_memory_bytes"] < 100'000'000U + 300U * kPoints);
}

TEST_CASE("Maps far from the origin lose nothing") {
  const Fixture near;
  const Fixture far;
  const Eigen::Vector3d utm(691234.5, 5334567.25, 512.0);
  write_tiny_sequence(far.seq, 12, utm);
  succeed(near.run({"--map-voxel", "0"}));
  succeed(far.run({"--map-voxel", "0"}));
  CHECK_THAT(read_text(near.out + "/static_map.ply").substr(0, 200),
             ContainsSubstring("property float x"));
  CHECK_THAT(read_text(far.out + "/static_map.ply").substr(0, 200),
             ContainsSubstring("property double x"));
  for (const char* file : {"/static_map.ply", "/dynamic_points.ply"}) {
    const std::vector<Eigen::Vector3d> a = read_points(near.out + file).positions;
    const std::vector<Eigen::Vector3d> b = read_points(far.out + file).positions;
    REQUIRE(a.size() == b.size());
    REQUIRE(!a.empty());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < a.size(); ++i) sum += b[i] - utm - a[i];
    CHECK((sum / static_cast<double>(a.size())).norm() < 1e-5);
  }
}

TEST_CASE("Ctrl-C: run finishes the current scan, keeps the results so far, exits with code 130") {
  Fixture fixture(400);
  Process process({"run", fixture.seq, "--out", fixture.out});
  fixture.await_first_scan();
  ::kill(process.id(), SIGINT);
  const Outcome outcome = process.wait();
  CAPTURE(outcome.err);
  CHECK(outcome.code == 130);
  CHECK_FALSE(fs::exists(fixture.out));
  fixture.out += ".partial";
  const nlohmann::json report = fixture.report();
  CHECK(report["complete"] == false);
  const std::size_t scans = report["scans"];
  CHECK(scans > 0);
  CHECK(scans < 400);
  CHECK(fixture.labels() == scans);
  CHECK(report["last_scan"] == scan_name(scans - 1));
  CHECK(count_lines(read_text(fixture.out + "/timing.csv")) == scans + 1);
  CHECK(read_points(fixture.out + "/static_map.ply").positions.size() ==
        report["static_map"]["points"]);
  CHECK(count_entries(fixture.out) == 7);
}

TEST_CASE("Ctrl-C during the checks of a run leaves what it leaves during the scans") {
  Fixture fixture(400);
  const std::string map = fixture.folder / "map.ply";
  Process process({"run", fixture.seq, "--out", fixture.out, "--map", map});
  fixture.await("report.json");
  ::kill(process.id(), SIGINT);
  const Outcome outcome = process.wait();
  CHECK(outcome.code == 130);
  CHECK_THAT(outcome.err, ContainsSubstring("interrupted; the results of"));
  CHECK_FALSE(fs::exists(fixture.out));
  CHECK_FALSE(fs::exists(map + ".partial"));
  fixture.out += ".partial";
  CHECK(fixture.report()["complete"] == false);
}

TEST_CASE("A signal that is ignored at the start does not end a run") {
  const Fixture fixture(40);
  const int signal = GENERATE(SIGINT, SIGTERM);
  Process process({"run", fixture.seq, "--out", fixture.out},
                  [signal] { std::signal(signal, SIG_IGN); });
  fixture.await_first_scan();
  ::kill(process.id(), signal);
  CHECK(process.wait().code == 0);
  CHECK(fixture.report()["complete"] == true);
}

TEST_CASE("Closed standard streams change no result") {
  const Fixture fixture;
  succeed(fixture.run());
  const std::string expected = fixture.folder / "expected";
  fs::rename(fixture.out, expected);
  for (const std::vector<int>& closed : {std::vector<int>{0}, {1, 2}, {0, 1, 2}}) {
    CAPTURE(closed);
    const Outcome outcome = start({"run", fixture.seq, "--out", fixture.out}, [&] {
      for (const int stream : closed) ::close(stream);
    });
    CHECK(outcome.code == 0);
    for (const char* file : {"/static_map.ply", "/dynamic_points.ply", "/labels/000005.label"}) {
      CHECK(read_text(fixture.out + file) == read_text(expected + file));
    }
    fs::remove_all(fixture.out);
  }
}

TEST_CASE("run writes cleaned scans of KITTI") {
  const Fixture fixture;
  succeed(fixture.run({"-q", "--write-clean"}));
  std::size_t removed = 0;
  for (std::size_t i = 0; i < 12; ++i) {
    std::vector<float> all, kept, expected;
    read_scan(fixture.scan_file(i), all);
    read_scan(fixture.out + "/clean/" + scan_name(i) + ".bin", kept);
    const std::vector<std::uint32_t> labels = labels_in(fixture.out, scan_name(i));
    REQUIRE(labels.size() == all.size() / 4);
    for (std::size_t k = 0; k < labels.size(); ++k) {
      if (is_removed(labels[k])) {
        ++removed;
      } else {
        expected.insert(expected.end(), all.data() + 4 * k, all.data() + 4 * k + 4);
      }
    }
    CHECK(kept == expected);
  }
  CHECK(removed > 0);
}

TEST_CASE("Progress is a redrawn line on a terminal, lines in a file, nothing with --quiet") {
  const Fixture fixture;
  const std::vector<std::string> arguments = {"run", fixture.seq, "--out", fixture.out, "--force"};
  const std::string shown = show_on_terminal(arguments);
  CAPTURE(shown);
  const std::string full = "\r12 of 12 scans (";
  const std::size_t end = shown.find(full);
  REQUIRE(end != std::string::npos);
  CHECK(end == shown.rfind(full));
  // All redraws are on one line, which ends before the next output.
  const std::size_t line_end = shown.find('\n', shown.find("\r1 of 12"));
  CHECK(shown.find("scans/s)", end) < line_end);
  CHECK(shown.rfind('\r', line_end - 2) == end);

  // Twelve scans are more than one pass compares with this lookback and lookahead.
  const Outcome redirected =
      fixture.run({"--force", "--passes", "2", "--lookback-scans", "4", "--lookahead-scans", "4"});
  CHECK_THAT(redirected.err, ContainsSubstring("\n12 of 12 scans (") &&
                                 Catch::Matchers::EndsWith(" revised scans/s)\n"));
  CHECK(redirected.err.find('\r') == std::string::npos);
  CHECK(count_lines(redirected.err) <= 20);  // of both passes
  const Outcome quiet = fixture.run({"--quiet", "--force"});
  CHECK(quiet.code == 0);
  CHECK(quiet.out.empty());
  CHECK(quiet.err.empty());
}

TEST_CASE("a run without ground truth leaves a picture, also without a map") {
  const Fixture fixture;
  succeed(fixture.run({"--build-map", "false"}));
  const std::string png = read_text(fixture.out + "/overview.png");
  CHECK(png.substr(1, 3) == "PNG");
  // The sensor stands: three panels of 100 m at 8 pixels per m, below each other, each with a title
  // of 22 pixels, and a scale bar below.
  const auto side = [&](std::size_t byte) {
    return 256 * static_cast<unsigned char>(png[byte + 2]) +
           static_cast<unsigned char>(png[byte + 3]);
  };
  CHECK(side(16) == 800);
  CHECK(side(20) == 3 * (800 + 22) + 2 * 8 + 22);
}

TEST_CASE("Coordinates in millimetres are refused before any output, and read by --point-units") {
  const Fixture fixture;
  succeed(fixture.run());
  const std::string label = fixture.out + "/labels/" + scan_name(5) + ".label";
  const std::string before = read_text(label);
  const auto counts = fixture.report()["labels"];
  for (std::size_t i = 0; i < 12; ++i) {
    std::vector<float> scan = tiny_scan(i);
    for (std::size_t k = 0; k < scan.size(); ++k) scan[k] *= k % 4 == 3 ? 1.0F : 1000.0F;
    write_scan(fixture.scan_file(i), scan);
  }
  const Outcome refused = fixture.run({"--force"});
  CHECK(refused.code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("0.0 % of the points can be judged") &&
                              ContainsSubstring("--point-units mm"));
  CHECK(read_text(label) == before);
  CHECK(fixture.report()["complete"] == true);
  CHECK(start({"run", fixture.seq, "--out", fixture.out + "2"}).code == 2);
  CHECK_FALSE(fs::exists(fixture.out + "2/labels"));
  CHECK_THAT(start({"check", fixture.seq}).out, ContainsSubstring("--point-units mm"));

  succeed(fixture.run({"--force", "--point-units", "mm"}));
  for (const char* name : {"ground", "static", "dynamic"}) {
    CAPTURE(name);
    CHECK(fixture.report()["labels"][name].get<double>() ==
          Approx(counts[name].get<double>()).epsilon(0.01));
  }
  // The map of remap is in metres, too: the flag comes from the report of the run.
  succeed(start({"remap", fixture.seq, fixture.out, "--poses", fixture.seq + "/poses.txt"}));
  for (const Eigen::Vector3d& p : read_points(fixture.out + "/static_map_remapped.ply").positions) {
    REQUIRE(p.norm() < 100.0);
  }
}

TEST_CASE("A run that judges nothing is no success, and keeps earlier results") {
  const Fixture fixture;
  succeed(fixture.run());
  const std::string label = fixture.out + "/labels/" + scan_name(5) + ".label";
  const std::string before = read_text(label);
  std::vector<float> nothing(4000, 0.0F);
  for (std::size_t i = 0; i < 12; ++i) write_scan(fixture.scan_file(i), nothing);
  for (const char* build_map : {"true", "false"}) {
    check_refused(fixture.run({"--force", "--build-map", build_map}), 1,
                  fixture.seq +
                      ": the map is empty: of 12000 points, 0 are static, "
                      "0 moving, 0 out of range and 12000 invalid");
    CHECK(read_text(label) == before);
  }
  CHECK(start({"run", fixture.seq, "--out", fixture.out + "2"}).code == 1);
  CHECK_FALSE(fs::exists(fixture.out + "2"));
  CHECK_FALSE(fs::exists(fixture.out + "2.partial"));
}
