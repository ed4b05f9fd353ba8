#include <nlohmann/json.hpp>

#include "io/files.hpp"
#include "program/start.hpp"
#include "program/tiny_sequence.hpp"
#include "support/catch.hpp"

using namespace dynains::test;

namespace {

struct PageFixture {
  PageFixture() : seq(folder / "seq"), out(folder / "out"), page(out + "/view.html") {
    write_tiny_sequence(seq, 4);
  }

  TemporaryFolder folder;
  std::string seq;
  std::string out;
  std::string page;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("the page of a run has its description and is listed among the results") {
  const PageFixture fixture;
  const Outcome run = succeed(start({"run", fixture.seq, "--out", fixture.out, "--view"}));
  CHECK(contains(run.out, "page: " + fixture.page + "\n"));
  const std::string page = read_text(fixture.page);
  CHECK(contains(page, "\"has_beliefs\":true"));
  CHECK(!contains(page, "{{"));
  // Nothing is loaded from elsewhere.
  CHECK(!contains(page, "http:"));
  CHECK(!contains(page, "https:"));
  CHECK(contains(read_text(fixture.out + "/report.json"), "\"view.html\""));

  // The page belongs to the results: it goes with them.
  succeed(start({"run", fixture.seq, "--out", fixture.out, "--force"}));
  CHECK(!fs::exists(fixture.page));
  CHECK(!fs::exists(fixture.out + "/beliefs"));
  succeed(start({"view", fixture.out}));
  CHECK(contains(read_text(fixture.page), "\"has_beliefs\":false"));
  succeed(start({"view", fixture.out}));
  CHECK(contains(read_text(fixture.out + "/report.json"), "\"complete\": true"));
}

TEST_CASE("view refuses what is no finished run, and files of others") {
  const PageFixture fixture;
  CHECK(contains(start({"view", fixture.out}).err,
                 fixture.out + ": cannot be opened: No such file or directory"));
  fs::create_directory(fixture.out);
  CHECK(contains(start({"view", fixture.out}).err, "report.json: not found"));
  succeed(start({"run", fixture.seq, "--out", fixture.out}));
  write_text(fixture.page, "mine");
  const Outcome refused = start({"view", fixture.out});
  CHECK(refused.code == 1);
  CHECK(contains(refused.err, "view.html"));
  CHECK(read_text(fixture.page) == "mine");
}

TEST_CASE("view finds the recording by the report, with its flags, or by its new place") {
  const PageFixture fixture;
  const std::string poses = fixture.folder / "my poses.txt";
  fs::rename(fixture.seq + "/poses.txt", poses);
  succeed(start({"run", fixture.seq, "--out", fixture.out, "--poses", poses}));
  succeed(start({"view", fixture.out}));

  fs::rename(fixture.seq, fixture.seq + "2");
  CHECK(contains(start({"view", fixture.out}).err, "name the place of the run's recording"));
  CHECK(start({"view", fixture.out, fixture.seq + "2"}).code == 0);
  fs::remove(fixture.seq + "2/velodyne/000000.bin");
  CHECK(contains(start({"view", fixture.out, fixture.seq + "2"}).err, "000000 first"));
}

TEST_CASE("beliefs are written on demand, one byte per point") {
  const PageFixture fixture;
  succeed(start({"run", fixture.seq, "--out", fixture.out, "--write-beliefs"}));
  CHECK(fs::file_size(fixture.out + "/beliefs/000003.belief") ==
        fs::file_size(fixture.out + "/causes/000003.cause"));
  fs::resize_file(fixture.out + "/beliefs/000003.belief", 7);
  const Outcome outcome = start({"view", fixture.out});
  CHECK(outcome.code == 1);
  CHECK(contains(outcome.err, "000003.belief: has 7 bytes; expected a byte for each"));
}
