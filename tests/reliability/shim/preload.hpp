// Starts the program with the shim preloaded.
#pragma once

#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "io/files.hpp"
#include "log.hpp"
#include "program/start.hpp"

namespace dynains::test {

/// Sets variables that processes inherit if they start during its life.
class Environment {
 public:
  explicit Environment(std::map<std::string, std::string> variables)
      : variables_(std::move(variables)) {
    for (const auto& [name, value] : variables_) ::setenv(name.c_str(), value.c_str(), 1);
  }
  ~Environment() {
    for (const auto& variable : variables_) ::unsetenv(variable.first.c_str());
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  std::map<std::string, std::string> variables_;
};

/// Runs `dynains ARGUMENTS`. SIGALRM ends a program that hangs (exit code 142).
inline Outcome start_or_stop(const std::vector<std::string>& arguments) {
  return start(arguments, [] { ::alarm(20); });
}

struct Recorded {
  Outcome outcome;
  std::vector<shim::Entry> events;
};

/// Runs `dynains ARGUMENTS` and records its changes below `root`. `fault` as in shim.cpp; empty:
/// none.
inline Recorded start_with_shim(const std::vector<std::string>& arguments, const std::string& root,
                                const std::string& fault = {}) {
  const TemporaryFolder folder;
  const std::string log = folder / "log";
  write_text(log, {});
  const Environment environment({{"LD_PRELOAD", DYNAINS_SHIM},
                                 {"DYNAINS_SHIM_ROOT", root},
                                 {"DYNAINS_SHIM_LOG", log},
                                 {"DYNAINS_SHIM_FAULT", fault},
                                 // A sanitizer's runtime may come after the shim.
                                 {"ASAN_OPTIONS", "verify_asan_link_order=0"}});
  const Outcome outcome = start_or_stop(arguments);
  return {outcome, shim::parse_log(read_text(log))};
}

}  // namespace dynains::test
