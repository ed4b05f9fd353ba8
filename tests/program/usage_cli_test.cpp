#include <fcntl.h>
#include <unistd.h>

#include "dynains/version.hpp"
#include "program/start.hpp"
#include "support/catch.hpp"

using namespace dynains::test;

TEST_CASE("Flags --version and --help") {
  const Outcome version = start({"--version"});
  CHECK(version.code == 0);
  CHECK(version.out == std::string("dynains ") + dynains::kVersionString + "\n");
  const Outcome help = start({"--help"});
  CHECK(help.code == 0);
  for (const char* command : {"run", "config", "eval"}) {
    CHECK_THAT(help.out, ContainsSubstring(command));
    CHECK(start({command, "--help"}).code == 0);
  }
  CHECK_THAT(start({"map", "city", "at", "--help"}).out,
             ContainsSubstring("Usage: dynains map CITY at [OPTIONS] SESSION FILE\n"));
}

TEST_CASE("run --help shows the options that matter, --help-all the rest too") {
  const std::string help = start({"run", "--help"}).out;
  const std::string all = start({"run", "--help-all"}).out;
  for (const char* option : {"--out", "--preset", "--view", "--map "}) {
    CHECK_THAT(help, ContainsSubstring(option));
    CHECK_THAT(all, ContainsSubstring(option));
  }
  for (const char* option : {"--tau-s", "--invert-poses", "--write-online"}) {
    CHECK(help.find(option) == std::string::npos);
    CHECK_THAT(all, ContainsSubstring(option));
  }
  CHECK_THAT(help, ContainsSubstring("--help-all: "));
  CHECK(std::count(help.begin(), help.end(), '\n') < 40);
}

TEST_CASE("Wrong usage is one line on standard error and exit code 2") {
  struct Case {
    Arguments arguments;
    std::string expected;
  };
  const std::vector<Case> cases = {
      {{}, "expected a command"},
      {{"walk"}, "walk"},
      {{"run"}, "SEQ is required (see dynains run --help)"},
      {{"run", "seq"}, "--out is required"},
      {{"run", "seq", "--out"}, "--out"},
      {{"config", "--preset", "best"}, "best not in"},
      {{"eval"}, "required"},
      {{"config", "--preste"}, "--preste (see dynains config --help-all)"},
      {{"map", "city"}, "required (see dynains map --help)"},
      {{"map", "city", "at", "may"}, "FILE is required (see dynains map city at --help)"},
  };
  for (const Case& wrong : cases) {
    check_one_error(start(wrong.arguments), 2, wrong.expected);
  }
}

TEST_CASE("A failed write to standard output is an error, a closed pipe is none") {
  const std::string program = std::string("'") + DYNAINS_PROGRAM + "' config";
  const auto code_of = [](const std::string& command) {
    return WEXITSTATUS(
        std::system(("bash -o pipefail -c \"" + command + "\" 2> /dev/null").c_str()));
  };
  CHECK(code_of(program + " > /dev/full") == 1);
  CHECK(code_of(program + " > /dev/null") == 0);
  CHECK(code_of("(sleep 0.2; " + program + ") | true") == 0);
  for (const Arguments& arguments : {Arguments{"--help"}, {"--version"}, {"run", "--help"}}) {
    const auto to_full = [] { ::dup2(::open("/dev/full", O_WRONLY), STDOUT_FILENO); };
    check_refused(start(arguments, to_full), 1, "error: standard output: cannot be written\n");
  }
}

TEST_CASE("An error of the file system is one line that begins with the path") {
  const TemporaryFolder folder;
  const Outcome outcome = start({"run", folder.path(), "--out", ""});
  CHECK(outcome.code == 1);
  CHECK_THAT(outcome.err, StartsWith("dynains: error: \"\": "));
}
