// Power cuts at every moment of a run, for every state of the file system in crash_model.hpp.
// Afterwards each output is absent or complete. Other files are unchanged. A restart gives the
// bytes of an undisturbed run.
#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "crash_model.hpp"
#include "rehearsal.hpp"

namespace dynains::test {
namespace {

struct State {
  Crash crash;
  Tree tree;
};

/// Distinct states: for each moment the plain losses, then mixtures.
std::vector<State> crash_states(const CrashModel& model) {
  constexpr unsigned kMixtures = 128;
  std::vector<State> states;
  std::set<std::size_t> known;
  const auto add = [&](const Crash& crash) {
    Tree tree = model.after(crash);
    if (known.insert(fingerprint(tree)).second) states.push_back({crash, std::move(tree)});
  };
  for (std::size_t length = 0; length <= model.size(); ++length) {
    for (const NameLoss names : {NameLoss::kNothing, NameLoss::kAll, NameLoss::kTail}) {
      for (const DataLoss data :
           {DataLoss::kNothing, DataLoss::kAll, DataLoss::kZeros, DataLoss::kTorn}) {
        add({length, names, data, static_cast<unsigned>(length)});
      }
    }
    for (unsigned seed = 0; seed < kMixtures; ++seed) {
      add({length, NameLoss::kMixed, DataLoss::kMixed, seed});
    }
  }
  return states;
}

/// Whether the test detects a program that never syncs.
bool needs_syncs(const Rehearsal& rehearsal) {
  std::vector<shim::Entry> events = rehearsal.events();
  events.erase(std::remove_if(events.begin(), events.end(),
                              [](const shim::Entry& entry) {
                                return entry.event == shim::Event::kSync ||
                                       entry.event == shim::Event::kSyncAll;
                              }),
               events.end());
  const CrashModel model(rehearsal.before(), events, rehearsal.root());
  const std::vector<State> states = crash_states(model);
  return std::any_of(states.begin(), states.end(),
                     [&](const State& state) { return !rehearsal.problem(state.tree).empty(); });
}

void check_crashes(const Scenario& scenario) {
  Rehearsal rehearsal(scenario);
  const CrashModel model(rehearsal.before(), rehearsal.events(), rehearsal.root());
  // A difference means that the shim missed a change.
  const Tree end = model.after({model.size(), NameLoss::kNothing, DataLoss::kNothing, 0});
  REQUIRE(difference(end, rehearsal.after()) == "");

  CHECK(needs_syncs(rehearsal));

  const std::vector<State> states = crash_states(model);
  constexpr std::size_t kRestarts = DYNAINS_CRASH_STATES;
  const std::size_t step = (states.size() + kRestarts - 1) / kRestarts;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Crash& crash = states[i].crash;
    CAPTURE(crash.length, int(crash.names), int(crash.data), crash.seed);
    CHECK(rehearsal.problem(states[i].tree) == "");
    if (i % step == 0) CHECK(rehearsal.problem_after_restart(states[i].tree) == "");
  }
  WARN(model.size() << " events, " << states.size() << " different states, started again from "
                    << (states.size() + step - 1) / step);
}

}  // namespace

TEST_CASE("power cut during a run") { check_crashes(fresh_run({})); }

TEST_CASE("power cut during a run that writes all outputs") {
  check_crashes(fresh_run({"--write-online", "--write-clean"}));
}

TEST_CASE("power cut during a run with its map in another folder") {
  check_crashes(fresh_run({"--map", "/maps/map.ply"}));
}

TEST_CASE("power cut while a result is replaced") {
  check_crashes(replacing_run({"--write-online", "--write-clean"}, {}));
}

TEST_CASE("power cut while a result with its map in another folder is replaced") {
  check_crashes(replacing_run({"--map", "/maps/map.ply"}, {"--map", "/maps/map.ply"}));
}

TEST_CASE("power cut while a session of a map is moved to corrected poses") {
  check_crashes(moved_session());
}

TEST_CASE("power cut during a simulation") { check_crashes(simulation()); }

TEST_CASE("power cut while a simulation is replaced") { check_crashes(replacing_simulation()); }

}  // namespace dynains::test
