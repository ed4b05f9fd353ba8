#include "dynains/simulation/write_sequence.hpp"

#include <filesystem>

#include "dynains/errors.hpp"
#include "dynains/io/recording.hpp"
#include "support/catch.hpp"

namespace dynains::simulation {

namespace {

/// A temporary folder, which is removed at the end.
struct Folder {
  std::filesystem::path path;
  explicit Folder(const char* name) : path(std::filesystem::temp_directory_path() / name) {
    std::filesystem::remove_all(path);
  }
  ~Folder() { std::filesystem::remove_all(path); }
};

Config three_scans() {
  Config config;
  config.sensor = Sensor::kVlp16;
  config.scans = 3;
  config.pose_noise_translation = 0.05;
  return config;
}

}  // namespace

TEST_CASE("a written sequence is read back") {
  const Folder folder("dynains_simulated_sequence");
  Simulator simulator(three_scans());
  std::size_t calls = 0;
  const bool complete =
      write_sequence(simulator, folder.path, [&](std::size_t done, std::size_t n) {
        CHECK(done == ++calls);
        CHECK(n == 3);
        return true;
      });
  CHECK(complete);
  CHECK(calls == 3);
  const Recording recording(folder.path);
  REQUIRE(recording.size() == 3);
  CHECK(recording.has_labels());
  for (std::size_t i = 0; i < 3; ++i) {
    const SimulatedScan scan = simulator.scan(i);
    CHECK(recording.read_scan(i).xyzi == scan.xyzi);
    CHECK(recording.read_labels(i) == scan.labels);
    CHECK(recording.time(i) == Approx(scan.time).margin(1e-6));
    CHECK((recording.T_world_sensor(i).matrix() - scan.T_world_sensor_noisy.matrix()).norm() <
          1e-6);
  }
  CHECK(std::filesystem::exists(folder.path / "poses_true.txt"));
}

TEST_CASE("a stopped sequence has no poses") {
  const Folder folder("dynains_simulated_stop");
  Simulator simulator(three_scans());
  CHECK_FALSE(write_sequence(simulator, folder.path,
                             [](std::size_t done, std::size_t) { return done < 2; }));
  CHECK(std::filesystem::exists(folder.path / "velodyne" / "000001.bin"));
  CHECK_FALSE(std::filesystem::exists(folder.path / "velodyne" / "000002.bin"));
  CHECK_FALSE(std::filesystem::exists(folder.path / "poses.txt"));
}

TEST_CASE("a folder that cannot be created is an error") {
  Simulator simulator(three_scans());
  CHECK_THROWS_AS(write_sequence(simulator, "/dev/null/sequence"), IoError);
}

}  // namespace dynains::simulation
