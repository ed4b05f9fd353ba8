// The power goes at any moment of a run. Whatever the file system kept (crash_model.hpp): a folder
// of results is absent, whole or clearly unfinished, files of others are as they were, and one more
// start gives the bytes of an undisturbed run.
#include <algorithm>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "crash_model.hpp"
#include "results.hpp"
#include "shim/preload.hpp"
#include "small_recording.hpp"
#include "support/catch.hpp"

namespace dynains::test {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

/// Below the root: seq is the input, disk/out the results, maps another disk.
struct Scenario {
  std::string name;
  std::vector<Arguments> before;  ///< undisturbed
  Arguments recorded;
  Arguments again;  ///< what completes it after the crash
};

struct State {
  Crash crash;
  Tree tree;
};

/// What a run has in OUT for itself until it is done: temporaries and what they lie in.
bool is_hidden(const std::string& path) { return path.find("/.") != std::string::npos; }

bool is_ours(const std::string& path) {
  const std::string name = path.substr(path.rfind('/') + 1);
  if (name == "notes.txt") return false;  // of somebody else
  return path.rfind("disk/out", 0) == 0 || name == "map.ply" || name.rfind(".map.ply.", 0) == 0;
}

Tree select(const Tree& tree, const std::function<bool(const std::string&)>& wanted) {
  Tree selected;
  for (const auto& item : tree) {
    if (wanted(item.first)) selected.insert(item);
  }
  return selected;
}

Tree ours(const Tree& tree) {
  return select(tree, [](const std::string& path) { return is_ours(path) && !is_hidden(path); });
}
Tree not_ours(const Tree& tree) {
  return select(tree, [](const std::string& path) { return !is_ours(path); });
}

/// What is wrong with a state between `before` and `after`, or nothing.
std::string problem(const Tree& state, const Tree& before, const Tree& after) {
  const std::string foreign = difference(not_ours(state), not_ours(before));
  if (!foreign.empty()) return "not ours: " + foreign;
  const Tree results = below(state, "disk/out");
  switch (claim_of(results)) {
    case Claim::kUnreadable:
      return "the marker cannot be read";
    case Claim::kUnfinished:
      return {};
    case Claim::kComplete: {
      const std::string from_new = difference(ours(state), ours(after));
      const bool is_old = ours(state) == ours(before);
      return from_new.empty() || is_old ? std::string() : "called complete, but " + from_new;
    }
    case Claim::kNone:
      for (const auto& [path, item] : results) {
        if (item.kind == Kind::kFile && !is_hidden('/' + path)) return path + " without a marker";
      }
      return {};
  }
  return {};
}

/// Different states only: for each moment the plain losses, then mixtures.
std::vector<State> crash_states(const CrashModel& model, unsigned mixtures) {
  std::vector<State> states;
  std::set<std::size_t> known;
  const auto add = [&](const Crash& crash) {
    Tree tree = model.after(crash);
    std::string all;
    for (const auto& [path, item] : tree) all += path + '\0' + item.bytes + '\0';
    if (known.insert(std::hash<std::string>()(all)).second) {
      states.push_back({crash, std::move(tree)});
    }
  };
  for (std::size_t length = 0; length <= model.size(); ++length) {
    for (const NameLoss names : {NameLoss::kNothing, NameLoss::kAll, NameLoss::kTail}) {
      for (const DataLoss data :
           {DataLoss::kNothing, DataLoss::kAll, DataLoss::kZeros, DataLoss::kTorn}) {
        add({length, names, data, static_cast<unsigned>(length)});
      }
    }
    for (unsigned seed = 0; seed < mixtures; ++seed) {
      add({length, NameLoss::kMixed, DataLoss::kMixed, seed});
    }
  }
  return states;
}

class CrashTest {
 public:
  explicit CrashTest(const Scenario& scenario) : scenario_(scenario) {
    root_ = fs::canonical(folder_.path()).string() + "/root";
    for (const char* folder : {"disk", "maps"}) fs::create_directories(root_ + '/' + folder);
    write_small_recording(root_ + "/seq", 4);
    for (const Arguments& arguments : scenario.before) REQUIRE(run(arguments).code == 0);
    if (fs::exists(root_ + "/disk/out/labels")) {
      write_text(root_ + "/disk/out/notes.txt", "mine");
      write_text(root_ + "/disk/out/labels/notes.txt", "mine");
    }
    before_ = read_tree(root_);
    const Recorded recorded = start_with_shim(with_root(scenario.recorded), root_);
    CAPTURE(recorded.outcome.err);
    REQUIRE(recorded.outcome.code == 0);
    after_ = read_tree(root_);
    events_ = recorded.events;
  }

  void check() {
    const CrashModel model(before_, events_, root_);
    // The shim saw every change.
    REQUIRE(difference(model.after({model.size(), NameLoss::kNothing, DataLoss::kNothing, 0}),
                       after_) == "");
    const std::vector<State> states = crash_states(model, 128);
    for (const State& state : states) {
      CAPTURE(state.crash.length, int(state.crash.names), int(state.crash.data), state.crash.seed);
      CHECK(problem(state.tree, before_, after_) == "");
    }
    const std::size_t step = std::max<std::size_t>(1, states.size() / DYNAINS_CRASH_STATES);
    for (std::size_t i = 0; i < states.size(); i += step) check_restart(states[i]);
    WARN(scenario_.name << ": " << model.size() << " events, " << states.size()
                        << " different states, " << (states.size() + step - 1) / step
                        << " of them started from");
  }

 private:
  void check_restart(const State& state) const {
    CAPTURE(state.crash.length, int(state.crash.names), int(state.crash.data), state.crash.seed);
    for (const char* disk : {"disk", "maps"}) {
      write_tree(root_ + '/' + disk, below(state.tree, disk));
    }
    const Outcome outcome = run(scenario_.again);
    CAPTURE(outcome.err);
    if (outcome.code != 0 && ours(state.tree) == ours(before_)) {
      // The earlier result is whole: there is nothing to resume.
      CHECK(difference(read_tree(root_), state.tree) == "");
      return;
    }
    CHECK(outcome.code == 0);
    CHECK(difference(without_measurements(read_tree(root_)), without_measurements(after_)) == "");
  }

  Arguments with_root(Arguments arguments) const {
    for (std::string& argument : arguments) {
      if (argument.front() == '/') argument = root_ + argument;
    }
    return arguments;
  }
  Outcome run(const Arguments& arguments) const { return start(with_root(arguments)); }

  Scenario scenario_;
  TemporaryFolder folder_;
  std::string root_;
  Tree before_;
  Tree after_;
  std::vector<shim::Entry> events_;
};

Arguments run_with(const Arguments& flags) {
  Arguments arguments = {"run", "/seq", "--out", "/disk/out", "--quiet"};
  arguments.insert(arguments.end(), flags.begin(), flags.end());
  return arguments;
}
Arguments simulate_with(const Arguments& flags) {
  Arguments arguments = {"simulate", "/disk/out", "--quiet", "--scans", "2", "--sensor", "vlp16"};
  arguments.insert(arguments.end(), flags.begin(), flags.end());
  return arguments;
}

/// `dynains run` with these flags, then again with --resume.
Scenario fresh(const Arguments& flags) {
  Arguments again = flags;
  again.push_back("--resume");
  return {"run", {}, run_with(flags), run_with(again)};
}

}  // namespace

TEST_CASE("the power goes during a run") { CrashTest(fresh({"--end", "2"})).check(); }

TEST_CASE("the power goes during a run that writes everything") {
  CrashTest(fresh({"--end", "2", "--write-online", "--write-clean"})).check();
}

TEST_CASE("the power goes during a run with its map elsewhere") {
  CrashTest(fresh({"--end", "2", "--map", "/maps/map.ply"})).check();
}

TEST_CASE("the power goes during a run with its map on the disk") {
  CrashTest(fresh({"--end", "2", "--map-memory", "0"})).check();
}

TEST_CASE("the power goes while a result is replaced") {
  Scenario scenario = fresh({"--end", "2"});
  scenario.before = {run_with({"--window", "2", "--write-online", "--write-clean"})};
  scenario.recorded.push_back("--force");
  CrashTest(scenario).check();
}

TEST_CASE("the power goes while a result with its map elsewhere is replaced") {
  Scenario scenario = fresh({"--end", "2", "--map", "/maps/map.ply"});
  scenario.before = {run_with({"--map", "/maps/map.ply"})};
  scenario.recorded.push_back("--force");
  CrashTest(scenario).check();
}

TEST_CASE("the power goes during a simulation") {
  CrashTest({"simulate", {}, simulate_with({}), simulate_with({"--force"})}).check();
}

TEST_CASE("the power goes while a simulation is replaced") {
  CrashTest({"simulate --force",
             {simulate_with({"--seed", "2"})},
             simulate_with({"--force"}),
             simulate_with({"--force"})})
      .check();
}

}  // namespace dynains::test
