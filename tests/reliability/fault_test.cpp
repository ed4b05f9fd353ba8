// Each call of the program that touches a file fails once: the first, the second, and so on to the
// last. The program ends with a message that names file and cause, or with the result of an
// undisturbed run; nothing is lost, and one more start gives that result.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "rehearsal.hpp"

namespace dynains::test {
namespace {

struct Fault {
  const char* call;  ///< as in shim.cpp
  int error;
  const char* lasts = "once";
};

const std::vector<Fault> kFaults = {
    {"open", EMFILE},        {"open", EACCES},   {"open", EINTR},  {"write", ENOSPC},
    {"write", ENOSPC, "on"}, {"write", EIO},     {"write", EINTR}, {"write", 0},
    {"read", EIO},           {"read", EINTR},    {"read", 0},      {"sync", EIO},
    {"sync", EINTR},         {"rename", EACCES}, {"rename", EIO},  {"remove", EACCES},
    {"mkdir", ENOSPC},       {"mkdir", EACCES},  {"stat", EIO},    {"list", EIO},
    {"lock", ENOLCK},        {"lock", EINTR},    {"close", EIO},   {"close", EINTR}};

/// What is wrong with the message; empty if nothing is.
std::string problem_of_message(const std::string& message, const Fault& fault,
                               const std::string& root) {
  const auto has = [&](const std::string& part) { return message.find(part) != std::string::npos; };
  if (message.rfind("dynains: error: ", 0) != 0) return "no message: " + message;
  if (std::count(message.begin(), message.end(), '\n') != 1) return "more than a line: " + message;
  if (!has(root)) return "no path: " + message;
  if (!has(std::strerror(fault.error))) return "no cause: " + message;
  return {};
}

void check(const Scenario& scenario) {
  Rehearsal rehearsal(scenario);
  std::size_t failed = 0;
  std::set<std::size_t> states;  // that the command was started from again
  for (const Fault& fault : kFaults) {
    for (int n = 1; true; ++n) {
      const std::string text = std::string(fault.call) + ' ' + std::to_string(n) + ' ' +
                               std::to_string(fault.error) + ' ' + fault.lasts;
      const Recorded run = rehearsal.disturb(text);
      const auto at = std::find_if(run.events.begin(), run.events.end(), [](const auto& event) {
        return event.event == shim::Event::kFault;
      });
      if (at == run.events.end()) break;
      ++failed;
      CAPTURE(text, at->path);
      const Tree state = read_tree(rehearsal.root());
      CHECK(rehearsal.problem(state) == "");
      if (run.outcome.code == 0) {
        CHECK(rehearsal.difference_from_end(state) == "");
      } else {
        CHECK(run.outcome.code <= 2);
        CHECK(problem_of_message(run.outcome.err, fault, rehearsal.root()) == "");
        if (!states.insert(fingerprint(without_measurements(state))).second) continue;
        CHECK(rehearsal.problem_after_restart(state) == "");
      }
    }
  }
  WARN(failed << " calls failed and left " << states.size() << " different states");
}

}  // namespace

TEST_CASE("every call of a run fails once") {
  check(fresh_run({"--write-clean", "--config", "/seq/run.cfg"}));
}

TEST_CASE("every call of a run with its map on the disk fails once") {
  check(fresh_run({"--map-memory", "0"}));
}

TEST_CASE("every call of a run that replaces a result fails once") {
  check(replacing_run({"--write-clean"}, {"--map", "/maps/map.ply"}));
}

TEST_CASE("every call of a run that is resumed fails once") { check(resumed_run({})); }

TEST_CASE("every call of a simulation fails once") { check(replacing_simulation()); }

TEST_CASE("every call of an evaluation fails once") {
  const Arguments command = {"eval", "/seq", "/disk/out", "--json", "/maps/eval.json"};
  check({{run_with({})}, {}, command, command});
}

}  // namespace dynains::test
