#include "run/output_folder.hpp"

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::program;
using namespace dynains::test;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

const OutputKind kKind = {
    "run", "report.json", {"a.txt"}, true, {{"labels", {".label"}}, {"clean", {".bin", ".ply"}}}};

const OutputListing kListing = {{"a.txt", "map.ply"}, {{"labels", ".label"}}, {"000000", "000001"}};

Json marker(bool complete, const OutputListing& listing = kListing) {
  return {{"program", "dynains"},
          {"command", "run"},
          {"complete", complete},
          {"outputs", listing.to_json()}};
}

/// Complete results, with files of another owner beside them.
void write_results(const TemporaryFolder& folder) {
  write_text(folder / "report.json", marker(true).dump());
  for (const char* name : {"a.txt", "map.ply", "labels/000000.label", "labels/000001.label"}) {
    write_text(folder / name, "old");
  }
  for (const char* name : {"mine.txt", "labels/mine.txt", "labels/000002.label"}) {
    write_text(folder / name, "mine");
  }
}

void check_foreign_files(const TemporaryFolder& folder) {
  for (const char* name : {"mine.txt", "labels/mine.txt", "labels/000002.label"}) {
    CHECK(read_text(folder / name) == "mine");
  }
}

OutputFolder open(const TemporaryFolder& folder) {
  return OutputFolder(Folder(folder.path()), kKind);
}

std::string refusal(const TemporaryFolder& folder) {
  return message_of<IoError>([&] { open(folder).check(kListing, InputFiles()); });
}

std::string refusal_of_marker(const std::string& text) {
  const TemporaryFolder folder;
  write_text(folder / "report.json", text);
  return refusal(folder);
}

const std::string kNoRefusal = "(nothing was thrown)";

}  // namespace

TEST_CASE("An empty folder is accepted, even with a temporary marker of a killed command") {
  TemporaryFolder folder;
  CHECK(refusal(folder) == kNoRefusal);
  write_text(folder / ".report.json.0123456789abcdef.tmp", "{");
  fs::create_directory(folder / "labels");
  CHECK(refusal(folder) == kNoRefusal);
  OutputFolder out = open(folder);
  CHECK_FALSE(out.has_results());
  const OutputChange change(out, OutputChange::Mode::kInPlace, marker(false), kListing);
  CHECK_FALSE(fs::exists(folder / ".report.json.0123456789abcdef.tmp"));
}

TEST_CASE("A folder of another owner is refused, for any names of its files") {
  for (const char* name : {"labels/000000.label", ".notes.2024.tmp", ".notes.0123456789abcdef.tmp",
                           ".a.txt.0123456789abcdef.tmp", "a.txt"}) {
    CAPTURE(name);
    TemporaryFolder folder;
    write_text(folder / name, "precious");
    CHECK_THAT(refusal(folder), ContainsSubstring("no earlier results (no report.json)"));
    CHECK(read_text(folder / name) == "precious");
  }
}

TEST_CASE("A marker is ours if it names the program and the command and lists names of ours") {
  CHECK(refusal_of_marker(marker(true).dump()) == kNoRefusal);
  CHECK_THAT(refusal_of_marker("{"), ContainsSubstring("report.json:1: column 2: expected JSON"));
  CHECK_THAT(refusal_of_marker(std::string(40000, '[')), ContainsSubstring("at most 64 arrays"));
  CHECK_THAT(refusal_of_marker("{}"), ContainsSubstring("was not written by dynains run"));
  CHECK_THAT(refusal_of_marker("[1]"), ContainsSubstring("was not written by dynains run"));
  CHECK_THAT(refusal_of_marker(R"({"program": "dynains", "complete": true})"),
             ContainsSubstring("does not list the files of the results, as an older version"));
  const auto with = [](const char* field, const Json& value) {
    Json json = marker(true);
    json[Json::json_pointer(field)] = value;
    return refusal_of_marker(json.dump());
  };
  CHECK_THAT(with("/program", "other"), ContainsSubstring("was not written by dynains run"));
  CHECK_THAT(with("/command", "simulate"), ContainsSubstring("was not written by dynains run"));
  CHECK_THAT(with("/outputs", 3), ContainsSubstring("/outputs/files: expected an array"));
  CHECK_THAT(with("/outputs/scans", "all"), ContainsSubstring("/outputs/scans: expected an array"));
  for (const char* name : {"../a.ply", "/a.ply", "", ".", "..", "a%2Fb.ply", "a%00.ply", "a%zz"}) {
    CAPTURE(name);
    CHECK_THAT(with("/outputs/files/0", name), ContainsSubstring("expected names of files"));
    CHECK_THAT(with("/outputs/scans/0", name), ContainsSubstring("expected names of files"));
  }
  CHECK_THAT(with("/outputs/files/0", "notes.txt"), ContainsSubstring("nothing named notes.txt"));
  CHECK_THAT(with("/outputs/files/0", "report.json"), ContainsSubstring("nothing named report"));
  CHECK_THAT(with("/outputs/folders/src", ".cpp"), ContainsSubstring("nothing named src"));
  CHECK_THAT(with("/outputs/folders/labels", ".txt"), ContainsSubstring("named labels.txt"));
  CHECK_THAT(with("/outputs/folders/labels", 1), ContainsSubstring("nothing named labels"));
}

TEST_CASE("Names in a listing need not be UTF-8") {
  const OutputListing listing = {{"\xE4 %.ply"},
                                 {{"clean", ".bin"}},
                                 {"sc\xFF"
                                  "an",
                                  "0%0A\n"}};
  const Json json = marker(true, listing);
  const OutputListing again = read_listing("report.json", Json::parse(json.dump()), kKind);
  CHECK(again.files == listing.files);
  CHECK(again.folders == listing.folders);
  CHECK(again.scans == listing.scans);
  CHECK(again.contains("clean",
                       "sc\xFF"
                       "an.bin"));
  CHECK_FALSE(again.contains("clean", "scan.bin"));
  CHECK_FALSE(again.contains("clean", ".bin"));
}

TEST_CASE("Links and folders in the place of results are refused before anything is touched") {
  TemporaryFolder folder;
  TemporaryFolder other;
  write_results(folder);
  write_text(other / "000000.label", "precious");
  std::string expected = "expected a file or nothing there";
  SECTION("a folder of results is a link") {
    fs::remove_all(folder / "labels");
    fs::create_directory_symlink(other.path(), folder / "labels");
    expected = "labels: is a link or a file; expected a folder";
  }
  SECTION("a file is a link") {
    fs::remove(folder / "labels/000000.label");
    fs::create_symlink(other / "000000.label", folder / "labels/000000.label");
  }
  SECTION("a file is a folder") {
    fs::remove(folder / "labels/000001.label");
    fs::create_directory(folder / "labels/000001.label");
  }
  SECTION("the marker is a link") {
    fs::rename(folder / "report.json", other / "report.json");
    fs::create_symlink(other / "report.json", folder / "report.json");
    expected = "report.json: is a link or a folder; expected a file";
  }
  SECTION("the staging folder is a link") {
    fs::create_directory_symlink(other.path(), folder / kStagingFolder);
    expected = "is a link or a file; expected a folder";
  }
  SECTION("the staging folder belongs to somebody") {
    write_text(folder / kStagingFolder / "notes.txt", "mine");
    expected = "is not empty and holds no earlier results";
  }
  SECTION("the staging folder holds a file of somebody") {
    write_text(folder / kStagingFolder / "report.json", marker(false).dump());
    write_text(folder / kStagingFolder / "labels/notes.txt", "mine");
    expected = "notes.txt: is no file of dynains";
  }
  CHECK_THAT(refusal(folder), ContainsSubstring(expected));
  CHECK(read_text(folder / "a.txt") == "old");
  CHECK(read_text(other / "000000.label") == "precious");
}

TEST_CASE("A file of another owner in the place of new results is refused") {
  TemporaryFolder folder;
  write_results(folder);
  OutputListing planned = kListing;
  planned.scans.insert("000002");
  const OutputFolder out = open(folder);
  CHECK_THAT(message_of<IoError>([&] { out.check(planned, InputFiles()); }),
             ContainsSubstring("000002.label: is in the way, and no part of earlier results"));
}

TEST_CASE("Files that a command reads are never removed, by any path to them") {
  TemporaryFolder folder;
  TemporaryFolder other;
  write_results(folder);
  const auto refusal_with = [&](const fs::path& input) {
    InputFiles inputs;
    inputs.add(input);
    return message_of<IoError>([&] { open(folder).check(kListing, inputs); });
  };
  fs::create_symlink(folder / "labels/000001.label", other / "link");
  fs::create_hard_link(folder / "map.ply", other / "hard");
  fs::create_directory_symlink(folder / "labels", other / "scans");
  CHECK_THAT(refusal_with(other / "link"),
             ContainsSubstring((folder / "labels/000001.label").string() +
                               ": is read by this command, as " + (other / "link").string()));
  CHECK_THAT(refusal_with(other / "hard"), ContainsSubstring("map.ply: is read by this command"));
  CHECK_THAT(refusal_with(other / "scans"), ContainsSubstring("labels: is read by this command"));
  CHECK_THAT(refusal_with(folder.path()), ContainsSubstring("is read by this command"));
  CHECK(refusal_with(folder / "mine.txt") == kNoRefusal);
  CHECK(refusal_with(other / "nothing") == kNoRefusal);
}

TEST_CASE("New results replace listed files when they are put in place, and nothing else") {
  TemporaryFolder folder;
  write_results(folder);
  write_text(folder / "labels/.000001.label.0123456789abcdef.tmp", "half");
  const OutputListing planned = {{"a.txt"}, {{"labels", ".label"}, {"clean", ".bin"}}, {"000001"}};
  OutputFolder out = open(folder);
  {
    OutputChange change(out, OutputChange::Mode::kStaged, marker(false), planned);
    write_text(change.folder() / "a.txt", "new");
    write_text(change.folder() / "labels/000001.label", "new");
    write_text(change.folder() / "clean/000001.bin", "new");
    CHECK(read_text(folder / "a.txt") == "old");
    CHECK(open(folder).is_complete());
    CHECK(open(folder).staging() != nullptr);
    change.put_in_place([&] {
      CHECK_FALSE(open(folder).is_complete());
      CHECK_FALSE(fs::exists(folder / "labels/000000.label"));
    });
    CHECK_FALSE(open(folder).is_complete());
    change.finish(marker(true), planned);
  }
  CHECK(open(folder).is_complete());
  CHECK(open(folder).listing().scans == planned.scans);
  CHECK(read_text(folder / "a.txt") == "new");
  CHECK(read_text(folder / "labels/000001.label") == "new");
  CHECK(read_text(folder / "clean/000001.bin") == "new");
  CHECK_FALSE(fs::exists(folder / "map.ply"));
  CHECK_FALSE(fs::exists(folder / "labels/000000.label"));
  CHECK_FALSE(fs::exists(folder / "labels/.000001.label.0123456789abcdef.tmp"));
  CHECK_FALSE(fs::exists(folder / kStagingFolder));
  check_foreign_files(folder);
}

TEST_CASE("New results that are not put in place leave the earlier ones as they were") {
  TemporaryFolder folder;
  write_results(folder);
  {
    OutputFolder out = open(folder);
    OutputChange change(out, OutputChange::Mode::kStaged, marker(false), kListing);
    write_text(change.folder() / "labels/000001.label", "new");
  }
  CHECK(open(folder).is_complete());
  CHECK(read_text(folder / "labels/000001.label") == "old");
  CHECK_FALSE(fs::exists(folder / kStagingFolder));
  check_foreign_files(folder);

  // State after a command was killed.
  write_text(folder / kStagingFolder / "report.json", marker(false).dump());
  write_text(folder / kStagingFolder / "labels/000001.label", "new");
  write_text(folder / kStagingFolder / "labels/.000000.label.0123456789abcdef.tmp", "half");
  OutputFolder out = open(folder);
  out.check(kListing, InputFiles());
  out.discard_staging();
  CHECK_FALSE(fs::exists(folder / kStagingFolder));
  CHECK(read_text(folder / "labels/000001.label") == "old");
}

TEST_CASE("Results in place keep what they list, and lose what only the earlier ones list") {
  TemporaryFolder folder;
  write_results(folder);
  OutputFolder out = open(folder);
  {
    OutputChange change(out, OutputChange::Mode::kInPlace, marker(false), kListing);
    CHECK(change.folder() == folder.path());
    CHECK_FALSE(open(folder).is_complete());
    CHECK(read_text(folder / "labels/000000.label") == "old");
  }
  const OutputListing fewer = {{"a.txt"}, {{"labels", ".label"}}, {"000000"}};
  const OutputChange change(out, OutputChange::Mode::kInPlace, marker(false, fewer), fewer);
  CHECK_FALSE(fs::exists(folder / "map.ply"));
  CHECK_FALSE(fs::exists(folder / "labels/000001.label"));
  CHECK(open(folder).listing().scans == fewer.scans);
  check_foreign_files(folder);
}

TEST_CASE("A temporary file that is being written is not removed as a leftover") {
  TemporaryFolder folder;
  write_results(folder);
  AtomicFile file(folder / "labels/000000.label");
  OutputFolder out = open(folder);
  const OutputChange change(out, OutputChange::Mode::kInPlace, marker(false), kListing);
  file.commit();
  CHECK(read_text(folder / "labels/000000.label").empty());
}

TEST_CASE("A folder below a file cannot be created") {
  TemporaryFolder folder;
  write_text(folder / "file", "");
  CHECK_THAT(message_of<IoError>([&] { create_folder(folder / "file/below"); }),
             ContainsSubstring("file/below: cannot be created: Not a directory"));
}

TEST_CASE("A locked folder that was created for it and stays empty is removed") {
  const TemporaryFolder folder;
  const fs::path above = folder.path() / "above";
  const fs::path out = above / "out";
  {
    const LockedFolder lock(out / "");
    CHECK(fs::is_directory(out));
    CHECK_THROWS_AS(LockedFolder(out), UsageError);
  }
  CHECK_FALSE(fs::exists(above));

  fs::create_directory(above);
  { const LockedFolder lock(out); }
  CHECK_FALSE(fs::exists(out));
  CHECK(fs::is_directory(above));

  fs::create_directory(out);
  { const LockedFolder lock(out); }
  CHECK(fs::is_directory(out));

  const fs::path other = folder.path() / "other";
  {
    const LockedFolder lock(other);
    write_text(other / "result", "");
  }
  CHECK(fs::exists(other / "result"));
}
