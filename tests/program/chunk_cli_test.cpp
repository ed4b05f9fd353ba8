// `dynains run` in chunks, as a user starts it.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "dynains/io/kitti.hpp"
#include "dynains/io/point_file.hpp"
#include "io/files.hpp"
#include "program/start.hpp"
#include "program/tiny_sequence.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;
namespace fs = std::filesystem;

namespace {

using Flags = std::vector<std::string>;

constexpr std::size_t kBoxPoints = 24 * 8;  // last points of a tiny scan

struct ChunkFixture {
  explicit ChunkFixture(std::size_t scans = 23) : seq(folder / "seq") {
    write_tiny_sequence(seq, scans, {100.0, 200.0, 300.0});
  }
  Flags arguments(const std::string& out, const Flags& more) const {
    Flags all = {"run", seq, "--out", folder / out, "--lookahead-scans", "3"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  Outcome run(const std::string& out, const Flags& more) const {
    return start(arguments(out, more));
  }
  nlohmann::json report(const std::string& out) const {
    return nlohmann::json::parse(read_text(folder / out / "report.json"));
  }

  TemporaryFolder folder;
  std::string seq;
};

/// Names of all files below a folder, relative to it, without those that hold times.
Flags files_below(const fs::path& folder) {
  Flags files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = fs::relative(entry.path(), folder).string();
    if (entry.is_regular_file() && name != "report.json" && name != "timing.csv") {
      files.push_back(name);
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

void check_same_files(const fs::path& a, const fs::path& b) {
  REQUIRE(files_below(a) == files_below(b));
  for (const std::string& name : files_below(a)) {
    CAPTURE(name);
    CHECK(read_text(a / name) == read_text(b / name));
  }
}

/// A report without what depends on the moment and on the number of jobs.
nlohmann::json lasting_part(nlohmann::json report) {
  for (const char* name : {"milliseconds", "flush_milliseconds", "wall_milliseconds",
                           "share_outside_pipeline", "jobs", "kept_chunks", "peak_memory_bytes"}) {
    report.erase(name);
  }
  return report;
}

/// Ends the process when there are that many files of chunks.
void kill_after_chunks(const Process& process, const fs::path& chunks, std::size_t count) {
  const auto finished = [&] {
    std::size_t found = 0;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(chunks, ignored)) {
      found += entry.path().extension() == ".chunk" ? 1 : 0;
    }
    return found;
  };
  for (int i = 0; i < 20000 && finished() < count; ++i) {
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  ::kill(process.id(), SIGKILL);
}

}  // namespace

TEST_CASE("in chunks, the number of jobs changes no byte, for any kinds of output") {
  const ChunkFixture fixture;
  const std::vector<Flags> kinds = {
      {},
      {"--write-online", "--write-clean", "--write-beliefs", "--write-mcap"},
      {"--map-memory", "0"},
      {"--map-attributes"},
      {"--map", fixture.folder / "one/map.las"},
      {"--build-map", "false"},
      {"--decision", "window"},
      {"--decision", "both", "--lookback", "2"},
      {"--lookback", "0", "--start", "3", "--end", "20"},
  };
  for (const Flags& kind : kinds) {
    CAPTURE(kind);
    for (const std::string& jobs : Flags{"1", "2", "3"}) {
      Flags flags = {"--chunk", "6", "--jobs", jobs};
      flags.insert(flags.end(), kind.begin(), kind.end());
      const std::string out = jobs == "1" ? "one" : "other";
      for (std::string& flag : flags) {
        if (flag == (fixture.folder / "one/map.las").string()) {
          flag = (fixture.folder / out / "map.las").string();
        }
      }
      const Outcome outcome = fixture.run(out, flags);
      CAPTURE(jobs, outcome.err);
      REQUIRE(outcome.code == 0);
      if (out == "one") continue;
      check_same_files(fixture.folder / "one", fixture.folder / "other");
      CHECK(lasting_part(fixture.report("one")) == lasting_part(fixture.report("other")));
      fs::remove_all(fixture.folder / "other");
    }
    CHECK(fixture.report("one")["complete"] == true);
    CHECK(fixture.report("one")["chunks"] ==
          (kind.empty() || kind[0] != "--lookback" || kind[1] != "0" ? 4 : 3));
    fs::remove_all(fixture.folder / "one");
  }
}

TEST_CASE("a single chunk gives the labels of one stream") {
  const ChunkFixture fixture;
  REQUIRE(fixture.run("stream", {"--chunk", "0", "--jobs", "1"}).code == 0);
  REQUIRE(fixture.run("default", {}).code == 0);
  check_same_files(fixture.folder / "stream", fixture.folder / "default");
  CHECK(fixture.report("default")["chunks"] == 0);
  // More scans than there are, for chunk and warm-up.
  REQUIRE(fixture.run("one", {"--chunk", "1000", "--lookback", "1000"}).code == 0);
  CHECK(fixture.report("one")["chunks"] == 1);
  CHECK(fixture.report("one")["jobs"] == 1);
  for (std::size_t i = 0; i < 23; ++i) {
    for (const std::string& name :
         {"labels/" + scan_name(i) + ".label", "causes/" + scan_name(i) + ".cause"}) {
      CAPTURE(name);
      CHECK(read_text(fixture.folder / "one" / name) ==
            read_text(fixture.folder / "stream" / name));
    }
  }
  CHECK(read_text(fixture.folder / "one/dynamic_points.ply") ==
        read_text(fixture.folder / "stream/dynamic_points.ply"));
  CHECK(read_text(fixture.folder / "one/overview.png") ==
        read_text(fixture.folder / "stream/overview.png"));
}

TEST_CASE("chunks of one scan: each scan has its labels, and the report its times") {
  const ChunkFixture fixture(7);
  const Outcome outcome = fixture.run("out", {"--chunk", "1", "--jobs", "2"});
  REQUIRE(outcome.code == 0);
  CHECK_THAT(outcome.out, ContainsSubstring("2 jobs"));
  CHECK_THAT(outcome.out, ContainsSubstring("% of it outside the pipeline"));
  const nlohmann::json report = fixture.report("out");
  CHECK(report["chunks"] == 7);
  CHECK(report["scans"] == 7);
  CHECK(report["points"] == 7 * tiny_scan(0).size() / 4);
  CHECK(report["wall_milliseconds"] > 0.0);
  CHECK(report["share_outside_pipeline"] >= 0.0);
  CHECK(report["share_outside_pipeline"] <= 1.0);
  CHECK(count_entries(fixture.folder / "out/labels") == 7);
  CHECK_FALSE(fs::exists(fixture.folder / "out/chunks"));
  const std::string timing = read_text(fixture.folder / "out/timing.csv");
  CHECK(std::count(timing.begin(), timing.end(), '\n') == 8);
  CHECK_THAT(timing, ContainsSubstring("\n000006,"));
}

namespace {

/// A floor, a wall, and a box that drives 0.25 m from scan to scan until it stops at scan `stop`.
std::vector<float> scan_with_stopping_box(std::size_t i, std::size_t stop) {
  std::vector<float> xyzi = tiny_scan(0);
  xyzi.resize(xyzi.size() - kBoxPoints * 4);
  const double begin = -8.0 + 0.25 * static_cast<double>(std::min(i, stop));
  for (std::size_t k = 0; k < kBoxPoints; ++k) {
    const auto across = static_cast<double>(k / 8), up = static_cast<double>(k % 8);
    for (const double value : {10.0, begin + 0.07 * across, -1.3 + 0.15 * up, 0.5}) {
      xyzi.push_back(static_cast<float>(value));
    }
  }
  return xyzi;
}

}  // namespace

TEST_CASE("behind a border, an object that stopped keeps its id and stays dynamic") {
  constexpr std::size_t kScans = 150, kStop = 40;
  const ChunkFixture fixture(kScans);
  for (std::size_t i = 0; i < kScans; ++i) {
    const std::vector<float> scan = scan_with_stopping_box(i, kStop);
    write_scan(fixture.seq + "/velodyne/" + scan_name(i) + ".bin", scan);
  }
  REQUIRE(fixture.run("stream", {}).code == 0);
  REQUIRE(fixture.run("chunks", {"--chunk", "75", "--lookback", "20", "--jobs", "2"}).code == 0);
  const std::size_t points = tiny_scan(0).size() / 4;
  const auto box = [&](const std::string& out, std::size_t i) {
    return read_labels(fixture.folder / (out + "/labels/" + scan_name(i) + ".label"), points)
        .at(points - kBoxPoints / 2);
  };
  // The warm-up of the second chunk begins when the box stands.
  const std::uint32_t before = box("chunks", 74);
  REQUIRE((before & 0xFFFFU) == 251);
  REQUIRE(before >> 16U != 0);
  for (std::size_t i = 75; i < kScans; ++i) {
    CAPTURE(i);
    REQUIRE(box("stream", i) == before);
    REQUIRE(box("chunks", i) == before);
  }
  CHECK(fixture.report("chunks")["labels"] == fixture.report("stream")["labels"]);
  const auto size = [&](const std::string& file) {
    return read_points(fixture.folder / file).positions.size();
  };
  CHECK(size("chunks/dynamic_points.ply") == size("stream/dynamic_points.ply"));
}

TEST_CASE("a killed run in chunks is resumed with the chunks that it had finished") {
  const ChunkFixture fixture(60);
  const Flags flags = {"--chunk", "5", "--jobs", "2", "--lookback", "4"};
  REQUIRE(fixture.run("expected", flags).code == 0);
  for (const std::size_t chunks : {std::size_t{1}, std::size_t{4}, std::size_t{9}}) {
    {
      Process process(fixture.arguments("out", flags));
      kill_after_chunks(process, fixture.folder / "out/chunks", chunks);
      process.wait();
    }
    if (fixture.report("out")["complete"] == true) continue;  // it was faster
    Flags resumed = flags;
    resumed[3] = "3";  // another number of jobs
    resumed.emplace_back("--resume");
    const Outcome outcome = fixture.run("out", resumed);
    CAPTURE(chunks, outcome.err);
    REQUIRE(outcome.code == 0);
    CHECK(outcome.err.find("warning") == std::string::npos);
    CHECK(fixture.report("out")["kept_chunks"] >= chunks);
    check_same_files(fixture.folder / "expected", fixture.folder / "out");
    fs::remove_all(fixture.folder / "out");
  }
}

TEST_CASE("a broken chunk is processed again, and one of another grid is refused") {
  const ChunkFixture fixture(60);
  const Flags flags = {"--chunk", "5", "--jobs", "1", "--lookback", "4"};
  REQUIRE(fixture.run("expected", flags).code == 0);
  {
    Process process(fixture.arguments("out", flags));
    kill_after_chunks(process, fixture.folder / "out/chunks", 3);
    process.wait();
  }
  REQUIRE(fixture.report("out")["complete"] == false);
  const Outcome other = fixture.run("out", {"--chunk", "6", "--lookback", "4", "--resume"});
  CHECK(other.code == 1);
  CHECK_THAT(other.err, ContainsSubstring("chunk was 5, is 6"));

  const fs::path chunks = fixture.folder / "out/chunks";
  std::string bytes = read_text(chunks / "000005.chunk");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  write_text(chunks / "000005.chunk", bytes);
  write_text(chunks / "000010.chunk", "");
  write_text(chunks / ".000055.chunk.0123456789abcdef.tmp", "half");
  Flags resumed = flags;
  resumed.emplace_back("--resume");
  const Outcome outcome = fixture.run("out", resumed);
  CAPTURE(outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK_THAT(outcome.err, ContainsSubstring("000005.chunk: does not have the bytes that were "
                                            "written; the chunk is processed again"));
  CHECK_THAT(outcome.err, ContainsSubstring("000010.chunk: is cut off; the chunk is"));
  check_same_files(fixture.folder / "expected", fixture.folder / "out");
}

TEST_CASE("after Ctrl-C a run in chunks keeps the finished ones and says that it is unfinished") {
  const ChunkFixture fixture(60);
  const Flags flags = {"--chunk", "5", "--jobs", "2", "--lookback", "4"};
  REQUIRE(fixture.run("expected", flags).code == 0);
  Outcome interrupted;
  {
    Process process(fixture.arguments("out", flags));
    const fs::path chunks = fixture.folder / "out/chunks";
    for (int i = 0; i < 20000 && !fs::exists(chunks / "000000.chunk"); ++i) {
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
    ::kill(process.id(), SIGINT);
    interrupted = process.wait();
  }
  CHECK(interrupted.code == 130);
  const nlohmann::json report = fixture.report("out");
  CHECK(report["complete"] == false);
  CHECK(report["scans"] == 5 * report["chunks"].get<std::size_t>());
  CHECK(report["chunks"] >= 1);
  CHECK(count_entries(fixture.folder / "out/labels") == report["scans"]);
  Flags resumed = flags;
  resumed.emplace_back("--resume");
  REQUIRE(fixture.run("out", resumed).code == 0);
  CHECK(fixture.report("out")["kept_chunks"] >= report["chunks"]);
  check_same_files(fixture.folder / "expected", fixture.folder / "out");
}

TEST_CASE("flag --force replaces results by those of a run in chunks") {
  const ChunkFixture fixture;
  REQUIRE(fixture.run("out", {"--write-online"}).code == 0);
  REQUIRE(fixture.run("out", {"--chunk", "6", "--force"}).code == 0);
  REQUIRE(fixture.run("expected", {"--chunk", "6"}).code == 0);
  check_same_files(fixture.folder / "expected", fixture.folder / "out");
}

TEST_CASE("flags of chunks that are wrong or do not fit together: exit code 2, nothing written") {
  const ChunkFixture fixture(3);
  const std::vector<std::pair<Flags, std::string>> cases = {
      {{"--jobs", "0"}, "--jobs 0: expected at least 1"},
      {{"--jobs", "-2"}, "--jobs -2: expected at least 1"},
      {{"--jobs", "two"}, "--jobs"},
      {{"--chunk", "-1"}, "--chunk -1: expected at least 0"},
      {{"--chunk", "5", "--lookback", "-1"}, "--lookback -1: expected at least 0"},
      {{"--lookback", "5"}, "--lookback needs --chunk"},
      {{"--lookback", "5", "--chunk", "0"}, "--lookback needs --chunk"},
      {{"--jobs", "2", "--chunk", "0"}, "--jobs 2 with --chunk 0"},
      {{"--revise-map", "true", "--chunk", "5"}, "--revise-map with --chunk"},
  };
  for (const auto& [flags, message] : cases) {
    CAPTURE(flags);
    const Outcome outcome = fixture.run("out", flags);
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err, ContainsSubstring(message));
    CHECK_FALSE(fs::exists(fixture.folder / "out"));
  }
}
