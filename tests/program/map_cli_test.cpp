// `dynains run --update` and `dynains map`: a map of many sessions from the command line.
#include <csignal>
#include <thread>

#include "dynains/city/city.hpp"
#include "dynains/io/point_file.hpp"
#include "program/start.hpp"
#include "program/tiny_sequence.hpp"
#include "reliability/tree.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

constexpr std::size_t kDayScans = 12;

/// Three small recordings at different places, and runs over them.
class Days {
 public:
  Days() {
    for (int day = 0; day < 3; ++day) {
      write_tiny_sequence(folder_ / name(day), kDayScans, {3.0 * day, 0.5 * day, 0.0});
    }
  }

  static std::string name(int day) { return "day" + std::to_string(day); }
  std::string at(const std::string& file) const { return folder_ / file; }

  Outcome update(int day, const std::string& city, const std::string& out,
                 const Arguments& more = {}) const {
    return start(Arguments{"run", at(name(day)), "--out", at(out), "--update", at(city),
                           "--accept-poses", "-q", "--session-begin", std::to_string(day)} +
                 more);
  }
  std::string exported(const std::string& city, const std::string& file) const {
    succeed(start({"map", at(city), "export", at(file)}));
    return read_text(at(file));
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace

TEST_CASE("map: what a map holds of each session, and without one that was dropped") {
  const Days days;
  for (const int day : {2, 1}) {
    succeed(days.update(day, "city", "out" + std::to_string(day)));
    if (day == 2) CHECK(days.exported("city", "before.ply").size() > 10000);
  }
  CHECK(days.exported("city", "both.ply") != read_text(days.at("before.ply")));
  succeed(start({"map", days.at("city"), "at", "day1", days.at("day1.pcd")}));
  const PointFile first = read_points(days.at("day1.pcd"));
  CHECK(first.positions.size() > 100);
  CHECK(first.time == std::vector<double>(first.positions.size(), 1.0));
  succeed(start({"map", days.at("city"), "drop", "day1"}));
  CHECK(days.exported("city", "dropped.ply") == read_text(days.at("before.ply")));
  succeed(start({"map", days.at("city"), "check"}));
  const Outcome list = start({"map", days.at("city"), "list"});
  CHECK_THAT(list.out, ContainsSubstring("day2") && !ContainsSubstring("day1"));
}

TEST_CASE("map: diff writes points, and replaces nothing unasked") {
  const Days days;
  for (const int day : {0, 1}) {
    succeed(days.update(day, "city", "out" + std::to_string(day)));
  }
  fs::create_directory(days.at("changes"));
  const auto diff = [&](const Arguments& more) {
    std::vector<std::string> arguments = {
        "map", days.at("city"), "diff", "day0", "day1", "--added", days.at("changes/added.ply")};
    if (more.empty() || more[0] != "--removed") {
      arguments.insert(arguments.end(), {"--removed", days.at("changes/removed.ply")});
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return start(arguments);
  };
  // Bad input, and nothing is written.
  const auto is_refused = [&](std::vector<std::string> more, const std::string& reason,
                              int code = 2) {
    check_refused(diff(std::move(more)), code, reason);
    CHECK(read_tree(days.at("changes")).empty());
  };
  is_refused({"--removed", days.at("city/changes.ply")}, "changes.ply: is read by", 1);
  is_refused({"--removed", days.at("changes/changes.jpg")}, "expected a name that ends in .ply");
  is_refused({"--removed", days.at("changes/added.ply")}, "--removed");

  CHECK(diff({}).code == 0);
  const auto content = read_tree(days.at("changes"));
  CHECK(content.size() == 2);
  CHECK(diff({}).code == 1);
  CHECK(diff({"--force"}).code == 0);
  CHECK(read_tree(days.at("changes")) == content);
}

TEST_CASE("map: a session twice, another voxel edge and bad names are refused, and all stays") {
  const Days days;
  succeed(days.update(0, "city", "out"));
  const auto before = read_tree(days.at("city"));
  const auto is_refused = [&](const Outcome& outcome, const std::string& reason, int code = 2) {
    check_refused(outcome, code, reason);
    CHECK(read_tree(days.at("city")) == before);
  };
  is_refused(days.update(0, "city", "out2"), "a session is added once");
  CHECK_FALSE(fs::exists(days.at("out2")));
  is_refused(days.update(0, "city", "out2", {"--session", "again"}),
             "the same scans, poses and times");
  is_refused(days.update(1, "city", "out2", {"--map-voxel", "0.4"}), "map_voxel = 0.2 m");
  is_refused(days.update(1, "city", "out2", {"--session", "a/b"}), "cannot name a session");
  is_refused(days.update(1, "city", "city/out2"), "outside of it");
  is_refused(start({"map", days.at("city"), "at", "day7", days.at("x.ply")}),
             "no session \"day7\"");
  is_refused(start({"map", days.at("city"), "export", days.at("city/x.ply")}),
             "city/x.ply: is read by this command", 1);
  is_refused(start({"run", days.at("day1"), "--out", days.at("out3"), "--session", "x"}),
             "--session needs --update");
  // The same run again adds no second session.
  CHECK(days.update(0, "city", "out", {"--force"}).code == 0);
  CHECK(read_tree(days.at("city")) == before);
  // Removed points come back with the same bytes.
  CHECK(start({"map", days.at("city"), "drop", "day0"}).code == 0);
  CHECK(days.update(0, "city", "out", {"--force"}).code == 0);
  CHECK(read_tree(days.at("city")) == before);
}

TEST_CASE("map: a copy of a session and an empty one are told, and drop repairs") {
  const Days days;
  succeed(days.update(0, "city", "out"));
  const std::string city = days.at("city");
  const auto before = read_tree(city);
  fs::copy_file(city + "/day0.session", city + "/z.session");
  check_says(start({"map", city, "check"}), 1,
             "z.session: is a session of the same scans, poses and times as day0");
  write_text(city + "/e.session", "");
  const Outcome damaged = start({"map", city, "check"});
  CHECK(damaged.code == 1);
  CHECK_THAT(damaged.out, ContainsSubstring("e.session: ") && ContainsSubstring("2 defects"));
  check_refused(start({"map", city, "export", days.at("x.ply")}), 1, "e.session: ");
  succeed(start({"map", city, "drop", "z"}));
  succeed(start({"map", city, "drop", "e"}));
  succeed(start({"map", city, "check"}));
  CHECK(read_tree(city) == before);
}

TEST_CASE("map: remap --update moves one session to corrected poses, as if it had been added so") {
  const Days days;
  succeed(days.update(0, "city", "out0"));
  succeed(days.update(1, "city", "out1"));
  const auto before = read_tree(days.at("city"));
  const auto remap = [&](const std::string& poses, const std::string& city,
                         const Arguments& more = {}) {
    return start(Arguments{"remap", days.at("day1"), days.at("out1"), "--poses", days.at(poses),
                           "--update", days.at(city), "-q"} +
                 more);
  };
  // The poses of the run give the files of the run.
  succeed(remap("day1/poses.txt", "city"));
  CHECK(read_tree(days.at("city")) == before);

  // Whole numbers of metres change no verdict, so that a run over the corrected poses is
  // comparable.
  const std::vector<Pose> poses(kDayScans, Pose(Eigen::Translation3d(64.0, -32.0, 2.0)));
  write_poses(days.at("corrected.txt"), poses);
  succeed(remap("corrected.txt", "city"));
  succeed(days.update(0, "expected", "out2"));
  succeed(days.update(1, "expected", "out3", {"--poses", days.at("corrected.txt")}));
  CHECK(read_tree(days.at("city")) == read_tree(days.at("expected")));
  CHECK(read_tree(days.at("city")) != before);
  CHECK(read_text(days.at("city/day0.session")) == read_text(days.at("expected/day0.session")));
  CHECK(start({"map", days.at("city"), "check"}).code == 0);

  const auto after = read_tree(days.at("city"));
  CHECK(remap("corrected.txt", "city", {"--session", "day7"}).code == 2);
  CHECK(read_tree(days.at("city")) == after);
}

TEST_CASE("map: a session of a slightly different frame is aligned, or refused before anything") {
  const TemporaryFolder folder;
  const auto at = [&](const std::string& name) { return (folder / name).string(); };
  for (const std::string day : {"1", "2"}) {
    succeed(start({"simulate", at("day" + day), "--scene", "urban", "--sensor", "vlp16", "--scans",
                   "90", "--seed", "22", "--day", day, "-q"}));
  }
  const auto update = [&](const std::string& day, const Arguments& more) {
    return Arguments{"run", at(day), "--out", at("out-" + day), "--update", at("city")} + more;
  };
  const auto is_refused = [&](const std::vector<std::string>& arguments, const std::string& why) {
    check_refused(start(arguments), 2, why);
    CHECK_FALSE(fs::exists(at("out-day2/labels")));
  };
  is_refused(update("day2", {"--align"}), "no map to align with");
  CHECK_FALSE(fs::exists(at("city")));
  is_refused(update("day2", {"--align-start", "0 0 0 0 0 0 1"}), "--align-start needs --align");
  succeed(start(update("day1", {"-q"})));
  const auto before = read_tree(at("city"));
  is_refused(update("day2", {"--align", "--align-start", "9 1 0 0 0 0 1"}), "cannot be aligned");
  CHECK(read_tree(at("city")) == before);

  // 1.5 m from the truth, which is the identity.
  const std::vector<std::string> align = {"--align", "--align-start", "1.2 -0.9 0.1 0 0 0 1"};
  {
    Process process(update("day2", align));
    for (int i = 0; i < 3000 && !fs::exists(at("out-day2.partial/labels/000000.label")); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ::kill(process.id(), SIGKILL);
    CHECK(process.wait().code == 128 + SIGKILL);
    const Outcome list = start({"map", at("city"), "list"});
    CHECK_THAT(list.out, ContainsSubstring("day1") && !ContainsSubstring("day2"));
    CHECK_FALSE(fs::exists(at("out-day2")));
  }
  const Outcome aligned = succeed(start(update("day2", align)));
  CHECK_THAT(aligned.out, ContainsSubstring("aligned with 1 session: moved by"));
  const std::optional<SessionAlignment> found = City(at("city")).sessions().at(1).alignment;
  REQUIRE(found);
  for (int i = 0; i < 12; ++i) {
    const double error = found->T_city_session(i / 4, i % 4) - (i % 5 == 0 ? 1.0 : 0.0);
    CHECK(std::abs(error) < (i % 4 == 3 ? 0.05 : 1e-3));
  }
  CHECK(found->sessions == std::vector<std::string>{"day1"});
  CHECK(start({"map", at("city"), "check"}).code == 0);
  const Outcome again = start(update("day2", {"--force", align[0], align[1], align[2]}));
  CHECK(again.code == 0);
  CHECK(again.out.find("aligned") == std::string::npos);
}
