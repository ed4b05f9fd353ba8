#include "program/run_folder.hpp"
#include "program/tiny_sequence.hpp"
#include "support/catch.hpp"

using namespace dynains::test;

namespace {

struct PageFixture : RunFolder {
  PageFixture() { write_tiny_sequence(seq, 4); }
  Outcome view(const Arguments& more = {}) const { return start(Arguments{"view", out} + more); }

  std::string page = out + "/view.html";
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("the page of a run has its description and is listed among the results") {
  const PageFixture fixture;
  const Outcome run = succeed(fixture.run({"--view"}));
  CHECK(contains(run.out, "page: " + fixture.page + "\n"));
  const std::string page = read_text(fixture.page);
  CHECK(contains(page, "\"has_beliefs\":true"));
  CHECK(!contains(page, "{{"));
  // Nothing is loaded from elsewhere.
  CHECK(!contains(page, "http:"));
  CHECK(!contains(page, "https:"));
  CHECK(contains(read_text(fixture.out + "/report.json"), "\"view.html\""));

  // The page belongs to the results: it goes with them.
  succeed(fixture.run({"--force"}));
  CHECK(!fs::exists(fixture.page));
  CHECK(!fs::exists(fixture.out + "/beliefs"));
  succeed(fixture.view());
  CHECK(contains(read_text(fixture.page), "\"has_beliefs\":false"));
  succeed(fixture.view());
  CHECK(contains(read_text(fixture.out + "/report.json"), "\"complete\": true"));
}

TEST_CASE("view refuses what is no finished run, and files of others") {
  const PageFixture fixture;
  CHECK(
      contains(fixture.view().err, fixture.out + ": cannot be opened: No such file or directory"));
  fs::create_directory(fixture.out);
  CHECK(contains(fixture.view().err, "report.json: not found"));
  succeed(fixture.run());
  write_text(fixture.page, "mine");
  check_refused(fixture.view(), 1, "view.html");
  CHECK(read_text(fixture.page) == "mine");
}

TEST_CASE("view finds the recording by the report, with its flags, or by its new place") {
  const PageFixture fixture;
  const std::string poses = fixture.folder / "my poses.txt";
  fs::rename(fixture.seq + "/poses.txt", poses);
  succeed(fixture.run({"--poses", poses}));
  succeed(fixture.view());

  fs::rename(fixture.seq, fixture.seq + "2");
  CHECK(contains(fixture.view().err, "name the place of the run's recording"));
  CHECK(fixture.view({fixture.seq + "2"}).code == 0);
  fs::remove(fixture.seq + "2/velodyne/000000.bin");
  CHECK(contains(fixture.view({fixture.seq + "2"}).err, "000000 first"));
}

TEST_CASE("beliefs are written on demand, one byte per point") {
  const PageFixture fixture;
  succeed(fixture.run({"--write-beliefs"}));
  CHECK(fs::file_size(fixture.out + "/beliefs/000003.belief") ==
        fs::file_size(fixture.out + "/causes/000003.cause"));
  fs::resize_file(fixture.out + "/beliefs/000003.belief", 7);
  check_refused(fixture.view(), 1, "000003.belief: has 7 bytes; expected a byte for each");
}
