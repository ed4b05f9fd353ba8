// `dynains run --passes 2` as a user starts it.
#include "program/run_folder.hpp"
#include "reliability/tree.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

/// Parked cars leave and come in this recording.
struct CarPark {
  CarPark() {
    succeed(start({"simulate", seq, "--scene", "car-park", "--sensor", "vlp16", "--scans", "180",
                   "--rate", "5", "--seed", "7"}));
  }
  Outcome run(const std::string& out, const Arguments& more) const {
    // The nearest range of the presets, whatever body is found.
    return start(Arguments{"run", seq, "--out", folder / out, "--min-range", "2.7"} + more);
  }
  fs::path path(const std::string& name) const { return folder / name; }

  TemporaryFolder folder;
  std::string seq = folder / "seq";
};

/// Results without times.
Tree timeless(const fs::path& folder) {
  Tree results = read_tree(folder);
  results.erase("report.json");
  results.erase("timing.csv");
  return results;
}

}  // namespace

TEST_CASE(
    "the second pass removes and restores points, its results agree, and table1 has its scores") {
  const CarPark recording;
  succeed(recording.run("one", {"--passes", "1"}));
  succeed(recording.run("two", {"--passes", "2"}));
  succeed(recording.run("alone", {"--passes", "2", "--one-thread"}));
  CHECK(difference(timeless(recording.path("two")), timeless(recording.path("alone"))) == "");

  std::size_t removed = 0, kept_again = 0, moving = 0;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(recording.path("one") / "labels")) {
    const std::string scan = entry.path().stem().string();
    const auto before = labels_in(recording.path("one"), scan),
               after = labels_in(recording.path("two"), scan);
    REQUIRE(before.size() == after.size());
    for (std::size_t i = 0; i < after.size(); ++i) {
      const bool did_move = is_removed(before[i]), moves = is_removed(after[i]);
      removed += moves && !did_move ? 1 : 0;
      kept_again += did_move && !moves ? 1 : 0;
      moving += moves ? 1 : 0;
    }
  }
  CHECK(removed > 0);
  CHECK(kept_again > 0);

  const auto report = report_in(recording.path("two"));
  CHECK(report["labels"]["dynamic"] == moving);
  CHECK(report["second_pass"]["removed_points"] == removed);
  CHECK(report["second_pass"]["restored_points"] == kept_again);
  CHECK(report["complete"] == true);

  // remap builds the map of the static labels.
  succeed(start({"remap", recording.seq, recording.path("two").string()}));
  CHECK(read_text(recording.path("two") / "static_map.ply") ==
        read_text(recording.path("two") / "static_map_remapped.ply"));
}

TEST_CASE("passes are one or two, and the policy of static points needs two") {
  const TemporaryFolder folder;
  for (const char* const passes : {"0", "3"}) {
    CHECK(start({"run", folder / "seq", "--out", folder / "out", "--passes", passes}).code == 2);
  }
  for (const Arguments& stream : {Arguments{"--passes", "1"}, {"--preset", "default"}}) {
    CAPTURE(stream.front());
    check_refused(
        start(Arguments{"run", folder / "seq", "--out", folder / "out", "--static", "last"} +
              stream),
        2, "--static last needs --passes 2");
  }
  CHECK(!fs::exists(folder / "out"));
}
