#include <nlohmann/json.hpp>

#include "dynains/io/recording.hpp"
#include "program/start.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

Outcome simulate(const std::string& out, const Arguments& more = {}) {
  return start(Arguments{"simulate", out, "--sensor", "vlp16"} + more);
}

}  // namespace

TEST_CASE("simulate makes a sequence for run and eval, with equal bytes for equal seeds") {
  TemporaryFolder folder;
  const std::string a = folder / "a";
  const std::string b = folder / "b";
  succeed(simulate(a, {"--scans", "6", "--seed", "3"}));
  REQUIRE(simulate(b, {"--scans", "6", "--seed", "3", "--quiet"}).out.empty());
  const Recording recording(a);
  CHECK(recording.size() == 6);
  CHECK(recording.read_labels(5).size() * 4 == recording.read_scan(5).xyzi.size());
  for (const char* file : {"/velodyne/000005.bin", "/labels/000005.label", "/poses.txt",
                           "/times.txt", "/simulation.json"}) {
    CHECK(read_text(a + file) == read_text(b + file));
  }
  CHECK(nlohmann::json::parse(read_text(a + "/simulation.json"))["seed"] == 3);

  const std::string out = folder / "out";
  for (const char* preset : {"paper", "default"}) {
    succeed(start({"run", a, "--out", out, "--preset", preset, "--force"}));
    const Outcome judged =
        succeed(start({"eval", a, out, "--errors", "--json", folder / "eval.json", "--force"}));
    CHECK_THAT(judged.out, ContainsSubstring("identity") && ContainsSubstring("oracle") &&
                               ContainsSubstring("called ground"));
    // The causes account for every error and every right verdict.
    const auto json = nlohmann::json::parse(read_text(folder / "eval.json"));
    const auto& score = json["rows"][2]["points"];
    std::int64_t missed = 0, lost = 0, right = 0;
    for (const auto& cause : json["errors"]["by_cause"]) {
      missed += cause["missed_dynamic"].get<std::int64_t>();
      lost += cause["lost_static"].get<std::int64_t>();
      right += cause["right"].get<std::int64_t>();
      const std::string name = cause["cause"];
      if (name == "unknown" || name == "presumed") {
        CHECK(cause["right"] == 0);
      }
    }
    CHECK(missed == score["dynamic_total"].get<std::int64_t>() -
                        score["dynamic_removed"].get<std::int64_t>());
    CHECK(lost ==
          score["static_total"].get<std::int64_t>() - score["static_kept"].get<std::int64_t>());
    CHECK(right ==
          score["static_kept"].get<std::int64_t>() + score["dynamic_removed"].get<std::int64_t>());
    CHECK(right > 1000);
  }

  // An output never replaces an input.
  for (const std::string& input : {a + "/labels/000001.label", a + "/velodyne/000001.bin",
                                   a + "/poses.txt", out + "/causes/000001.cause"}) {
    const std::string before = read_text(input);
    check_refused(start({"eval", a, out, "--json", input}), 1, input + ": is read by this command");
    CHECK(read_text(input) == before);
  }

  // Labels that do not fit the scan.
  write_text(a + "/labels/000002.label", "1234");
  check_one_error(start({"eval", a, out}), 1, "000002.label: has 4 bytes, expected");
}

TEST_CASE("simulate refuses unknown values") {
  TemporaryFolder folder;
  const std::string out = folder / "sim";
  CHECK_THAT(simulate(out, {"--scene", "moon"}).err,
             ContainsSubstring("--scene = moon: expected urban|"));
  check_refused(simulate(out, {"--scans", "0"}), 2, "--scans = 0: expected INT");
  CHECK_FALSE(fs::exists(out));
  const Outcome without = start({"simulate"});
  CHECK(without.code == 2);
  CHECK(without.err == "dynains_simulate: error: OUT is required (see dynains_simulate --help)\n");
}
