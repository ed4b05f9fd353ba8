#include "simulation/write_sequence.hpp"

#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"

namespace dynains::simulation {

namespace {

Config three_scans() {
  Config config;
  config.sensor = Sensor::kVlp16;
  config.scans = 3;
  config.pose_noise_translation = 0.05;
  return config;
}

}  // namespace

TEST_CASE("a stopped sequence has no poses") {
  const test::TemporaryFolder folder;
  Simulator simulator(three_scans());
  CHECK_FALSE(write_sequence(simulator, folder.path(),
                             [](std::size_t done, std::size_t) { return done < 2; }));
  CHECK(std::filesystem::exists(folder / "velodyne/000001.bin"));
  CHECK_FALSE(std::filesystem::exists(folder / "velodyne/000002.bin"));
  CHECK_FALSE(std::filesystem::exists(folder / "poses.txt"));
}

TEST_CASE("a folder that cannot be created is an error") {
  Simulator simulator(three_scans());
  CHECK_THROWS_AS(write_sequence(simulator, "/dev/null/sequence"), IoError);
}

}  // namespace dynains::simulation
