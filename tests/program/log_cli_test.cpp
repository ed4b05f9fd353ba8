// The program with logs of ROS instead of folders of scans.
#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "io/log_writer.hpp"
#include "program/run_folder.hpp"
#include "reliability/tree.hpp"
#include "support/catch.hpp"

using namespace dynains;
using namespace dynains::test;

TEST_CASE(
    "De-skewing by --deskew restores the scores that a rolling shutter costs, and keeps times of "
    "points") {
  const TemporaryFolder folder;
  const std::string log = folder / "drive" / "drive.mcap";
  check_refused(start({"simulate", folder / "kitti", "--scans", "2", "--rolling-shutter", "true"}),
                2, "--rolling-shutter needs --format mcap");
  succeed(start({"simulate", folder / "drive", "--format", "mcap", "--scene", "urban", "--sensor",
                 "vlp16", "--scans", "30", "--rolling-shutter", "true"}));
  const auto static_accuracy = [&](const Arguments& flags) {
    const std::string out = folder / ("out" + std::to_string(flags.size()));
    // Corrected poses alone make good for a part of the distortion.
    succeed(start(Arguments{"run", log, "--out", out, "--write-clean", "--pose-tolerance", "0"} +
                  flags));
    const Outcome scores = succeed(start(Arguments{"eval", log, out} + flags));
    std::istringstream row(scores.out.substr(scores.out.find("\nrun ")));
    std::string name;
    double preservation = 0, rejection = 0, f1 = 0, accuracy = 0;
    row >> name >> preservation >> rejection >> f1 >> accuracy;
    return accuracy;
  };
  const double distorted = static_accuracy({});
  const double deskewed = static_accuracy({"--deskew"});
  CHECK(deskewed > 98.0);
  CHECK(distorted < deskewed - 0.5);
  const RecordedScan raw = Recording(log).read_scan(3);
  const Recording clean(folder / "out1" / "clean");
  CHECK(clean.columns().time);
  const RecordedScan scan = clean.read_scan(3);
  CHECK(std::includes(raw.time.begin(), raw.time.end(), scan.time.begin(), scan.time.end()));
  CHECK(scan.xyzi[0] != raw.xyzi[0]);
}

TEST_CASE("Memory for reading does not grow with the log") {
  const TemporaryFolder folder;
  constexpr std::size_t kMegabyte = std::size_t{1} << 20U;
  const std::string points(12 * 40000, '\1');
  const auto write = [&](int clouds) {
    std::vector<WrittenMessage> messages;
    for (int i = 0; i < clouds; ++i) {
      const double time = 0.1 * i;
      messages.push_back({0, nanoseconds(time),
                          cloud_message(MessageEncoding::kCdr, time, "lidar", kXyz, 12, points)});
      messages.push_back(
          {1, nanoseconds(time), odometry(time, "lidar", Eigen::Isometry3d::Identity())});
    }
    write_text(folder / "drive.mcap", mcap_file({kClouds, kOdometry}, messages, {}));
  };
  const auto peak_memory = [&](int clouds) {
    // A new process counts the memory of this one, too, so that the log in memory must be gone.
    write(clouds);
    Process process({"check", folder / "drive.mcap"});
    const Outcome outcome = process.wait();
    CAPTURE(outcome.err);
    REQUIRE_THAT(outcome.out, ContainsSubstring(std::to_string(clouds) + " scans with a pose"));
    return process.peak_memory();
  };
  const std::size_t least = peak_memory(50);  // more than the sample of a check
  CHECK(least > kMegabyte);
  CHECK(peak_memory(200) < least + 2 * kMegabyte);  // of 72 MB more
}

TEST_CASE("run, check and eval read a log as the folder of its scans, a truncated one to its end") {
  const TemporaryFolder folder;
  const Arguments flags = {"--sensor", "vlp16", "--scans", "12", "--seed", "5"};
  const auto simulate = [&](const std::string& out, const Arguments& more) {
    return start(Arguments{"simulate", out} + flags + more);
  };
  succeed(simulate(folder / "seq", {}));
  succeed(start({"run", folder / "seq", "--out", folder / "of_folder"}));
  const std::string log_folder = folder / "mcap";
  const std::string log = folder / "mcap" / "drive.mcap";
  CHECK(simulate(log_folder, {"--format", "mcap"}).out == "12 scans: " + log + "\n");
  CHECK(count_entries(log_folder) == 2);
  const std::string out = folder / "of_log";
  const Outcome outcome = succeed(start({"run", log, "--out", out, "--write-clean"}));
  CHECK_THAT(outcome.err, !ContainsSubstring("ends early"));
  CHECK(read_tree(folder / "of_log/labels") == read_tree(folder / "of_folder/labels"));
  const nlohmann::json report = report_in(out);
  CHECK(report["scans"] == 12);
  CHECK(report["log_ends_early"] == false);
  CHECK(start({"eval", log, out}).out == start({"eval", folder / "seq", folder / "of_folder"}).out);
  CHECK_THAT(start({"check", log}).out, ContainsSubstring("clouds from topic /points"));
  // The clean scans, without moving points, have the poses of the log.
  CHECK_THAT(start({"check", out + "/clean"}).out,
             ContainsSubstring("poses from VIEWPOINT of the scans") &&
                 ContainsSubstring("points are in the frame of the sensor"));

  const std::string first = read_text(log);
  succeed(simulate(log_folder, {"--format", "mcap", "--force"}));
  CHECK(read_text(log) == first);
  succeed(simulate(log_folder, {"--force"}));
  CHECK_FALSE(fs::exists(log));

  // A log of two chunks.
  succeed(start({"simulate", log_folder, "--format", "mcap", "--sensor", "vlp16", "--scans", "24",
                 "--force"}));
  const std::string whole = read_text(log);
  const std::string cut = folder / "cut.mcap";
  write_text(cut, whole.substr(0, 3 * whole.size() / 4));
  const Outcome early = succeed(start({"run", cut, "--out", folder / "early", "--quiet"}));
  CHECK_THAT(early.err, StartsWith("dynains: warning: " + cut + ": byte ") &&
                            ContainsSubstring("the log ends early, as after a crash of its "
                                              "recorder; ") &&
                            ContainsSubstring(" scans before it are read\n"));
  CHECK(count_lines(early.err) == 1);
  CHECK(report_in(folder / "early")["log_ends_early"] == true);
}
