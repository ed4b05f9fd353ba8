// The rule of outputs, for each command that writes a file of a name that the user gives.

#include "program/start.hpp"
#include "reliability/tree.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

/// A labelled recording, the results of a run over it, and a map of another program.
struct Given {
  Given() {
    succeed(start({"simulate", seq, "--scans", "9", "--sensor", "vlp16", "-q"}));
    succeed(start({"run", seq, "--out", out, "-q"}));
    fs::copy_file(out + "/static_map.ply", map);
    write_text(pose, "0 0 0 0 0 0 1\n");
  }
  std::string at(const std::string& name) const { return folder / name; }

  /// A command without the name of its output, which comes last.
  struct Command {
    Arguments words;
    std::string extension = ".txt";
    std::vector<std::string> read;  ///< that no flag may name
  };
  std::vector<Command> commands() const {
    const std::vector<std::string> of_recording = {
        seq + "/velodyne/000002.bin", seq + "/labels/000002.label", seq + "/poses.txt",
        seq + "/times.txt",           seq + "/calib.txt",           seq + "/simulation.json"};
    std::vector<std::string> of_run = of_recording;
    for (const char* const file : {"/report.json", "/timing.csv", "/labels/000002.label"}) {
      of_run.push_back(out + file);
    }
    of_run.push_back(map);
    std::vector<std::string> with_pose = of_recording;
    with_pose.push_back(pose);
    const Arguments eval = {"eval", seq, out, "--map", map};
    const Arguments remap = {"remap", seq, out, "--extrinsic", pose, "-q"};
    const Arguments clean = {"clean", map, out, seq, "--extrinsic", pose, "-q"};
    return {{eval + Arguments{"--json"}, ".txt", of_run},
            {eval + Arguments{"--csv"}, ".txt", of_run},
            {{"check", seq, "--extrinsic", pose, "--sensor-origin", pose, "--closures"},
             ".txt",
             with_pose},
            {{"odometry", seq, "--one-thread", "-q", "--out"}, ".txt", of_recording},
            {remap + Arguments{"--map"}, ".ply", {pose}},
            {clean + Arguments{"--map"}, ".ply", {pose, map}}};
  }

  TemporaryFolder folder;
  std::string seq = at("seq"), out = at("out"), map = at("map.ply"), pose = at("pose.ply");
};

}  // namespace

TEST_CASE("No command replaces a file unasked, and none ever one that it was given") {
  const Given given;
  const auto before = read_tree(given.folder.path());
  for (const Given::Command& command : given.commands()) {
    const std::string mine = given.at("notes" + command.extension);
    write_text(mine, "mine");
    CAPTURE(command.words);
    CHECK_THAT(start(command.words + Arguments{mine}).err, ContainsSubstring(mine + ": exists"));
    CHECK(read_text(mine) == "mine");
    for (const std::string& file : command.read) {
      check_refused(start(command.words + Arguments{file, "--force"}), 1, file + ": is ");
    }
    start(command.words + Arguments{mine, "--force"});
    CHECK(read_text(mine) != "mine");
    fs::remove(mine);
  }
  CHECK(read_tree(given.folder.path()) == before);
}

TEST_CASE("A file among scans would be a scan, and is refused as an output") {
  const Given given;
  const std::string flat = given.at("flat");
  fs::create_directory(flat);
  fs::copy(given.seq + "/velodyne", flat);
  fs::copy_file(given.seq + "/poses.txt", flat + "/poses.txt");
  const auto check = [&](const std::string& name) {
    return start({"check", flat, "--closures", flat + name});
  };
  check_refused(check("/closures.csv"), 1, "/closures.csv: would be a part of " + flat);
  check("/closures.g2o");
  CHECK(fs::exists(flat + "/closures.g2o"));
}
