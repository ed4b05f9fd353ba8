// Recordings without poses: dynains odometry, dynains run --odometry and what they say.

#include "dynains/io/kitti.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/io/trajectory.hpp"
#include "program/start.hpp"
#include "support/catch.hpp"

namespace dynains::test {
namespace {

/// A simulated hall without its poses. `lost_from` to `found_from`: these scans are of a street.
class Unposed {
 public:
  explicit Unposed(int scans = 12, int lost_from = 1000, int found_from = 1000) {
    simulate("hall", scans);
    const fs::path velodyne = sequence() / "velodyne";
    if (lost_from < scans) {
      const fs::path street = folder_ / "street";
      succeed(start({"simulate", street, "--scene", "urban", "--sensor", "vlp16", "--scans",
                     std::to_string(scans), "-q"}));
      for (int i = lost_from; i < std::min(scans, found_from); ++i) {
        const std::string name = (i < 10 ? "00000" : "0000") + std::to_string(i) + ".bin";
        fs::copy_file(street / "velodyne" / name, velodyne / name,
                      fs::copy_options::overwrite_existing);
      }
      fs::remove_all(sequence() / "labels");
    }
    exact_ = Recording(sequence());
    fs::remove(sequence() / "poses.txt");
  }

  Outcome odometry(const fs::path& poses, const Arguments& more = {}) const {
    return start(Arguments{"odometry", sequence(), "--out", poses, "-q"} + more);
  }
  Outcome run(const fs::path& out, const Arguments& more = {}) const {
    return start(Arguments{"run", sequence(), "--odometry", "--out", out, "-q"} + more);
  }
  fs::path sequence() const { return folder_ / "sequence"; }
  fs::path operator/(const std::string& name) const { return folder_ / name; }
  const Recording& exact() const { return *exact_; }

 private:
  void simulate(const char* scene, int scans) {
    succeed(start({"simulate", sequence(), "--scene", scene, "--sensor", "vlp16", "--seed", "8",
                   "--scans", std::to_string(scans), "-q"}));
  }

  TemporaryFolder folder_;
  std::optional<Recording> exact_;
};

TEST_CASE("Without poses, commands propose the odometry, and it finds the poses") {
  const Unposed recording;
  for (const Arguments& command :
       {Arguments{"check", recording.sequence()},
        Arguments{"run", recording.sequence(), "--out", recording / "x"}}) {
    check_refused(start(command), 1, "run --odometry estimates them");
  }

  const fs::path poses = recording / "poses.txt";
  succeed(recording.odometry(poses));
  const Trajectory found = read_trajectory(poses);
  REQUIRE(found.poses.size() == 12);
  const Pose T_first_world = recording.exact().T_world_sensor(0).inverse();
  for (std::size_t i = 0; i < 12; ++i) {
    const Pose exact = T_first_world * recording.exact().T_world_sensor(i);
    CHECK((found.poses[i].translation() - exact.translation()).norm() < 0.1);
  }
  CHECK_THAT(recording.odometry(poses).err, ContainsSubstring("--force"));
  CHECK_FALSE(fs::exists(poses.string() + ".partial"));
  CHECK(recording.odometry(poses, {"--force", "--one-thread"}).code == 0);
  CHECK(read_trajectory(poses).poses.back().matrix() == found.poses.back().matrix());

  // In the recording, poses of the odometry are replaced, and those of others are not.
  const fs::path inside = recording.sequence() / "poses.txt";
  for (int i = 0; i < 2; ++i) succeed(recording.odometry(inside, {"--force"}));
  write_text(inside, read_text(inside) + "\n");
  check_refused(recording.odometry(inside, {"--force"}), 1, "is a part of");
  fs::remove(inside);

  const fs::path out = recording / "out";
  succeed(recording.run(out));
  CHECK(read_trajectory(out / "poses.txt").poses.back().matrix() == found.poses.back().matrix());
  CHECK(count_entries(out / "labels") == 12);
  succeed(recording.run(out, {"--force"}));
  CHECK(start({"view", out}).code == 0);
}

TEST_CASE("After a loss of track, the scans before it have results") {
  const Unposed recording(12, 8);
  const fs::path poses = recording / "poses.txt";
  check_refused(recording.odometry(poses), 3, "lost track at scan 000008");
  CHECK(read_trajectory(poses).poses.size() == 8);
  const fs::path out = recording / "out";
  check_refused(recording.run(out), 3, "lost track at scan 000008");
  CHECK(count_entries(out / "labels") == 8);
}

TEST_CASE("Scans that fit to none before are named, and the odometry goes on behind them") {
  const Unposed recording(14, 8, 10);
  const fs::path poses = recording / "poses.txt";
  check_warns(recording.odometry(poses), "2 scans from 000008 to 000009: no hold");
  const Trajectory found = read_trajectory(poses);
  REQUIRE(found.poses.size() == 14);
  const Pose exact =
      recording.exact().T_world_sensor(0).inverse() * recording.exact().T_world_sensor(13);
  CHECK((found.poses[13].translation() - exact.translation()).norm() < 0.1);
}

TEST_CASE("The odometry says about the clouds what a run says") {
  const Unposed recording;
  const fs::path scan = recording.sequence() / "velodyne" / "000000.bin";
  std::vector<float> xyzi;
  read_scan(scan, xyzi);
  for (float& value : xyzi) value = 0.05F * std::round(value / 0.05F);
  write_scan(scan, xyzi);
  const std::string expected = "warning: points lie on a grid of 0.05 m";
  check_warns(recording.odometry(recording / "poses.txt"), expected);
  CHECK_THAT(recording.run(recording / "out").err, ContainsSubstring(expected));
}

TEST_CASE("A loss of track at the second scan leaves nothing, with the exit code of a later one") {
  const Unposed recording(4, 1);
  const fs::path out = recording / "out";
  for (const bool is_run : {false, true}) {
    check_refused(is_run ? recording.run(out) : recording.odometry(out), 3,
                  "lost track at scan 000001");
    CHECK_FALSE(fs::exists(out));
  }
}

TEST_CASE("The odometry refuses what it cannot use") {
  const Unposed recording(3);
  const auto check = [&](const Arguments& more, int code, const std::string& words) {
    check_refused(recording.odometry(recording / "new.txt", more), code, words);
    CHECK_FALSE(fs::exists(recording / "new.txt"));
  };
  check({"--start", "1", "--end", "1"}, 2, "two scans or more");
  check({"--invert-poses"}, 2, "--invert-poses is about given poses");
  check({"--frame", "world"}, 1, "frame of the world");
  check_refused(start({"run", recording.sequence(), "--no-deskew", "--out", recording / "out"}), 2,
                "needs --odometry");
}

}  // namespace
}  // namespace dynains::test
