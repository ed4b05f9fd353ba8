// `dynains run --write-log`: the log again, with other clouds.
#include <sys/resource.h>

#include <csignal>

#include "dynains/io/recording.hpp"
#include "io/log_writer.hpp"
#include "io/logs/log_file.hpp"
#include "program/run_folder.hpp"
#include "program/tiny_sequence.hpp"
#include "support/catch.hpp"
#include "support/rig_log.hpp"

using namespace dynains;
using namespace dynains::test;

namespace {

constexpr std::size_t kScans = 12;
constexpr std::size_t kPointBytes = 19;
constexpr std::uint8_t kUint8 = 2, kUint16 = 4;

/// Points with columns that nothing here reads, one of which cannot be compressed.
std::string points_of_scan(std::size_t i, const std::vector<bool>& keep = {}) {
  const std::vector<float> scan = tiny_scan(i);
  std::string points;
  for (std::size_t k = 0; k < scan.size() / 4; ++k) {
    if (!keep.empty() && !keep[k]) continue;
    for (std::size_t c = 0; c < 4; ++c) points += packed(scan[4 * k + c]);
    points +=
        packed(static_cast<std::uint16_t>(40503 * (k + 977 * i)), static_cast<std::uint8_t>(i));
  }
  return points;
}

std::string cloud_of(std::size_t i, const std::string& points) {
  const std::vector<CloudField> fields =
      xyz_and({{"intensity", 12, 7}, {"ambient", 16, kUint16}, {"tag", 18, kUint8}});
  return cloud_message(MessageEncoding::kCdr, 0.1 * static_cast<double>(i), "lidar", fields,
                       kPointBytes, points);
}

/// The tiny sequence as a log, with messages of another kind.
std::string tiny_log() {
  std::vector<WrittenMessage> messages;
  for (std::size_t i = 0; i < kScans; ++i) {
    const double time = 0.1 * static_cast<double>(i);
    messages.push_back({0, nanoseconds(time), cloud_of(i, points_of_scan(i))});
    messages.push_back({1, nanoseconds(time), odometry(time, "lidar", pose_at(0, 0))});
    messages.push_back({2, nanoseconds(time) + 5, "{\"scan\": " + std::to_string(i) + "}"});
  }
  return mcap_file({kClouds, kOdometry, {"/camera", "any/msg/Thing", "json"}}, messages, {});
}

/// The messages that the log without moving points of scans from `first` on has.
std::vector<Message> cleaned(const fs::path& log, const fs::path& out, std::size_t first) {
  std::vector<Message> messages = messages_of(log);
  std::size_t scan = 0;
  for (Message& message : messages) {
    if (message.first.rfind("/points", 0) != 0) continue;
    const std::size_t i = scan++;
    if (i < first) continue;
    std::vector<bool> keep;
    for (const std::uint32_t label : labels_in(out, scan_name(i)))
      keep.push_back(!is_removed(label));
    CHECK(keep.size() == tiny_scan(i).size() / 4);
    message.second = cloud_of(i, points_of_scan(i, keep));
  }
  CHECK(scan == kScans);
  return messages;
}

struct Fixture : RunFolder {
  Fixture() { write_text(log, tiny_log()); }

  Outcome run(const Arguments& flags) const {
    return start(Arguments{"run", log, "--out", out, "--quiet"} + flags);
  }

  std::string log = folder / "drive.mcap";
  std::string target = folder / "clean" / "drive.mcap";
};

}  // namespace

TEST_CASE(
    "run --write-log writes the log again: clouds without moving points, all else as it was") {
  Fixture fixture;
  fs::create_directory(fixture.folder / "clean");
  const Outcome outcome = succeed(fixture.run({"--write-log", fixture.target}));
  CHECK(outcome.err.empty());
  const std::vector<Message> expected = cleaned(fixture.log, fixture.out, 0);
  CHECK(expected != messages_of(fixture.log));
  CHECK(messages_of(fixture.target) == expected);
  CHECK(count_entries(fixture.folder / "clean") == 1);

  // The log can be run over again, and --force replaces the one of the same results alone.
  CHECK(start({"run", fixture.target, "--out", fixture.folder / "again"}).code == 0);
  const std::string bytes = read_text(fixture.target);
  CHECK(fixture.run({"--write-log", fixture.target, "--force"}).code == 0);
  CHECK(read_text(fixture.target) == bytes);
  check_refused(start({"run", fixture.log, "--out", fixture.folder / "other", "--force",
                       "--write-log", fixture.target}),
                1, "drive.mcap: exists");
}

TEST_CASE("Clouds without a verdict stay in the log as they are, and their number is told") {
  Fixture fixture;
  const std::string target = fixture.folder / "window.mcap";
  check_warns(fixture.run({"--write-log", target, "--start", "3"}),
              "window.mcap: 3 clouds have no verdict");
  CHECK(messages_of(target) == cleaned(fixture.log, fixture.out, 3));
}

TEST_CASE("run --mark adds the labels of the run to all clouds") {
  Fixture fixture;
  const std::string target = fixture.folder / "marked.mcap";
  succeed(fixture.run({"--write-log", target, "--mark", "--start", "3"}));
  const std::vector<Message> before = messages_of(fixture.log);
  const std::vector<Message> after = messages_of(target);
  REQUIRE(after.size() == before.size());
  std::size_t scan = 0;
  for (std::size_t m = 0; m < before.size(); ++m) {
    CHECK(after[m].first == before[m].first);
    if (before[m].first.rfind("/points", 0) != 0) {
      CHECK(after[m].second == before[m].second);
      continue;
    }
    ++scan;
  }
  CHECK(scan == kScans);
  const Recording marked(target);
  for (std::size_t i = 0; i < kScans; ++i) {
    const std::size_t count = tiny_scan(i).size() / 4;
    std::vector<std::uint32_t> labels(count, 0);
    if (i >= 3) labels = labels_in(fixture.out, scan_name(i));
    for (std::uint32_t& label : labels) label &= 0xffU;
    CHECK(marked.read_labels(i) == labels);
  }
  // The marked log is a recording with labels.
  CHECK(start({"eval", target, fixture.out}).code == 0);
  check_refused(start({"run", target, "--out", fixture.folder / "again", "--write-log",
                       fixture.folder / "twice.mcap", "--mark"}),
                2, "have labels already");
}

TEST_CASE("A rig with a topic for each sensor is run as its merged clouds, and cleaned by topic") {
  const TemporaryFolder folder;
  const std::string rig = folder / "rig";
  succeed(start({"simulate", rig, "--rig", "corners", "--sensor", "vlp16", "--scans", "25",
                 "--pose-noise-translation", "0", "--pose-noise-rotation", "0"}));
  const Recording merged(rig);
  const std::string log = folder / "rig.mcap", clean = folder / "clean.mcap";
  write_rig_log(merged, {0.0, 0.045}, merged.sensors(), log);
  const Arguments topics = {"--cloud-topic", "/lidar0,/lidar1"};
  const std::string out = folder / "out", of_rig = folder / "of_rig";
  succeed(start({"run", rig, "--out", of_rig}));
  succeed(start(Arguments{"run", log, "--out", out, "--write-log", clean} + topics));
  CHECK(report_in(out)["scans"] == 24);

  RecordingOptions options;
  options.cloud_topic = topics[1];
  const Recording before(log, options), after(clean, options);
  REQUIRE(after.size() == 24);
  std::size_t moving = 0, same = 0, points = 0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    const RecordedScan scan = before.read_scan(i);
    const auto labels = labels_in(out, scan_name(i)), expected = labels_in(of_rig, scan_name(i));
    REQUIRE(labels.size() == scan.size());
    REQUIRE(expected.size() == scan.size());
    std::vector<float> kept;
    for (std::size_t k = 0; k < scan.size(); ++k) {
      const bool moves = is_removed(labels[k]);
      moving += moves ? 1 : 0;
      same += moves == is_removed(expected[k]) ? 1 : 0;
      if (!moves) kept.insert(kept.end(), {scan.xyzi[4 * k], scan.xyzi[4 * k + 1]});
    }
    points += scan.size();
    std::vector<float> found;
    const RecordedScan cleaned_scan = after.read_scan(i);
    for (std::size_t k = 0; k < cleaned_scan.size(); ++k) {
      found.insert(found.end(), {cleaned_scan.xyzi[4 * k], cleaned_scan.xyzi[4 * k + 1]});
    }
    CHECK(found == kept);
  }
  CHECK(moving > 0);
  CHECK(static_cast<double>(same) > 0.995 * static_cast<double>(points));
}

TEST_CASE("A log that is a folder is written as one file, not into that folder") {
  Fixture fixture;
  const fs::path parts = fixture.folder / "parts";
  fs::create_directory(parts);
  fs::rename(fixture.log, parts / "parts_0.mcap");
  write_text(parts / "metadata.yaml", "relative_file_paths:\n  - parts_0.mcap\n");
  fixture.log = parts;
  CHECK_THAT(fixture.run({"--write-log", parts / "clean.mcap"}).err,
             ContainsSubstring("is read by this command"));
  const fs::path target = fixture.folder / "clean.mcap";
  succeed(fixture.run({"--write-log", target}));
  CHECK(messages_of(target) == cleaned(parts, fixture.out, 0));
}

TEST_CASE("run --write-log refuses places and recordings before the run, and changes nothing") {
  Fixture fixture;
  write_tiny_sequence(fixture.folder / "seq", 4);
  write_text(fixture.folder / "mine.mcap", "mine");
  const std::string there = fixture.folder / "mine.mcap";
  const std::string before = read_text(fixture.log);
  struct Case {
    Arguments flags;
    int code;
    std::string text;
  };
  const std::vector<Case> cases = {
      {{"--write-log", there}, 1, "exists, and is no file of the results"},
      {{"--write-log", fixture.log, "--force"}, 1, "drive.mcap"},
      {{"--write-log", fixture.folder / "a.bag"}, 2, "ends in .mcap"},
      {{"--write-log", fs::path(fixture.out) / "a.mcap"}, 2, "outside of --out"},
      {{"--write-log", fixture.folder / "none" / "a.mcap"}, 1, "none: cannot be opened"},
      {{"--mark"}, 2, "--mark needs --write-log"}};
  for (const Case& one : cases) {
    check_refused(fixture.run(one.flags), one.code, one.text);
    CHECK_FALSE(fs::exists(fixture.out));
  }
  fixture.log = fixture.folder / "seq";
  check_refused(fixture.run({"--write-log", fixture.folder / "a.mcap"}), 2,
                "the recording is no log");
  CHECK(read_text(there) == "mine");
  CHECK(read_text(fixture.folder / "drive.mcap") == before);
}

TEST_CASE("A log that does not fit on the disk leaves nothing, for the results are not whole") {
  Fixture fixture;
  const std::string target = fixture.folder / "big.mcap";
  // No other result is as large as the log.
  succeed(fixture.run({"--write-log", target, "--passes", "1", "--map-voxel", "2"}));
  const rlimit limit{fs::file_size(target) - 1, fs::file_size(target) - 1};
  fs::remove(target);
  fs::remove_all(fixture.out);
  const auto limit_files = [&] {
    std::signal(SIGXFSZ, SIG_IGN);
    ::setrlimit(RLIMIT_FSIZE, &limit);
  };
  const Arguments flags = {"--write-log", target, "--passes", "1", "--map-voxel", "2"};
  check_refused(
      start(Arguments{"run", fixture.log, "--out", fixture.out, "-q"} + flags, limit_files), 1,
      "big.mcap");
  CHECK(count_entries(fixture.folder.path()) == 1);
  CHECK(fixture.run(flags).code == 0);
  CHECK(messages_of(target) == cleaned(fixture.log, fixture.out, 0));
}
