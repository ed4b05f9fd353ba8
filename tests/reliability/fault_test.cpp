// Calls of the program that touch a file fail once. The program then ends with a message that names
// file and cause, or with the result of an undisturbed run. No earlier file is lost, and a restart
// gives the result of an undisturbed run.
//
// The first and the last call of each kind fail, and one of each DYNAINS_FAULTS_OF between them
// (default 8; 1: every call).
#include <cerrno>

#include "rehearsal.hpp"
#include "support/random.hpp"
#include "support/standard.hpp"

namespace dynains::test {
namespace {

/// Errors of a call, as in shim.cpp; 0: the call moves half the bytes.
struct Call {
  const char* name;
  std::vector<int> errors;
};

const std::vector<Call> kCalls = {{"open", {EMFILE, EACCES, EINTR}},
                                  {"write", {ENOSPC, EIO, EINTR, 0}},
                                  {"read", {EIO, EINTR, 0}},
                                  {"sync", {EIO, EINTR}},
                                  {"rename", {EACCES, EIO, EINVAL}},
                                  {"remove", {EACCES}},
                                  {"mkdir", {ENOSPC, EACCES}},
                                  {"stat", {EIO}},
                                  {"list", {EIO}},
                                  {"lock", {ENOLCK, EINTR}},
                                  {"close", {EIO, EINTR}}};

/// Description of a problem of the message; empty if there is none.
std::string problem_of_message(const std::string& message, int error, const std::string& root) {
  const auto has = [&](const std::string& part) { return message.find(part) != std::string::npos; };
  if (message.rfind("dynains", 0) != 0 || !has(": error: ")) return "no message: " + message;
  if (std::count(message.begin(), message.end(), '\n') != 1) return "more than a line: " + message;
  if (!has(root)) return "no path: " + message;
  if (!has(std::strerror(error))) return "no cause: " + message;
  return {};
}

class FaultTest {
 public:
  explicit FaultTest(const Scenario& scenario)
      : rehearsal_(scenario),
        random_(std::hash<std::string>()(
            std::accumulate(scenario.command.begin(), scenario.command.end(), std::string()))) {}

  /// The chosen calls with each of their errors, or with their errors in turn.
  void check() {
    for (const Call& call : kCalls) {
      std::size_t turn = 0;
      for_chosen_calls([&](std::size_t n) {
        std::vector<int> errors = call.errors;
        if (!DYNAINS_ALL_FAULTS) errors = {errors[turn++ % errors.size()]};
        return std::all_of(errors.begin(), errors.end(),
                           [&](int error) { return check(call.name, n, error, "once"); });
      });
    }
    for_chosen_calls([&](std::size_t n) { return check("write", n, ENOSPC, "on"); });
    WARN(failed_ << " calls failed and left " << states_.size() << " different states");
  }

 private:
  /// fails(n) for the first call, the last one, and one of each few between them, which is drawn:
  /// the calls of scans are alike, and a fixed step might always hit the same one. `fails` returns
  /// false if there are fewer than n calls.
  template <class Fails>
  void for_chosen_calls(const Fails& fails) {
    if (!fails(1)) return;
    for (std::size_t first = 2; true; first += few_) {
      const std::size_t drawn = first + random_.index(few_);
      std::size_t n = drawn;
      while (n >= first && !fails(n)) --n;
      if (n < drawn) return;
    }
  }

  /// False if there are fewer than n calls.
  bool check(const std::string& call, std::size_t n, int error, const std::string& how) {
    const std::string fault =
        call + ' ' + std::to_string(n) + ' ' + std::to_string(error) + ' ' + how;
    const Recorded run = rehearsal_.disturb(fault);
    const auto at = std::find_if(run.events.begin(), run.events.end(), [](const auto& event) {
      return event.event == shim::Event::kFault;
    });
    if (at == run.events.end()) return false;
    ++failed_;
    CAPTURE(fault, at->path);
    const Tree state = read_tree(rehearsal_.root());
    CHECK(rehearsal_.problem(state) == "");
    if (run.outcome.code == 0) {
      CHECK(rehearsal_.difference_from_end(state) == "");
      return true;
    }
    CHECK(run.outcome.code <= 2);
    CHECK(problem_of_message(run.outcome.err, error, rehearsal_.root()) == "");
    if (states_.insert(fingerprint(without_measurements(state))).second) {
      CHECK(rehearsal_.problem_after_restart(state) == "");
    }
    return true;
  }

  Rehearsal rehearsal_;
  Random random_;
  std::size_t few_ = number_in("DYNAINS_FAULTS_OF", 8);
  std::size_t failed_ = 0;
  std::set<std::size_t> states_;  ///< states from which the command was started again
};

void check_faults(const Scenario& scenario) { FaultTest(scenario).check(); }

}  // namespace

TEST_CASE("calls of a run fail once") {
  check_faults(fresh_run({"--write-clean", "--config", "/seq/run.cfg"}));
}

TEST_CASE("calls of a run that replaces a result fail once") {
  check_faults(replacing_run({"--write-clean"}, {"--map", "/maps/map.ply"}));
}

TEST_CASE(
    "a disk that gets full leaves a moved session and the map of its run both old or both new") {
  const Scenario scenario = moved_session();
  Rehearsal rehearsal(scenario);
  std::size_t failed = 0;
  for (std::size_t n = 1; true; ++n) {
    const std::string fault = "write " + std::to_string(n) + " 28 on";
    const Recorded run = rehearsal.disturb(fault);
    if (run.outcome.code == 0) break;
    ++failed;
    CAPTURE(fault, run.outcome.err);
    const Tree state = read_tree(rehearsal.root());
    CHECK(rehearsal.problem(state) == "");
    const auto has_changed = [&](const std::string& part) {
      return state.at(part) != rehearsal.before().at(part);
    };
    const bool has_map = state.count(scenario.parts[1]) > 0;
    CHECK(has_changed(scenario.parts[0]) == has_map);
  }
  CHECK(failed > 4);
}

TEST_CASE("calls of a run that adds a session fail once") { check_faults(added_session()); }

TEST_CASE("calls of a moved session fail once") { check_faults(moved_session()); }

TEST_CASE("a session is whole or out of the map if it cannot be dropped") {
  const Arguments command = {"map", "/maps/city", "drop", "seq"};
  Rehearsal rehearsal({{run_with({"--update", "/maps/city", "--accept-poses"})}, command, {}});
  const Recorded drop = rehearsal.disturb("remove 1 " + std::to_string(EACCES) + " once");
  CHECK(drop.outcome.code == 1);
  CHECK(problem_of_message(drop.outcome.err, EACCES, rehearsal.root()) == "");
  const std::string session = "maps/city/seq.session";
  const Tree state = read_tree(rehearsal.root());
  REQUIRE(state.count(session) == 1);
  CHECK(state.at(session) == rehearsal.before().at(session));
}

TEST_CASE("calls of a simulation fail once") { check_faults(replacing_simulation()); }

TEST_CASE("calls of an evaluation fail once") {
  const Arguments command = {"eval", "/seq", "/disk/out", "--json", "/maps/eval.json", "--force"};
  check_faults({{run_with({})}, command, command});
}

}  // namespace dynains::test
