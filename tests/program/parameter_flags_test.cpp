#include "program/parameter_flags.hpp"

#include <sys/stat.h>

#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::program;
using namespace dynains::run;
using namespace dynains::test;

namespace {

enum class Kind { kFirst, kSecond };
constexpr std::array<const char*, 2> value_names(Kind) { return {"first", "second"}; }

struct Sample {
  double tau_s = 0.6;
  int window = 4;
  bool use_belief = true;
  std::uint64_t seed = 1;
  Kind kind = Kind::kFirst;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"tau_s", self.tau_s, half_open_below(0, 1), "m", "threshold"});
    visitor(Parameter{"window", self.window, closed(2, 64), "scans", "length"});
    visitor(Parameter{"use_belief", self.use_belief, Bounds{}, "", "switch"});
    visitor(Parameter{"seed", self.seed, Bounds{}, "", "number"});
    visitor(Parameter{"kind", self.kind, Bounds{}, "", "choice"});
  }
};

Sample parse(std::vector<std::string> arguments) {
  CLI::App app;
  ParameterValues values;
  add_parameter_flags(app, Sample(), "Sample", values);
  std::reverse(arguments.begin(), arguments.end());
  app.parse(arguments);
  Sample sample;
  values.apply(sample);
  return sample;
}

Sample read(const std::string& text) {
  TemporaryFolder folder;
  write_text(folder / "a.cfg", text);
  Sample sample;
  read_config_file(folder / "a.cfg").apply(sample);
  return sample;
}

}  // namespace

TEST_CASE("Flags set the parameters that they name and no others") {
  const Sample sample = parse({"--tau-s", "0.25", "--use-belief=false"});
  CHECK(sample.tau_s == 0.25);
  CHECK(sample.window == 4);
  CHECK_FALSE(sample.use_belief);
  CHECK(parse({"--seed", "18446744073709551615"}).seed == 18446744073709551615U);
  CHECK(parse({"--window", "64"}).window == 64);
  CHECK(parse({"--kind", "second"}).kind == Kind::kSecond);
}

TEST_CASE("Values that no parameter takes are refused by name, value and bounds") {
  struct Case {
    const char* flag;
    const char* value;
    const char* expected;
  };
  const Case cases[] = {
      {"--tau-s", "0", "--tau-s = 0: expected FLOAT in (0, 1] m (threshold)"},
      {"--tau-s", "1.0001", "expected FLOAT in (0, 1] m"},
      {"--tau-s", "0.5x", "expected FLOAT"},
      {"--tau-s", "nan", "expected FLOAT"},
      {"--tau-s", "", "expected FLOAT"},
      {"--tau-s", " 0.5", "expected FLOAT"},
      {"--tau-s", "0,5", "expected FLOAT"},
      {"--window", "1", "--window = 1: expected INT in [2, 64] scans (length)"},
      {"--window", "4.5", "expected INT"},
      {"--window", "99999999999", "expected INT"},
      {"--seed", "-1", "expected INT"},
      {"--use-belief", "maybe", "--use-belief = maybe: expected true|false (switch)"},
      {"--kind", "third", "--kind = third: expected first|second (choice)"},
      {"--kind", "1", "expected first|second"},
  };
  for (const Case& wrong : cases) {
    CAPTURE(wrong.flag, wrong.value);
    const std::string argument = std::string(wrong.flag) + "=" + wrong.value;
    if (*wrong.value == '\0') {
      CHECK_THROWS_AS(parse({argument}), CLI::ParseError);
      continue;
    }
    CHECK_THAT(message_of<ConfigError>([&] { parse({argument}); }),
               ContainsSubstring(wrong.expected));
  }
}

TEST_CASE("Config files: comments, blanks, both spellings of a name") {
  const Sample sample = read("# all of it\n\n  tau-s = 0.5 # half\r\nwindow=8\n\tuse_belief = off");
  CHECK(sample.tau_s == 0.5);
  CHECK(sample.window == 8);
  CHECK_FALSE(sample.use_belief);
  CHECK(read("").window == 4);
}

TEST_CASE("Config files are refused by line") {
  const auto error = [](const std::string& text) {
    return message_of<ConfigError>([&] { read(text); });
  };
  CHECK_THAT(error("\ntau-x = 1\n"), ContainsSubstring("a.cfg:2: tau-x: unknown parameter"));
  CHECK_THAT(error("window = 1\n"), ContainsSubstring("a.cfg:1: window = 1: expected INT in"));
  CHECK_THAT(error("window\n"), ContainsSubstring("a.cfg:1: expected a line such as"));
  CHECK_THAT(error("window =\n"), ContainsSubstring("a.cfg:1: expected a line such as"));
  CHECK_THAT(error("= 4\n"), ContainsSubstring("a.cfg:1: expected a line such as"));
  CHECK_THAT(error("use-belief = on\n\nuse_belief = off\n"),
             ContainsSubstring("a.cfg:3: use-belief stands on line 1 already"));
  CHECK_THAT(error(std::string("tau-s = 0.6\nwindow = 4\0 5\n", 26)),
             ContainsSubstring("a.cfg:2: expected a line of text, found a NUL byte"));
  TemporaryFolder folder;
  CHECK_THAT(message_of<IoError>([&] { read_config_file(folder / "none.cfg"); }),
             ContainsSubstring("none.cfg: cannot be read: No such file"));
  CHECK_THAT(message_of<IoError>([&] { read_config_file(folder.path()); }),
             ContainsSubstring(": cannot be read: is a folder; expected a file"));
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  for (const std::string& endless : {std::string("/dev/zero"), std::string(folder / "pipe")}) {
    CHECK_THAT(message_of<IoError>([&] { read_config_file(endless); }),
               StartsWith(endless + ": cannot be read: is a device or a pipe"));
  }
}

TEST_CASE("Values are printed short, and read back exactly") {
  CHECK(format_value(0.6) == "0.6");
  CHECK(format_value(0.1F) == "0.1");
  CHECK(format_value(250.0) == "250");
  CHECK(format_value(1.25e-4) == "0.000125");
  CHECK(format_value(true) == "true");
  CHECK(format_value(64) == "64");
  CHECK(format_value(Kind::kSecond) == "second");
  for (const double value : {1.0 / 3.0, 0.1 + 0.2, 1e300, -5e-324, 1.723456789012345}) {
    CHECK(parse_value<double>(format_value(value)) == value);
  }
}
