#include "run/output/output_folder.hpp"

#include <unistd.h>

#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::run;
using namespace dynains::test;
using Json = nlohmann::ordered_json;

namespace {

const OutputKind kKind = {"run", "report.json"};
const OutputListing kListing = {{"a.txt", "map.ply"}, {{"labels", ".label"}}, {"000000", "000001"}};

Json marker(bool complete) {
  Json json = begin_marker(kKind);
  json["complete"] = complete;
  return json;
}

Json listed(const Json& outputs = kListing.to_json(), bool complete = true) {
  Json json = marker(complete);
  json["outputs"] = outputs;
  return json;
}

void write_results(const fs::path& folder) {
  write_text(folder / "report.json", listed().dump());
  for (const char* name : {"a.txt", "map.ply", "labels/000000.label", "labels/000001.label"}) {
    write_text(folder / name, "old");
  }
}

struct Place {
  TemporaryFolder root;
  fs::path out = fs::canonical(root.path()) / "out";
  fs::path partial = out.string() + ".partial";

  std::unique_ptr<OutputFolder> begin(bool may_replace = true,
                                      const InputFiles& inputs = InputFiles()) const {
    return std::make_unique<OutputFolder>(out, kKind, kListing, may_replace, inputs);
  }
  std::string refusal(bool may_replace = true, const InputFiles& inputs = InputFiles()) const {
    return message_of<IoError>([&] { begin(may_replace, inputs); });
  }
};

const std::string kNoRefusal = "(nothing was thrown)";

}  // namespace

TEST_CASE("Results appear at once, with a marker that lists them") {
  const Place place;
  {
    const auto out = place.begin(false);
    CHECK(out->path() == place.partial);
    CHECK(Json::parse(read_text(place.partial / "report.json"))["complete"] == false);
    write_text(out->path() / "labels/000001.label", "new");
    CHECK_FALSE(fs::exists(place.out));
    out->finish(begin_marker(kKind));
    CHECK_FALSE(fs::exists(place.partial));
  }
  Json report = Json::parse(read_text(place.out / "report.json"));
  CHECK(report["contents"].size() == 1);
  CHECK(report["contents"].contains("labels"));
  report.erase("contents");
  CHECK(report == listed());
  CHECK(read_text(place.out / "labels/000001.label") == "new");
}

TEST_CASE(
    "Results that are not finished leave nothing, or stay beside the place if they are kept") {
  Place place;
  place.out = place.root.path() / "above/out";
  place.partial = place.root.path() / "above/out.partial";
  {
    const auto out = place.begin();
    write_text(out->path() / "labels/000001.label", "new");
  }
  CHECK(fs::is_empty(place.out.parent_path()));
  {
    const auto out = place.begin();
    write_text(out->path() / "labels/000001.label", "new");
    out->keep_unfinished(marker(false));
  }
  CHECK_FALSE(fs::exists(place.out));
  CHECK(read_text(place.partial / "labels/000001.label") == "new");
  place.begin()->finish(begin_marker(kKind));
  CHECK_FALSE(fs::exists(place.partial));
  CHECK_FALSE(fs::exists(place.out / "labels"));
}

TEST_CASE("Earlier results are replaced as a whole, if they may be") {
  const Place place;
  write_results(place.out);
  CHECK_THAT(place.refusal(false), ContainsSubstring("holds earlier results"));
  {
    const auto out = place.begin();
    CHECK(out->had("/command", "run"));
    CHECK_FALSE(out->had("/command", "other"));
    CHECK_FALSE(out->had("/static_map/file", "map.ply"));
    write_text(out->path() / "a.txt", "new");
    CHECK(read_text(place.out / "a.txt") == "old");
    out->finish(begin_marker(kKind));
  }
  CHECK(read_text(place.out / "a.txt") == "new");
  CHECK_FALSE(fs::exists(place.out / "map.ply"));
  CHECK_FALSE(fs::exists(place.out / "labels"));
  CHECK_FALSE(fs::exists(place.partial));

  fs::remove_all(place.out);
  fs::create_directory(place.out);
  place.begin(false)->finish(begin_marker(kKind));
  CHECK(fs::exists(place.out / "report.json"));
}

TEST_CASE("A folder that holds anything but results is refused, and stays as it is") {
  const Place place;
  std::string expected = " is no file of the results";
  fs::path file = place.out / "labels/000000.label";
  SECTION("no results") {
    file = place.out / "a.txt";
    write_text(file, "mine");
    expected = "no results of dynains run (no report.json)";
  }
  SECTION("a link that leads nowhere") {
    fs::create_symlink("none", place.out);
    file = place.out;
    expected = "out: cannot be opened: No such file";
  }
  SECTION("a file beside results") {
    write_results(place.out);
    file = place.out / GENERATE("notes.txt", "labels/notes.txt", "labels/000002.label",
                                ".a.ply.0123456789abcdef.tmp", "more/notes.txt");
    write_text(file, "mine");
  }
  SECTION("a link in the place of a result") {
    write_results(place.out);
    write_text(place.root / "precious", "mine");
    fs::remove(file);
    fs::create_symlink(place.root / "precious", file);
  }
  SECTION("a link in the place of a folder of results") {
    write_results(place.out);
    fs::rename(place.out / "labels", place.root / "precious");
    fs::create_directory_symlink(place.root / "precious", place.out / "labels");
    file = place.root / "precious/000000.label";
  }
  SECTION("a link in the place of the marker") {
    write_results(place.out);
    fs::rename(place.out / "report.json", place.root / "report.json");
    fs::create_symlink(place.root / "report.json", place.out / "report.json");
    expected = "report.json: is a link or a folder; expected a file";
  }
  SECTION("a folder in the place of a result") {
    write_results(place.out);
    fs::remove(file);
    file /= "notes.txt";
    write_text(file, "mine");
  }
  const bool was_there = fs::exists(file);
  const std::string before = was_there ? read_text(file) : std::string();
  CHECK_THAT(place.refusal(), ContainsSubstring(expected));
  CHECK(fs::exists(file) == was_there);
  if (was_there) CHECK(read_text(file) == before);
  CHECK_FALSE(fs::exists(place.partial));
}

TEST_CASE("What a killed command left is removed before the next one, and nothing else") {
  const Place place;
  SECTION("of ours") {
    const bool has_marker = GENERATE(true, false);
    fs::create_directory(place.partial);
    write_text(place.partial / ".report.json.0123456789abcdef.tmp", "{");
    if (has_marker) {
      write_text(place.partial / "report.json", listed(kListing.to_json(), false).dump());
      write_text(place.partial / "labels/000001.label", "half");
      write_text(place.partial / "labels/.000000.label.0123456789abcdef.tmp", "half");
    }
    const auto out = place.begin();
    CHECK_FALSE(fs::exists(place.partial / "labels"));
    CHECK_FALSE(fs::exists(place.partial / ".report.json.0123456789abcdef.tmp"));
    out->finish(begin_marker(kKind));
    CHECK(fs::exists(place.out / "report.json"));
    return;
  }
  const fs::path precious = place.root / "precious";
  write_text(precious / "notes.txt", "mine");
  std::string expected = place.partial.string();
  SECTION("a link") { fs::create_directory_symlink(precious, place.partial); }
  SECTION("a file") { write_text(place.partial, "mine"); }
  SECTION("a folder of others") { write_text(place.partial / "notes.txt", "mine"); }
  SECTION("a folder with a marker of others") {
    write_text(place.partial / "report.json", R"({"program": "other"})");
  }
  SECTION("a file of others beside ours") {
    write_text(place.partial / "report.json", listed(kListing.to_json(), false).dump());
    write_text(place.partial / "labels/notes.txt", "mine");
    expected += "/labels/notes.txt";
  }
  CHECK_THAT(place.refusal(), StartsWith(expected));
  CHECK(read_text(precious / "notes.txt") == "mine");
  CHECK(fs::exists(fs::symlink_status(place.partial)));
  CHECK_FALSE(fs::exists(place.out));
}

TEST_CASE("A marker is ours if it names the program and the command, and lists files") {
  const Place place;
  const auto with = [&](const std::string& text) {
    write_text(place.out / "report.json", text);
    return place.refusal();
  };
  CHECK(with(listed().dump()) == kNoRefusal);
  CHECK_THAT(with("{"), ContainsSubstring("report.json:1: column 2: expected JSON"));
  CHECK_THAT(with(std::string(40000, '[')), ContainsSubstring("at most 64 arrays"));
  for (const char* text : {"{}", "[1]", R"({"program": "dynains", "command": "simulate"})",
                           R"({"program": "other", "command": "run"})"}) {
    CHECK_THAT(with(text), ContainsSubstring("was not written by dynains run"));
  }
  for (const char* field : {"/outputs", "/outputs/files", "/outputs/folders", "/outputs/scans"}) {
    CAPTURE(field);
    Json json = listed();
    json[Json::json_pointer(field)] = 3;
    CHECK_THAT(with(json.dump()), ContainsSubstring("/outputs: expected the names of files"));
  }
}

TEST_CASE("No listing leads out of the folder") {
  const Place place;
  write_text(place.root / "precious", "mine");
  const OutputListing listing = {{"../precious"}, {{"..", ""}, {".", ""}}, {"precious"}};
  write_text(place.out / "report.json", listed(listing.to_json()).dump());
  place.begin()->finish(begin_marker(kKind));
  CHECK(read_text(place.root / "precious") == "mine");
}

TEST_CASE("Names in a listing need not be UTF-8") {
  const std::string odd = "sc\xFF\n%0A";
  const OutputListing listing = {{}, {{"clean", ".bin"}}, {listed_name(odd)}};
  Json json = marker(true);
  json["outputs"] = Json::parse(listing.to_json().dump());
  const OutputListing again = read_listing("report.json", json, "run");
  CHECK(again.scans == listing.scans);
  CHECK(again.contains("clean", odd + ".bin"));
  CHECK_FALSE(again.contains("clean", "scan.bin"));
  CHECK_FALSE(again.contains("clean", ".bin"));
  CHECK_FALSE(again.contains("", odd + ".bin"));
}

TEST_CASE("Files that a command reads are never replaced, by any path to them") {
  const Place place;
  write_results(place.out);
  write_results(place.partial);
  const auto refusal_with = [&](const fs::path& input) {
    InputFiles inputs;
    inputs.add(input);
    return place.refusal(true, inputs);
  };
  fs::create_symlink(place.out / "labels/000001.label", place.root / "link");
  fs::create_hard_link(place.out / "map.ply", place.root / "hard");
  fs::create_directory_symlink(place.out / "labels", place.root / "scans");
  CHECK_THAT(refusal_with(place.root / "link"),
             ContainsSubstring((place.out / "labels/000001.label").string() +
                               ": is read by this command, as " + (place.root / "link").string()));
  CHECK_THAT(refusal_with(place.root / "hard"), ContainsSubstring("map.ply: is read by this"));
  CHECK_THAT(refusal_with(place.root / "scans"),
             ContainsSubstring("labels/000000.label: is read by"));
  CHECK_THAT(refusal_with(place.out), ContainsSubstring("is read by this command"));
  CHECK_THAT(refusal_with(place.partial / "labels"), ContainsSubstring("is read by this command"));
  CHECK(read_text(place.partial / "a.txt") == "old");
  CHECK(refusal_with(place.root / "nothing") == kNoRefusal);
}

TEST_CASE("Two commands never write one output") {
  const Place place;
  {
    const auto out = place.begin();
    CHECK_THROWS_AS(place.begin(), UsageError);
    CHECK(fs::exists(place.partial / "report.json"));
    out->finish(begin_marker(kKind));
  }
  {
    const ResultFolder reader(Folder(place.out), kKind);
    CHECK_THROWS_AS(place.begin(), UsageError);
  }
  const fs::path file = place.root / "map.ply";
  {
    OutputFile first(file, Existing::kStays, InputFiles());
    CHECK_THROWS_AS(OutputFile(file, Existing::kForced, InputFiles()), UsageError);
    OutputFile other(place.root / "other.ply", Existing::kStays, InputFiles());
    write_text(first.path(), "first");
    write_text(other.path(), "other");
    first.put_in_place();
    other.put_in_place();
  }
  CHECK(read_text(file) == "first");
  CHECK(read_text(place.root / "other.ply") == "other");
  CHECK_FALSE(fs::exists(file.string() + ".partial"));
  // Nobody replaces the folder of a file that is being written.
  const OutputFile within(place.out / "map.ply", Existing::kStays, InputFiles());
  CHECK_THROWS_AS(place.begin(), UsageError);
}

TEST_CASE("A file is replaced only if it may be, and never a link, a folder or a new one") {
  const TemporaryFolder root;
  const fs::path file = root / "map.ply";
  const auto refusal = [&](bool may_replace) {
    return message_of<IoError>([&] { OutputFile(file, existing_by(may_replace), InputFiles()); });
  };
  SECTION("a file") {
    write_text(file, "mine");
    CHECK_THAT(refusal(false), ContainsSubstring("map.ply: exists"));
    OutputFile output(file, Existing::kForced, InputFiles());
    write_text(output.path(), "new");
    CHECK(read_text(file) == "mine");
    output.put_in_place();
    CHECK(read_text(file) == "new");
  }
  SECTION("a file that is read") {
    write_text(file, "mine");
    InputFiles inputs;
    inputs.add(file);
    CHECK_THAT(message_of<IoError>([&] { OutputFile(file, Existing::kForced, inputs); }),
               ContainsSubstring("is read by this command"));
  }
  SECTION("a folder, and a link that leads nowhere") {
    GENERATE(true, false) ? fs::create_directory(file) : (fs::create_symlink("none", file), true);
    CHECK_THAT(refusal(true),
               ContainsSubstring("map.ply: is a link or a folder") || ContainsSubstring("none: "));
  }
  SECTION("a file that came meanwhile") {
    OutputFile output(file, Existing::kForced, InputFiles());
    write_text(output.path(), "new");
    write_text(file, "mine");
    CHECK_THAT(message_of<IoError>([&] { output.put_in_place(); }),
               ContainsSubstring("map.ply: cannot be put in place: File exists"));
    CHECK(read_text(file) == "mine");
    // The new results are kept.
    CHECK(read_text(output.path()) == "new");
  }
  SECTION("what a killed command left") {
    const fs::path partial = file.string() + ".partial";
    fs::create_directory(partial);
    SECTION("of ours") {
      Json json = begin_marker({"file", "partial.json"});
      json["outputs"] = OutputListing{{"map.ply"}, {}, {}}.to_json();
      write_text(partial / "partial.json", json.dump());
      write_text(partial / "map.ply", "half");
      OutputFile output(file, Existing::kStays, InputFiles());
      CHECK_FALSE(fs::exists(output.path()));
    }
    SECTION("of others") {
      write_text(partial / "map.ply", "mine");
      CHECK_THAT(refusal(true), StartsWith(partial.string()));
      CHECK(read_text(partial / "map.ply") == "mine");
    }
  }
}

TEST_CASE("What comes into a folder while its results are replaced stays there") {
  const Place place;
  write_results(place.out);
  const auto out = place.begin();
  write_text(out->path() / "labels/000000.label", "new");
  write_text(place.out / "notes.txt", "mine");
  write_text(place.out / "labels/notes.txt", "mine");
  write_text(place.out / "more/notes.txt", "mine");
  out->finish(begin_marker(kKind));
  for (const char* const file : {"notes.txt", "labels/notes.txt", "more/notes.txt"}) {
    CHECK(read_text(place.out / file) == "mine");
  }
  CHECK(read_text(place.out / "labels/000000.label") == "new");
  CHECK_FALSE(fs::exists(place.partial));
}

TEST_CASE("A file outside of a folder belongs to the results that have written it as it is") {
  const Place place;
  const fs::path map = place.out.string() + ".ply";
  write_text(map, "theirs");
  Json json = listed();
  const auto owner = [&](const fs::path& folder) {
    fs::create_directories(folder);
    write_text(folder / "report.json", json.dump());
    const Existing existing = place.begin()->owns(map);
    fs::remove_all(folder);
    return existing;
  };
  CHECK(owner(place.out) == Existing::kForeign);
  json["written"] = {{map.string(), content_of(map)}};
  for (const fs::path& folder : {place.out, place.partial}) {
    CHECK(owner(folder) == Existing::kOurs);
    write_text(map, "mine!!");
    CHECK(owner(folder) == Existing::kForeign);
    fs::remove(map);
    CHECK(owner(folder) == Existing::kForeign);
    write_text(map, "theirs");
  }
  json["written"] = "none";
  CHECK(owner(place.out) == Existing::kForeign);
}

TEST_CASE("Results that have changed since they were written are not replaced") {
  const Place place;
  const auto write = [&] {
    const auto out = place.begin();
    write_text(out->path() / "map.ply", "theirs");
    for (const char* name : {"000000", "000001"}) {
      write_text(out->path() / "labels" / (std::string(name) + ".label"), "old");
    }
    out->finish(begin_marker(kKind));
  };
  write();
  write();
  for (const char* name : {"map.ply", "labels/000001.label"}) {
    const std::string before = read_text(place.out / name);
    write_text(place.out / name, std::string(before.size(), 'x'));
    CHECK_THAT(place.refusal(), ContainsSubstring("has changed since dynains run wrote it"));
    CHECK(read_text(place.out / name).front() == 'x');
    write_text(place.out / name, before);
  }
  write();
}

TEST_CASE("A file is added to results, and replaced if it was added before") {
  const Place place;
  write_results(place.out);
  ResultFolder results(Folder(place.out), kKind);
  for (const char* text : {"first", "second"}) {
    OutputFile page(results, "view.html");
    write_text(page.path(), text);
    CHECK_FALSE(read_text(place.out / "report.json").empty());
    page.put_in_place([&] { results.mark_with(results.marker(), page.path()); });
    CHECK(read_text(place.out / "view.html") == text);
  }
  CHECK(results.listing().contains("", "view.html"));
  CHECK(results.is_complete());
  results.check(InputFiles());
  write_text(place.out / "other.html", "mine");
  CHECK_THAT(message_of<IoError>([&] { OutputFile(results, "other.html"); }),
             ContainsSubstring("is no file of the results"));
}

TEST_CASE("Names of unfinished outputs and the current folder are no places for results") {
  const Place place;
  CHECK_THROWS_AS(OutputFolder(place.partial, kKind, kListing, true, InputFiles()), ConfigError);
  CHECK_THROWS_AS(OutputFile(place.partial, Existing::kForced, InputFiles()), ConfigError);
  const fs::path before = fs::current_path();
  fs::create_directory(place.out);
  fs::current_path(place.out);
  CHECK_THAT(place.refusal(), ContainsSubstring("is the current folder"));
  fs::current_path(before);
}

TEST_CASE("A folder below a file cannot be created") {
  TemporaryFolder folder;
  write_text(folder / "file", "");
  CHECK_THAT(message_of<IoError>([&] { create_folder(folder / "file/below"); }),
             ContainsSubstring("file/below: cannot be created: Not a directory"));
}
