#include "run/json_file.hpp"

#include <string>

#include "io/files.hpp"
#include "io/input_file.hpp"
#include "support/catch.hpp"

using namespace dynains::program;
using namespace dynains::test;

namespace {

/// Error message for a JSON file with this text, from the name of the file on.
std::string refusal(const std::string& text) {
  TemporaryFolder folder;
  write_text(folder / "a.json", text);
  try {
    read_json_file(folder / "a.json");
  } catch (const dynains::IoError& error) {
    const std::string what = error.what();
    return what.substr(what.find("a.json"));
  }
  return "none";
}

std::string nested(int depth) {
  return std::string(static_cast<std::size_t>(depth), '[') +
         std::string(static_cast<std::size_t>(depth), ']');
}

}  // namespace

TEST_CASE("A file that is not JSON gives path, line, column and expectation") {
  CHECK_THAT(refusal("{\n  \"a\": 1,\n  b: 2}"), StartsWith("a.json:3: column 3: expected JSON: "));
  CHECK_THAT(refusal(""), StartsWith("a.json:1: column 1: expected JSON: "));
  CHECK_THAT(refusal("{\"a\": "), ContainsSubstring("unexpected end of input"));
  CHECK_THAT(refusal("{\"a\": 1}x"), StartsWith("a.json:1: column 9: expected JSON: "));
  CHECK_THAT(refusal("{\"a\": \"\xff\"}"), StartsWith("a.json:1: column 8: expected JSON: "));
  CHECK_THAT(refusal(std::string("{\0}", 3)), StartsWith("a.json:1: column 2: expected JSON: "));
  CHECK_THAT(refusal("{\"a\": 1e999}"), StartsWith("a.json: expected JSON: number overflow"));
  CHECK(refusal("{\"a\": [1, 2.5, null, true]}") == "none");
}

TEST_CASE("The depth of a JSON file is bounded") {
  CHECK(refusal(nested(kMaxJsonDepth)) == "none");
  CHECK(refusal(nested(kMaxJsonDepth + 1)) ==
        "a.json: expected at most 64 arrays and objects within each other");
  CHECK_THAT(refusal(nested(40000)), ContainsSubstring("expected at most 64"));
  CHECK(refusal('"' + nested(100) + "\\\"[\"") == "none");
}

TEST_CASE("A path that is no JSON file is refused with its kind") {
  TemporaryFolder folder;
  CHECK_THROWS_WITH(read_json_file(folder.path()),
                    ContainsSubstring(": cannot be read: is a folder; expected a file"));
  CHECK_THROWS_WITH(read_json_file(folder / "none.json"),
                    ContainsSubstring("none.json: cannot be read: No such file"));
  CHECK_THROWS_WITH(read_json_file("/dev/null"),
                    ContainsSubstring("/dev/null: cannot be read: is a device or a pipe"));
  write_text(folder / "large.json", "");
  std::filesystem::resize_file(folder / "large.json", dynains::kMaxTextBytes + 1);
  CHECK_THROWS_WITH(read_json_file(folder / "large.json"), ContainsSubstring("more than 67108864"));
}

TEST_CASE("A field of the wrong type gives path, pointer and expectation") {
  const auto json = nlohmann::ordered_json::parse(
      R"({"map": {"file": 3}, "complete": "yes", "n": -1, "list": [1], "none": null, "x": 2.5})");
  CHECK_THROWS_WITH(json_field<std::string>("r.json", json, "/map/file"),
                    "r.json: /map/file: expected a string, found number");
  CHECK_THROWS_WITH(json_field<bool>("r.json", json, "/complete"),
                    "r.json: /complete: expected true or false, found string");
  CHECK_THROWS_WITH(json_field<double>("r.json", json, "/list"),
                    "r.json: /list: expected a number, found array");
  CHECK_THROWS_WITH(required_json_field<bool>("r.json", json, "/none"),
                    "r.json: /none: not found; expected a value");
  CHECK(json_field<double>("r.json", json, "/x") == 2.5);
  CHECK(required_json_field<double>("r.json", json, "/list/0") == 1.0);
  CHECK_FALSE(json_field<bool>("r.json", json, "/list/first"));
  CHECK_FALSE(json_field<bool>("r.json", json, "/n/deeper"));
}
